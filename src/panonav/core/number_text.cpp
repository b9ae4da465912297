#include "panonav/core/number_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace panonav {

namespace {

std::string format_with_precision(double value, std::chars_format form, int precision) {
  // The largest double has 309 digits before the point.
  std::string text(static_cast<std::size_t>(std::max(precision, 0)) + 330, '\0');
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value, form, precision);
  text.resize(static_cast<std::size_t>(result.ptr - text.data()));
  return text;
}

}  // namespace

std::string to_hex_text(double value) {
  std::array<char, 40> digits{};
  const auto result = std::to_chars(digits.data(), digits.data() + digits.size(), std::abs(value),
                                    std::chars_format::hex);
  const std::string text(digits.data(), result.ptr);
  return (std::signbit(value) ? "-" : "") + (std::isfinite(value) ? "0x" + text : text);
}

std::string to_fixed_text(double value, int digits) {
  return format_with_precision(value, std::chars_format::fixed, digits);
}

std::string to_general_text(double value, int significant) {
  return format_with_precision(value, std::chars_format::general, significant);
}

std::string to_hex_digits(std::uint64_t value, std::size_t digits) {
  std::array<char, 16> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value, 16);
  const std::string written(text.data(), result.ptr);
  return std::string(digits - std::min(digits, written.size()), '0') + written;
}

bool read_hex_number(std::string_view text, double& value) {
  const bool is_negative = text.starts_with('-');
  if (is_negative) text.remove_prefix(1);
  const bool has_prefix = text.starts_with("0x");
  if (has_prefix) text.remove_prefix(2);
  if (text.starts_with('-')) return false;
  const char* const end = text.data() + text.size();
  const auto form = has_prefix ? std::chars_format::hex : std::chars_format::general;
  double read = 0.0;
  const auto result = std::from_chars(text.data(), end, read, form);
  if (result.ec != std::errc() || result.ptr != end) return false;
  value = is_negative ? -read : read;
  return true;
}

std::vector<std::string> split_words(std::string_view text) {
  constexpr std::string_view blanks = " \t\n\v\f\r";
  std::vector<std::string> words;
  for (std::size_t end = 0;;) {
    const std::size_t begin = text.find_first_not_of(blanks, end);
    if (begin == std::string_view::npos) return words;
    end = std::min(text.find_first_of(blanks, begin), text.size());
    words.emplace_back(text.substr(begin, end - begin));
  }
}

}  // namespace panonav
