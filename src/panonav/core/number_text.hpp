#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace panonav {

// Conversion between numbers and text independent of the program's locale: decimal commas never
// appear, unlike with printf, strtod, scanf and streams.

/// Formats a number without loss as printf's "%a" with a decimal point: "0x1.8p+1".
[[nodiscard]] std::string to_hex_text(double value);
/// Formats a number as printf's "%.<digits>f".
[[nodiscard]] std::string to_fixed_text(double value, int digits);
/// Formats a number as printf's "%.<significant>g".
[[nodiscard]] std::string to_general_text(double value, int significant);
/// Writes a number in hexadecimal digits, padded with zeros to `digits`.
[[nodiscard]] std::string to_hex_digits(std::uint64_t value, std::size_t digits = 1);

/// Parses the output of `to_hex_text` without loss, or a decimal number. False, with `value`
/// unchanged, unless the whole text is one number.
[[nodiscard]] bool read_hex_number(std::string_view text, double& value);

/// Parses a decimal number, or an integer in another `base` (2 .. 36). False, with `value`
/// unchanged, unless the whole text is one number that the type can represent.
template <class Number, class... Base>
[[nodiscard]] bool read_number(std::string_view text, Number& value, Base... base) {
  const char* const end = text.data() + text.size();
  Number read{};
  const auto result = std::from_chars(text.data(), end, read, base...);
  if (result.ec != std::errc() || result.ptr != end) return false;
  value = read;
  return true;
}

/// Parses the decimal number at the beginning of the text; false if there is none.
template <class Number>
[[nodiscard]] bool read_leading_number(std::string_view text, Number& value) {
  return std::from_chars(text.data(), text.data() + text.size(), value).ec == std::errc();
}

/// Formats a number with its noun: "1 image", "0 images". The plural of `noun` must be regular.
template <class Integer>
[[nodiscard]] std::string format_count(Integer count, std::string_view noun) {
  return std::to_string(count).append(" ").append(noun).append(count == 1 ? "" : "s");
}

/// Splits a text at blanks, tabs and line ends, which are not part of the words.
[[nodiscard]] std::vector<std::string> split_words(std::string_view text);

}  // namespace panonav
