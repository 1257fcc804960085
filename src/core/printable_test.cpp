#include "core/printable.hpp"

#include <gtest/gtest.h>

namespace ygslam {
namespace {

TEST(Printable, WhatSteersATerminalIsShownAsEscapes) {
  EXPECT_EQ(one_line("a\x1b[0m\n\t\r\x7f"), R"(a\x1b[0m\n\t\r\x7f)");
  EXPECT_EQ(one_line("\xC2\x9B"
                     "2J"),
            R"(\u009b2J)");  // C1's own CSI
  EXPECT_EQ(one_line("\xC2\x85"), R"(\u0085)");
  EXPECT_EQ(one_line(std::string_view("a\0b", 3)), R"(a\x00b)");
}

TEST(Printable, WhatTurnsOrHidesTextIsShownAsEscapes) {
  EXPECT_EQ(one_line("photo\u202Egpj.exe"), R"(photo\u202egpj.exe)");
  EXPECT_EQ(one_line("\u2066\u2069\u200E\u200F\u061C\u2028\u200B\uFEFF"),
            R"(\u2066\u2069\u200e\u200f\u061c\u2028\u200b\ufeff)");
  EXPECT_EQ(one_line("\U000E0041"), R"(\U000e0041)");
}

TEST(Printable, BytesThatAreNoUtf8AreShownAsEscapes) {
  EXPECT_EQ(one_line("a\xFF\xFE z"), R"(a\xff\xfe z)");
  EXPECT_EQ(one_line("\xC0\x80"), R"(\xc0\x80)");                  // longer than need be
  EXPECT_EQ(one_line("\xE0\x82\x9B"), R"(\xe0\x82\x9b)");          // U+009B, longer than need be
  EXPECT_EQ(one_line("\xED\xA0\x80"), R"(\xed\xa0\x80)");          // half of a pair
  EXPECT_EQ(one_line("\xF4\x90\x80\x80"), R"(\xf4\x90\x80\x80)");  // beyond the last
  EXPECT_EQ(one_line("\x9B"), R"(\x9b)");                          // C1 as terminals of old had it
  EXPECT_EQ(one_line("end\xC3"), R"(end\xc3)");
}

TEST(Printable, NamesOfAllLanguagesStay) {
  for (const char* name : {"", "plain name.png", "Büro", "空白", "офис", "שלום", "نافذة",
                           "👩‍🔬.jpg", "back\\slash"})
    EXPECT_EQ(one_line(name), name);
}

TEST(Printable, LinesOfATextStayApart) { EXPECT_EQ(several_lines("a\nb\x1b\n"), "a\nb\\x1b\n"); }

// Whatever the bytes: what comes out is unchanged by a second turn, so nothing unsafe is left.
TEST(Printable, NothingUnsafeIsLeft) {
  std::string all;
  for (int i = 0; i < 256; ++i)
    for (int k = 0; k < 256; k += 7) all += {static_cast<char>(i), static_cast<char>(k)};
  const std::string once = one_line(all);
  EXPECT_EQ(one_line(once), once);
  EXPECT_EQ(once.find('\x1b'), once.npos);
}

}  // namespace
}  // namespace ygslam
