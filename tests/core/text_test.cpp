#include "panonav/core/text.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace panonav::testing {
namespace {

TEST(ReadableLine, KeepsUtf8AndReplacesTheRest) {
  const std::string fine = "a \"quote\" \xC3\xA4 \xE2\x82\xAC \xF0\x9F\xA4\x96 \xF4\x8F\xBF\xBF";
  EXPECT_EQ(readable_line(fine), fine);
  EXPECT_EQ(readable_line(""), "");
  EXPECT_EQ(readable_line("a\nb\tc\r\x7F" + std::string(1, '\0') + "\xC2\x85."), "a b c    .");
  const std::string replaced = "\xEF\xBF\xBD";
  EXPECT_EQ(readable_line("a\xFFz"), "a" + replaced + "z");
  EXPECT_EQ(readable_line("\x80"), replaced);
  EXPECT_EQ(readable_line("\xC3"), replaced) << "cut short";
  EXPECT_EQ(readable_line("\xE2\x82z"), replaced + replaced + "z");
  EXPECT_EQ(readable_line("\xC0\xAF"), replaced + replaced) << "a longer form of '/'";
  EXPECT_EQ(readable_line("\xE0\x80\xAF"), replaced + replaced + replaced);
  EXPECT_EQ(readable_line("\xED\xA0\x80"), replaced + replaced + replaced) << "half of a pair";
  EXPECT_EQ(readable_line("\xF4\x90\x80\x80"), replaced + replaced + replaced + replaced);
}

TEST(Shortened, LeavesOutTheMiddleAndCutsNoCharacter) {
  EXPECT_EQ(shortened("12345678", 8), "12345678");
  EXPECT_EQ(shortened("123456789", 8), "12...89");
  EXPECT_EQ(shortened("\xC3\xA4\xC3\xA4xxxxxxxx\xE2\x82\xAC\xE2\x82\xAC", 8),
            "\xC3\xA4\xC3\xA4...\xE2\x82\xAC\xE2\x82\xAC");
  EXPECT_EQ(shortened("\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4", 8),
            "\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4");
}

TEST(DidYouMean, ProposesTheNearestNameAndNothingFar) {
  const std::vector<std::string_view> names{"--grid", "--random", "--random-turn"};
  EXPECT_EQ(did_you_mean("--gird", names), " (did you mean '--grid'?)");
  EXPECT_EQ(did_you_mean("--rnadom", names), " (did you mean '--random'?)");
  EXPECT_EQ(did_you_mean("--rand", names), " (did you mean '--random'?)") << "its beginning";
  EXPECT_EQ(did_you_mean("--xyzw", names), "");
  EXPECT_EQ(did_you_mean("", names), "");
  EXPECT_EQ(did_you_mean(std::string(100000, 'a'), names), "");
}

TEST(ShellQuoted, LeavesPlainWordsAndQuotesTheRest) {
  EXPECT_EQ(shell_quoted("runs/a-1.png"), "runs/a-1.png");
  EXPECT_EQ(shell_quoted(""), "''");
  EXPECT_EQ(shell_quoted("a b"), "'a b'");
  EXPECT_EQ(shell_quoted("it's $HOME"), "'it'\\''s $HOME'");
}

TEST(LowerCase, ChangesLettersOfAsciiAlone) {
  EXPECT_EQ(lower_case("View_007.JPG @[`{"), "view_007.jpg @[`{");
  EXPECT_EQ(lower_case("\xC3\x84"), "\xC3\x84") << "a letter of UTF-8 is not cut";
}

TEST(ShortNumber, IsAsPeopleWriteIt) {
  EXPECT_EQ(short_number(29.999999999999996), "30");
  EXPECT_EQ(short_number(1.735e-18), "0");
  EXPECT_EQ(short_number(-1e-18), "0");
  EXPECT_EQ(short_number(-0.0), "0");
  EXPECT_EQ(short_number(0.00001), "0.00001");
  EXPECT_EQ(short_number(12345678.0), "12345678");
  EXPECT_EQ(short_number(0.00944, "", 4), "0.00944");
  EXPECT_EQ(short_number(0.0000012, "m", 4), "0") << "a thousandth of a millimetre";
  EXPECT_EQ(short_number(0.0396712, "m", 4), "0.03967");
  EXPECT_EQ(short_number(-0.056, "", 4), "-0.056");
  EXPECT_EQ(short_number(std::nan("")), "none");
}

}  // namespace
}  // namespace panonav::testing
