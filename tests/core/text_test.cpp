#include "panonav/core/text.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace panonav::testing {
namespace {

TEST(ToReadableLine, KeepsUtf8AndReplacesTheRest) {
  const std::string fine = "a \"quote\" \xC3\xA4 \xE2\x82\xAC \xF0\x9F\xA4\x96 \xF4\x8F\xBF\xBF";
  EXPECT_EQ(to_readable_line(fine), fine);
  EXPECT_EQ(to_readable_line(""), "");
  EXPECT_EQ(to_readable_line("a\nb\tc\r\x7F" + std::string(1, '\0') + "\xC2\x85."), "a b c    .");
  const std::string replaced = "\xEF\xBF\xBD";
  EXPECT_EQ(to_readable_line("a\xFFz"), "a" + replaced + "z");
  EXPECT_EQ(to_readable_line("\x80"), replaced);
  EXPECT_EQ(to_readable_line("\xC3"), replaced) << "cut short";
  EXPECT_EQ(to_readable_line("\xE2\x82z"), replaced + replaced + "z");
  EXPECT_EQ(to_readable_line("\xC0\xAF"), replaced + replaced) << "a longer form of '/'";
  EXPECT_EQ(to_readable_line("\xE0\x80\xAF"), replaced + replaced + replaced);
  EXPECT_EQ(to_readable_line("\xED\xA0\x80"), replaced + replaced + replaced) << "half of a pair";
  EXPECT_EQ(to_readable_line("\xF4\x90\x80\x80"), replaced + replaced + replaced + replaced);
}

TEST(ShortenMiddle, LeavesOutTheMiddleAndCutsNoCharacter) {
  EXPECT_EQ(shorten_middle("12345678", 8), "12345678");
  EXPECT_EQ(shorten_middle("123456789", 8), "12...89");
  EXPECT_EQ(shorten_middle("\xC3\xA4\xC3\xA4xxxxxxxx\xE2\x82\xAC\xE2\x82\xAC", 8),
            "\xC3\xA4\xC3\xA4...\xE2\x82\xAC\xE2\x82\xAC");
  EXPECT_EQ(shorten_middle("\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4", 8),
            "\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4\xC3\xA4");
}

TEST(SuggestName, ProposesTheNearestNameAndNothingFar) {
  const std::vector<std::string_view> names{"--grid", "--random", "--random-turn"};
  EXPECT_EQ(suggest_name("--gird", names), " (did you mean '--grid'?)");
  EXPECT_EQ(suggest_name("--rnadom", names), " (did you mean '--random'?)");
  EXPECT_EQ(suggest_name("--rand", names), " (did you mean '--random'?)") << "its beginning";
  EXPECT_EQ(suggest_name("--xyzw", names), "");
  EXPECT_EQ(suggest_name("", names), "");
  EXPECT_EQ(suggest_name(std::string(100000, 'a'), names), "");
}

TEST(QuoteForShell, LeavesPlainWordsAndQuotesTheRest) {
  EXPECT_EQ(quote_for_shell("runs/a-1.png"), "runs/a-1.png");
  EXPECT_EQ(quote_for_shell(""), "''");
  EXPECT_EQ(quote_for_shell("a b"), "'a b'");
  EXPECT_EQ(quote_for_shell("it's $HOME"), "'it'\\''s $HOME'");
}

TEST(ToLowerCase, ChangesLettersOfAsciiAlone) {
  EXPECT_EQ(to_lower_case("View_007.JPG @[`{"), "view_007.jpg @[`{");
  EXPECT_EQ(to_lower_case("\xC3\x84"), "\xC3\x84") << "a letter of UTF-8 is not cut";
}

TEST(FormatNumber, IsAsPeopleWriteIt) {
  EXPECT_EQ(format_number(29.999999999999996), "30");
  EXPECT_EQ(format_number(1.735e-18), "0");
  EXPECT_EQ(format_number(-1e-18), "0");
  EXPECT_EQ(format_number(-0.0), "0");
  EXPECT_EQ(format_number(0.00001), "0.00001");
  EXPECT_EQ(format_number(12345678.0), "12345678");
  EXPECT_EQ(format_number(0.00944, "", 4), "0.00944");
  EXPECT_EQ(format_number(0.0000012, "m", 4), "0") << "a thousandth of a millimetre";
  EXPECT_EQ(format_number(0.0396712, "m", 4), "0.03967");
  EXPECT_EQ(format_number(-0.056, "", 4), "-0.056");
  EXPECT_EQ(format_number(std::nan("")), "none");
}

}  // namespace
}  // namespace panonav::testing
