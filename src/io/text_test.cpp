#include "io/text.hpp"

#include <gtest/gtest.h>

#include <clocale>
#include <locale>

#include "core/rng.hpp"
#include "io/testing/temp_folder.hpp"

namespace ygslam {
namespace {

// A locale whose decimal point is a comma, on any machine.
struct CommaPoint : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

class GermanNumbers {
 public:
  GermanNumbers() : before_(std::locale::global(std::locale(std::locale(), new CommaPoint))) {
    std::setlocale(LC_NUMERIC, "de_DE.UTF-8");  // where installed
  }
  GermanNumbers(const GermanNumbers&) = delete;
  GermanNumbers& operator=(const GermanNumbers&) = delete;
  ~GermanNumbers() {
    std::locale::global(before_);
    std::setlocale(LC_NUMERIC, "C");
  }

 private:
  std::locale before_;
};

TEST(Stamp, FormatAndParseAreInverse) {
  Rng rng(1);
  for (int i = 0; i < 2000; ++i) {
    const int decimals = static_cast<int>(rng.below(10));
    std::int64_t unit = 1;
    for (int d = decimals; d < 9; ++d) unit *= 10;
    const auto magnitude = static_cast<std::int64_t>(rng.next() % 2'000'000'000'000'000'000ULL);
    const Timestamp stamp{(magnitude - 200'000'000'000'000'000) / unit * unit};
    const std::string text = format_stamp(stamp, decimals);
    const auto parsed = parse_stamp(text);
    ASSERT_TRUE(parsed.has_value()) << text;
    EXPECT_EQ(parsed->stamp, stamp) << text;
    EXPECT_EQ(parsed->decimals, decimals) << text;
  }
}

TEST(Stamp, IsNotRoundedThroughDouble) {
  EXPECT_EQ(parse_stamp("1305031242.123456789")->stamp.ns, 1305031242123456789);
  EXPECT_EQ(parse_stamp("1305031242.1234567896")->stamp.ns, 1305031242123456790);
  EXPECT_EQ(parse_stamp("1.305031242629711e+09")->stamp.ns, 1305031242629711000);
  EXPECT_EQ(parse_stamp("1.305031242629711000e+09")->decimals, 6);
  EXPECT_EQ(parse_stamp("5e-3")->stamp.ns, 5'000'000);
  EXPECT_EQ(parse_stamp("12")->decimals, 0);
}

TEST(Stamp, F11RefusesWhatIsNoNumberOrDoesNotFit) {
  for (const char* text : {"", "nan", "NaN", "inf", "-inf", "abc", "1.2.3", "1e", "1e99", ".", "-",
                           "1,5", "0x10", "99999999999", "1305031102160407000", "1 2"}) {
    EXPECT_FALSE(parse_stamp(text).has_value()) << text;
  }
}

TEST(Number, WholeWordsOnlyAndFinite) {
  EXPECT_EQ(parse_number("-1.5e3"), -1500.0);
  EXPECT_EQ(parse_number("+2"), 2.0);
  for (const char* text : {"", "nan", "inf", "1.5x", "1,5", "1e999", " 1"}) {
    EXPECT_FALSE(parse_number(text).has_value()) << text;
  }
}

TEST(Number, F37IsTheSameInALocaleWithDecimalComma) {
  const GermanNumbers german;
  EXPECT_EQ(parse_number("1.5"), 1.5);
  EXPECT_FALSE(parse_number("1,5").has_value());
  EXPECT_EQ(parse_stamp("1305031242.25")->stamp.ns, 1305031242250000000);
  EXPECT_EQ(format_stamp({1305031242250000000}, 3), "1305031242.250");
}

TEST(DataLines, SkipsCommentsBlanksByteOrderMarkAndCarriageReturns) {
  const auto lines = data_lines("\xEF\xBB\xBF# c\r\n\r\n  a b \r\n#x\nlast");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0].text, "a b");
  EXPECT_EQ(lines[0].number, 3);
  EXPECT_EQ(lines[1].text, "last");
  EXPECT_EQ(lines[1].number, 5);
}

TEST(NearestWord, FindsATypoAndNothingFarOff) {
  const std::vector<std::string_view> words = {"fx", "depth_scale", "width"};
  EXPECT_EQ(nearest_word("depthscale", words), "depth_scale");
  EXPECT_EQ(nearest_word("fxx", words), "fx");
  EXPECT_EQ(nearest_word("completely_else", words), "");
}

TEST(ReadFile, RefusesFoldersMissingAndLargeFilesByName) {
  const testing::TempFolder folder("ygslam text");
  const auto missing = read_file(folder.path() / "none");
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().message.find("none: no such file"), std::string::npos);
  EXPECT_FALSE(read_file(folder.path()).ok());
  EXPECT_FALSE(read_file("/dev/zero").ok());
  EXPECT_FALSE(read_file("/proc/self/mem").ok()) << "a regular file that cannot be read";
  const auto status = read_file("/proc/self/status");  // a size of 0 is told of it
  EXPECT_NE(status.ok() ? status->find("VmRSS") : std::string::npos, std::string::npos);
  EXPECT_FALSE(read_file("/proc/self/status", 10).ok());
  testing::write(folder.path() / "ten", "0123456789");
  EXPECT_EQ(*read_file(folder.path() / "ten"), "0123456789");
  EXPECT_FALSE(read_file(folder.path() / "ten", 9).ok());
}

TEST(Printable, LongWordsAreCutBetweenCharacters) {
  EXPECT_EQ(printable("abcdef", 3), "abc...");
  EXPECT_EQ(printable("ab\u00FCd", 3), "ab...");
  EXPECT_EQ(printable("ab\u00FCd", 4), "ab\u00FC...");
  EXPECT_EQ(printable("ab\u00FC", 4), "ab\u00FC");
  EXPECT_EQ(printable(std::string(1000, '\x80'), 4), "\\x80...");
}

}  // namespace
}  // namespace ygslam
