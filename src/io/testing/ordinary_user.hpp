// For tests: an ordinary user's rights, also where root runs them.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

namespace ygslam::testing {

/// While this lives: root may read and write anywhere.
class OrdinaryUser {
 public:
  OrdinaryUser() : before_(::geteuid()) {
    if (before_ == 0 && ::seteuid(kNobody) != 0) before_ = kNobody;
  }
  OrdinaryUser(const OrdinaryUser&) = delete;
  OrdinaryUser& operator=(const OrdinaryUser&) = delete;
  ~OrdinaryUser() {
    if (before_ == 0) {
      EXPECT_EQ(::seteuid(0), 0);
    }
  }

  /// Makes a file or folder that user's, where root runs the test.
  static void give(const char* path) {
    if (::geteuid() == 0) {
      EXPECT_EQ(::chown(path, kNobody, kNobody), 0);
    }
  }

 private:
  static constexpr uid_t kNobody = 65534;
  uid_t before_;
};

}  // namespace ygslam::testing
