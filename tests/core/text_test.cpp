#include "panonav/core/text.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "support/comma_locale.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

TEST(ToReadableLine, KeepsUtf8AndReplacesTheRest) {
  const std::string fine = "a \"quote\" \xC3\xA4 \xE2\x82\xAC \xF0\x9F\xA4\x96 \xF4\x8F\xBF\xBF";
  EXPECT_EQ(to_readable_line(fine), fine);
  EXPECT_EQ(to_readable_line(""), "");
  EXPECT_EQ(to_readable_line("a\nb\tc\r\x7F" + std::string(1, '\0') + "\xC2\x85."), "a b c    .");
  EXPECT_EQ(to_readable_line("a\xFFz"), "a%FFz");
  EXPECT_EQ(to_readable_line("\x80"), "%80");
  EXPECT_EQ(to_readable_line("\xC3"), "%C3") << "cut short";
  EXPECT_EQ(to_readable_line("\xE2\x82z"), "%E2%82z");
  EXPECT_EQ(to_readable_line("\xC0\xAF"), "%C0%AF") << "a longer form of '/'";
  EXPECT_EQ(to_readable_line("\xE0\x80\xAF"), "%E0%80%AF");
  EXPECT_EQ(to_readable_line("\xED\xA0\x80"), "%ED%A0%80") << "half of a pair";
  EXPECT_EQ(to_readable_line("\xF4\x90\x80\x80"), "%F4%90%80%80");
}

TEST(EscapeName, IsReversibleAndKeepsNamesApart) {
  EXPECT_EQ(escape_name("K\xFC"
                        "che.png"),
            "K%FCche.png");
  EXPECT_EQ(escape_name("K%FCche.png"), "K%25FCche.png") << "a file of that name";
  for (const char* same : {"",
                           "K\xC3\xBC"
                           "che.png",
                           "50%.png", "a%20b", "%fc", "%7F", "%2", "%"}) {
    EXPECT_EQ(escape_name(same), same);
  }
  // All names of up to five pieces that could be confused.
  const std::vector<std::string> pieces{"%", "25", "FC", "F", "C", "\xFC", "\xC3", "\xBC", "a"};
  std::set<std::string> escaped;
  std::vector<std::string> names{""};
  for (std::size_t i = 0, end = 0; i < 5; ++i) {
    const std::size_t begin = end;
    end = names.size();
    for (std::size_t j = begin; j < end; ++j) {
      for (const std::string& piece : pieces) names.push_back(names[j] + piece);
    }
  }
  for (const std::string& name : std::set<std::string>(names.begin(), names.end())) {
    const std::string shown = escape_name(name);
    ASSERT_TRUE(is_utf8(shown));
    ASSERT_EQ(unescape_name(shown), name);
    ASSERT_TRUE(escaped.insert(shown).second) << shown;
  }
}

TEST(DecodePercent, ReadsEscapesAndRefusesOthers) {
  EXPECT_EQ(decode_percent("a%20b%2Fc%e4"), "a b/c\xE4");
  EXPECT_EQ(decode_percent(""), "");
  for (const char* text : {"%", "%4", "%4g", "%-1", "%+1", "% 1", "a%00b", "%0x41"}) {
    EXPECT_EQ(decode_percent(text), std::nullopt) << text;
  }
  EXPECT_TRUE(is_utf8(decode_percent("%C3%A4").value()));
  EXPECT_FALSE(is_utf8(decode_percent("%C3").value()));
}

TEST(ToReadableLine, NoNameTurnsTheDirectionOfWriting) {
  EXPECT_EQ(to_readable_line("a\u202Egnp.exe"), "a gnp.exe");
  for (const std::string mark :
       {"\u061C", "\u200E", "\u200F", "\u2028", "\u2029", "\u202A", "\u202B", "\u202C", "\u202D",
        "\u2066", "\u2067", "\u2068", "\u2069"}) {
    EXPECT_EQ(to_readable_line("a" + mark + "b"), "a b");
  }
  const std::string kept = "\u05D0 \u0627 \u200D \u2010 \u2030 \u2065 \u206A \u00A0";
  EXPECT_EQ(to_readable_line(kept), kept);
}

TEST(ToSheetField, IsNoFormula) {
  EXPECT_EQ(to_sheet_field("=1+1"), "'=1+1");
  EXPECT_EQ(to_sheet_field("@x,y"), "\"'@x,y\"");
  for (const std::string begin : {"+", "-", "@", "=", "\t=", "\r=", " =", "\uFF1D", "\uFF20"}) {
    EXPECT_TRUE(contains(to_sheet_field(begin + "cmd"), "'" + begin)) << begin;
  }
  EXPECT_EQ(to_sheet_field("view_1=2.png"), "view_1=2.png");
  EXPECT_EQ(to_sheet_field(""), "\"\"");
}

TEST(NumberText, IsThatOfTheCLocale) {
  const CommaLocale locale;  // streams at least
  EXPECT_EQ(to_hex_text(1.5), "0x1.8p+0");
  EXPECT_EQ(to_hex_text(-0.1), "-0x1.999999999999ap-4");
  EXPECT_EQ(to_hex_text(0.0), "0x0p+0");
  EXPECT_EQ(to_fixed_text(-1234567.125, 2), "-1234567.12");
  EXPECT_EQ(to_general_text(1234567.0, 4), "1.235e+06");
  EXPECT_EQ(format_fixed(1234.5, 1), "1234.5");
  EXPECT_EQ(format_number(1e15), "1e+15");
  EXPECT_EQ(to_hex_digits(0xABCDEF, 8), "00abcdef");
  EXPECT_EQ(to_hex_digits(~0ULL), "ffffffffffffffff");
  for (const double value : {0.1, -1e300, 5e-324, 2.2250738585072014e-308, 1.0 / 3.0}) {
    double read = 0.0;
    EXPECT_TRUE(read_hex_number(to_hex_text(value), read));
    EXPECT_EQ(read, value);
    EXPECT_TRUE(read_number(to_text(value), read));
    EXPECT_EQ(read, value);
  }
  double kept = 7.0;
  for (const char* wrong : {"", "-", "0x", "--1", "-0x-1", "0x1,8p+0", "1,5", "0x1p+0 "}) {
    EXPECT_FALSE(read_hex_number(wrong, kept)) << wrong;
  }
  int whole = 7;
  for (const char* wrong : {"", "1.5", "1e308", "99999999999", " 1"}) {
    EXPECT_FALSE(read_number(wrong, whole)) << wrong;
  }
  EXPECT_EQ(kept, 7.0);
  EXPECT_EQ(whole, 7);
  EXPECT_EQ(split_words(" a\tb\n\nc "), (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_TRUE(split_words(" \n").empty());
}

TEST(FormatCount, HasTheNounInItsNumber) {
  EXPECT_EQ(format_count(0U, "image"), "0 images");
  EXPECT_EQ(format_count(1U, "image"), "1 image");
  EXPECT_EQ(format_count(-2, "view step"), "-2 view steps");
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
