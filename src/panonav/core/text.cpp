#include "panonav/core/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "panonav/core/number_text.hpp"

namespace panonav {

namespace {

bool is_continuation_byte(char c) {
  return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;
}

// Returns the number of bytes of the UTF-8 character at the beginning of the text; 0 if it is
// invalid.
std::size_t utf8_character_size(std::string_view text) {
  const auto first = static_cast<unsigned char>(text.front());
  if (first < 0x80U) return 1;
  struct Form {
    unsigned char low, high;  // of the first byte
    std::size_t size;
    char32_t smallest;  // longer forms of smaller numbers are not UTF-8
  };
  constexpr std::array<Form, 3> forms{
      Form{0xC2, 0xDF, 2, 0x80}, {0xE0, 0xEF, 3, 0x800}, {0xF0, 0xF4, 4, 0x10000}};
  for (const Form& form : forms) {
    if (first < form.low || first > form.high || text.size() < form.size) continue;
    char32_t number = first & (0x7FU >> form.size);
    for (std::size_t i = 1; i < form.size; ++i) {
      if (!is_continuation_byte(text[i])) return 0;
      number = number << 6U | (static_cast<unsigned char>(text[i]) & 0x3FU);
    }
    const bool surrogate = number >= 0xD800 && number <= 0xDFFF;
    return number < form.smallest || number > 0x10FFFF || surrogate ? 0 : form.size;
  }
  return 0;
}

// True for control characters beyond ASCII: C1; marks, embeddings, overrides and isolates of the
// writing direction (Unicode TR9); line and paragraph separators.
bool is_invisible_control(std::string_view character) {
  const auto is_within = [character](std::string_view first, std::string_view last) {
    return character.size() == first.size() && character >= first && character <= last;
  };
  return is_within("\xC2\x80", "\xC2\x9F") || character == "\xD8\x9C" ||
         is_within("\xE2\x80\x8E", "\xE2\x80\x8F") || is_within("\xE2\x80\xA8", "\xE2\x80\xAE") ||
         is_within("\xE2\x81\xA6", "\xE2\x81\xA9");
}

// Returns the smallest number of insertions, deletions, replacements and swaps of neighbours that
// turn one text into the other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> cost(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        cost[i][j] = i + j;
        continue;
      }
      cost[i][j] = std::min({cost[i - 1][j] + 1, cost[i][j - 1] + 1,
                             cost[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        cost[i][j] = std::min(cost[i][j], cost[i - 2][j - 2] + 1);
      }
    }
  }
  return cost.back().back();
}

std::string escape_byte(unsigned char byte) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  return {'%', digits[byte >> 4U], digits[byte & 0xFU]};
}

// Returns the byte for which an escape at the beginning of the text stands: one that is not ASCII,
// or "%". nullopt if there is no escape.
std::optional<char> find_escaped_byte(std::string_view text) {
  std::uint8_t value = 0;
  const std::string_view digits = text.substr(std::min<std::size_t>(1, text.size()), 2);
  if (digits.size() != 2 || text.front() != '%' || !read_number(digits, value, 16)) return {};
  if (escape_byte(value).substr(1) != digits) return {};  // lower case
  return value >= 0x80U || value == '%' ? std::optional(static_cast<char>(value)) : std::nullopt;
}

}  // namespace

std::string format_fixed(double value, int digits) {
  std::string shown = to_fixed_text(value, digits);
  // A value that rounds to zero has no sign.
  const bool is_zero = shown.find_first_not_of("-0.") == std::string::npos;
  return is_zero && shown.front() == '-' ? shown.substr(1) : shown;
}

std::string format_number(double value, std::string_view unit, int significant) {
  if (!std::isfinite(value)) return "none";
  if (std::abs(value) >= 1e15) return to_general_text(value, 6);
  constexpr std::array<std::pair<std::string_view, int>, 9> decimal_places{{{"m", 5},
                                                                            {"cm", 3},
                                                                            {"mm", 2},
                                                                            {"deg", 3},
                                                                            {"degrees", 3},
                                                                            {"px", 3},
                                                                            {"%", 2},
                                                                            {"ms", 5},
                                                                            {"us", 4}}};
  int places = 9;
  for (const auto& [name, count] : decimal_places) {
    if (unit == name) places = count;
  }
  if (value != 0.0) {
    const double magnitude = std::floor(std::log10(std::abs(value)));
    places = std::clamp(significant - 1 - static_cast<int>(magnitude), 0, places);
  }
  std::string text = format_fixed(value, places);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text;
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t size = utf8_character_size(text);
    if (size == 0) return false;
    text.remove_prefix(size);
  }
  return true;
}

std::optional<std::string> decode_percent(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    std::uint8_t value = 0;
    const std::string_view digits = text.substr(i + 1, 2);
    if (digits.size() != 2 || !read_number(digits, value, 16) || value == 0) return std::nullopt;
    decoded += static_cast<char>(value);
    i += 2;
  }
  return decoded;
}

