// Thousands of spoiled files: none may crash, hang, fill the memory or pass for a map it is not.
#include <sys/resource.h>

#include <chrono>

#include "map/map_fields.hpp"
#include "map_file/map_file_testing.hpp"

namespace ygslam {
namespace {

using namespace map_file_test;  // NOLINT(google-build-using-namespace): its own helpers
using map_file::RowKey;
using map_file::Table;
using testing::TempFolder;

/// YGSLAM_MUTANTS=10000 for the long run.
int mutants() {
  const char* text = std::getenv("YGSLAM_MUTANTS");
  return text == nullptr ? 150 : std::atoi(text);
}

#ifdef __SANITIZE_ADDRESS__
constexpr double kMayGrow_MB = 200 + 256;  // freed memory is kept aside for a while
#else
constexpr double kMayGrow_MB = 200;
#endif

double peak_mb() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

constexpr std::size_t kPage_bytes = 2048;  // of a new file

class MapMutants : public ::testing::Test {
 protected:
  MapMutants() : path_(folder_.path() / "room.map"), map_(some_map(6)) {
    EXPECT_TRUE(save_map(path_, map_, camera()).ok());
    whole_ = testing::read(path_);
    bytes_ = to_bytes(map_);
    before_MB_ = peak_mb();
  }
  ~MapMutants() override {
    EXPECT_LT(slowest_s_, 5);
    EXPECT_LT(peak_mb(), before_MB_ + kMayGrow_MB + 2e-6 * static_cast<double>(whole_.size()));
    std::printf(
        "%d refused, %d the map as it was, %d other maps that hold together; slowest %.2f s, "
        "%.0f MB more\n",
        refused_, same_, others_, slowest_s_, peak_mb() - before_MB_);
  }

  /// All that can be asked of a file.
  void try_it(bool may_differ) {
    const auto start = std::chrono::steady_clock::now();
    const auto map = load(path_);
    slowest_s_ =
        std::max(slowest_s_,
                 std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (!map.ok()) {
      ++refused_;
      EXPECT_EQ(map.error().kind, ErrorKind::kSavedMap);
    } else {
      const bool same = to_bytes(*map) == bytes_;
      ++(same ? same_ : others_);
      EXPECT_TRUE(same || may_differ) << "a wrong map was accepted";
    }
    (void)read_map_info(path_);
    const fs::path rest = folder_.path() / "rest.map";
    if (const auto recovery = recover_map(path_, rest); recovery.ok()) {
      const auto again = load_map(rest);
      EXPECT_TRUE(again.ok()) << again.error().message;
      fs::remove(rest);
    }
  }
  [[nodiscard]] std::uint32_t below(std::size_t n) {
    return rng_.below(static_cast<std::uint32_t>(n));
  }

  TempFolder folder_;
  fs::path path_;
  Map map_;
  std::string whole_, bytes_;
  Rng rng_{11};
  double before_MB_ = 0, slowest_s_ = 0;
  int refused_ = 0, same_ = 0, others_ = 0;
};

TEST_F(MapMutants, OfTheFilesBytes) {
  for (int i = 0; i < mutants() && !HasFailure(); ++i) {
    std::string bytes = whole_;
    const std::uint32_t changes = 1 + below(8);
    for (std::uint32_t change = 0; change < changes; ++change) {
      // Half of them where SQLite keeps its own: headers of file and pages.
      const std::size_t page = kPage_bytes * std::size_t{below(bytes.size() / kPage_bytes)};
      const std::size_t at = below(2) == 0 ? below(bytes.size()) : page + below(120);
      switch (below(5)) {
        case 0:
          bytes[at] = static_cast<char>(rng_.next());
          break;
        case 1:
          bytes[at] ^= static_cast<char>(1 << below(8));
          break;
        case 2:
          bytes[at] = below(2) == 0 ? '\xff' : '\0';
          break;
        case 3: {  // a page in another's place
          const std::size_t from = kPage_bytes * std::size_t{below(bytes.size() / kPage_bytes)};
          bytes.replace(page, kPage_bytes, bytes, from, kPage_bytes);
          break;
        }
        default:
          bytes.replace(at, std::min<std::size_t>(512, bytes.size() - at),
                        std::min<std::size_t>(512, bytes.size() - at), '\0');
      }
    }
    testing::write(path_, bytes);
    try_it(false);
  }
}

TEST_F(MapMutants, OfTheRowsSignedAgain) {
  constexpr std::array<Table, 6> kTables = {Table::kPose,         Table::kSeen,
                                            Table::kWeight,       Table::kLandmarks,
                                            Table::kObservations, Table::kRemoved};
  // Numbers that break what is not looked at.
  constexpr std::array<std::uint64_t, 8> kOdd = {
      0, 1, 0xffffffff, 0x7fffffff, 0x80000000, ~0ULL, 0x7ff8000000000000, 0x7ff0000000000000};
  for (int i = 0; i < mutants() && !HasFailure(); ++i) {
    testing::write(path_, whole_);
    const Table table = kTables[below(kTables.size())];
    const bool chunked = table >= Table::kLandmarks;
    const auto keyframe = std::next(map_.keyframes().begin(), below(map_.keyframes().size()));
    const RowKey key{table, chunked ? 0 : index(keyframe->first)};
    sign_row(path_, key, [&](std::string& raw) {
      const std::uint32_t changes = 1 + below(4);
      for (std::uint32_t change = 0; change < changes && !raw.empty(); ++change) {
        const std::size_t at =
            below(3) == 0 ? below(std::min<std::size_t>(raw.size(), 16)) : below(raw.size());
        switch (below(5)) {
          case 0:
            raw[at] = static_cast<char>(rng_.next());
            break;
          case 1:
            raw[at] ^= static_cast<char>(1 << below(8));
            break;
          case 2: {
            const std::uint64_t odd = kOdd[below(kOdd.size())];
            std::memcpy(raw.data() + at, &odd, std::min<std::size_t>(8, raw.size() - at));
            break;
          }
          case 3:
            raw.resize(at);
            break;
          default: {
            const auto count = below(64);
            raw.insert(at, raw.substr(below(raw.size()), count));
          }
        }
      }
    });
    try_it(true);  // a landmark a little aside is a map, too
  }
}

TEST_F(MapMutants, OfTheSummarySignedAgain) {
  for (int i = 0; i < mutants() / 4 && !HasFailure(); ++i) {
    testing::write(path_, whole_);
    sign_meta(path_, [&](map_file::Meta& meta) {
      const std::uint64_t odd = below(2) == 0 ? rng_.next() : below(20);
      switch (below(8)) {
        case 0:
          meta.info.camera.fx = std::bit_cast<double>(odd);
          break;
        case 1:
          meta.info.camera.width = static_cast<int>(odd);
          break;
        case 2:
          meta.info.camera.k2 = std::bit_cast<double>(odd);
          break;
        case 3:
          meta.info.pyramid_levels = static_cast<int>(odd);
          break;
        case 4:
          meta.info.pyramid_factor = std::bit_cast<double>(odd);
          break;
        case 5:
          meta.info.keyframes = odd;
          break;
        case 6:
          meta.numbers.next_keyframe = static_cast<std::uint32_t>(odd);
          break;
        default:
          meta.numbers.next_landmark = static_cast<std::uint32_t>(odd);
      }
    });
    try_it(true);  // numbers of ids that go on later are a map, too
  }
}

}  // namespace
}  // namespace ygslam
