#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace panonav {

// Numbers as texts that do not depend on the locale of the program: a library within a program
// with decimal commas writes and reads the same bytes. printf, strtod, scanf and streams do not.

/// Writes a number as "%a" of printf does with a decimal point, with all its bits: "0x1.8p+1".
[[nodiscard]] std::string to_hex_text(double value);
/// Writes a number as "%.<digits>f" does.
[[nodiscard]] std::string to_fixed_text(double value, int digits);
/// Writes a number as "%.<significant>g" does.
[[nodiscard]] std::string to_general_text(double value, int significant);
/// Writes a number in hexadecimal digits, padded with zeros to `digits`.
[[nodiscard]] std::string to_hex_digits(std::uint64_t value, std::size_t digits = 1);

/// Reads the output of `to_hex_text`, to the bit. False, and `value` unchanged, unless the whole
/// text is one such number.
[[nodiscard]] bool read_hex_number(std::string_view text, double& value);

/// Reads a number in decimal digits, or a whole number of another `base`, 2 .. 36. False, and
/// `value` as before, unless the whole text is one number that the type can hold.
template <class Number, class... Base>
[[nodiscard]] bool read_number(std::string_view text, Number& value, Base... base) {
  const char* const end = text.data() + text.size();
  Number read{};
  const auto result = std::from_chars(text.data(), end, read, base...);
  if (result.ec != std::errc() || result.ptr != end) return false;
  value = read;
  return true;
}

/// Reads the decimal number with which the text begins; false where it begins with none.
template <class Number>
[[nodiscard]] bool read_leading_number(std::string_view text, Number& value) {
  return std::from_chars(text.data(), text.data() + text.size(), value).ec == std::errc();
}

/// Splits a text at blanks, tabs and line ends, which are not part of the words.
[[nodiscard]] std::vector<std::string> split_words(std::string_view text);

}  // namespace panonav