std::string to_lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::string to_readable_line(std::string_view text) {
  std::string line;
  line.reserve(text.size());
  while (!text.empty()) {
    const std::size_t size = utf8_character_size(text);
    const std::string_view character = text.substr(0, size);
    const auto bad_byte = static_cast<unsigned char>(text.front());
    text.remove_prefix(std::max<std::size_t>(size, 1));
    const auto first = static_cast<unsigned char>(size == 0 ? '?' : character.front());
    if (size == 0) {
      line += escape_byte(bad_byte);
    } else if (first < 0x20U || first == 0x7FU || is_invisible_control(character)) {
      line += ' ';
    } else {
      line += character;
    }
  }
  return line;
}

std::string escape_name(std::string_view name) {
  std::string escaped;
  while (!name.empty()) {
    const std::size_t size = utf8_character_size(name);
    if (size == 0) {
      escaped += escape_byte(static_cast<unsigned char>(name.front()));
    } else if (find_escaped_byte(name)) {
      escaped += escape_byte('%');
    } else {
      escaped += name.substr(0, size);
    }
    name.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return escaped;
}

std::string unescape_name(std::string_view escaped) {
  std::string name;
  while (!escaped.empty()) {
    const auto byte = find_escaped_byte(escaped);
    name += byte.value_or(escaped.front());
    escaped.remove_prefix(byte ? 3 : 1);
  }
  return name;
}

bool is_naturally_less(std::string_view a, std::string_view b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      std::size_t i_end = i;
      std::size_t j_end = j;
      while (i_end < a.size() && digit(a[i_end])) ++i_end;
      while (j_end < b.size() && digit(b[j_end])) ++j_end;
      std::size_t i_first = i;
      std::size_t j_first = j;
      while (i_first + 1 < i_end && a[i_first] == '0') ++i_first;
      while (j_first + 1 < j_end && b[j_first] == '0') ++j_first;
      if (i_end - i_first != j_end - j_first) return i_end - i_first < j_end - j_first;
      const int order = a.compare(i_first, i_end - i_first, b, j_first, j_end - j_first);
      if (order != 0) return order < 0;
      i = i_end;
      j = j_end;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  if (i == a.size() && j == b.size()) return a < b;  // equal but for leading zeros
  return i == a.size();
}

std::string to_csv_field(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  const bool needs_quotes = text.empty() ||
                            text.find_first_of(",\"#\r\n") != std::string_view::npos ||
                            is_blank(text.front()) || is_blank(text.back());
  if (!needs_quotes) return std::string(text);
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"') result += '"';
    result += c;
  }
  return result + "\"";
}

std::string to_sheet_field(std::string_view text) {
  // Spreadsheets also accept the full-width forms of =, +, - and @, which are the last four.
  constexpr std::array<std::string_view, 10> begins{
      "=",           "+", "-", "@", "\t", "\r", "\xEF\xBC\x9D", "\xEF\xBC\x8B", "\xEF\xBC\x8D",
      "\xEF\xBC\xA0"};
  std::string_view shown = text;
  while (shown.starts_with(' ')) shown.remove_prefix(1);
  const bool is_formula =
      std::ranges::any_of(begins, [&](std::string_view begin) { return shown.starts_with(begin); });
  return to_csv_field(is_formula ? "'" + std::string(text) : std::string(text));
}

std::string shorten_middle(std::string_view text, std::size_t max_characters) {
  const auto characters = static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return !is_continuation_byte(c); }));
  if (characters <= max_characters) return std::string(text);
  // Keeps both ends, because the end, such as the file name of a path, is the most informative
  // part.
  const std::size_t kept = (max_characters - 3) / 2;
  std::size_t begin = 0;
  for (std::size_t left = kept; left > 0; --left) {
    do ++begin;
    while (is_continuation_byte(text[begin]));
  }
  std::size_t end = text.size();
  for (std::size_t left = kept; left > 0; --left) {
    do --end;
    while (is_continuation_byte(text[end]));
  }
  return std::string(text.substr(0, begin)) + "..." + std::string(text.substr(end));
}

std::string suggest_name(std::string_view typed, std::span<const std::string_view> names) {
  constexpr std::size_t max_bytes = 64;  // the work grows with the square
  if (typed.size() > max_bytes) return {};
  std::size_t best = std::max<std::size_t>(1, typed.size() / 3) + 1;
  std::string_view nearest;
  for (const auto name : names) {
    // Four or more first characters of a name match it with distance 1.
    const bool begins = typed.size() >= 4 && name.starts_with(typed);
    const std::size_t distance = begins ? 1 : edit_distance(typed, name);
    if (distance >= best) continue;
    best = distance;
    nearest = name;
  }
  return nearest.empty() ? "" : " (did you mean '" + std::string(nearest) + "'?)";
}

std::string quote_for_shell(std::string_view text) {
  const auto is_plain = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
           std::string_view("_./:=,+@%-").find(c) != std::string_view::npos;
  };
  if (!text.empty() && std::ranges::all_of(text, is_plain)) return std::string(text);
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace panonav
