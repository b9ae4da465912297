#include "panonav/io/toml_fields.hpp"

// The parser asserts on some broken input that it then refuses properly; a damaged file must not
// end a debug build either.
#define TOML_ASSERT(expression) static_cast<void>(0)
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <type_traits>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav {

namespace {

constexpr std::size_t document_limit_bytes = 1U << 20U;

TomlTable copy_of(const toml::table& table);

TomlValue copy_of(const toml::node& node) {
  TomlValue result;
  std::ostringstream shown;
  node.visit([&](const auto& value) {
    using Value = std::remove_cvref_t<decltype(value)>;
    if constexpr (std::is_same_v<Value, toml::table>) {
      shown << "a section";
      result.content = copy_of(value);
    } else if constexpr (std::is_same_v<Value, toml::array>) {
      std::vector<TomlValue> list;
      for (const auto& element : value) {
        list.push_back(copy_of(element));
        shown << (list.size() > 1 ? ", " : "[") << list.back().shown;
      }
      shown << (list.empty() ? "[]" : "]");
      result.content = std::move(list);
    } else if constexpr (toml::is_string<Value> || toml::is_integer<Value> ||
                         toml::is_floating_point<Value> || toml::is_boolean<Value>) {
      shown << value;
      result.content = value.get();
    } else {
      shown << value;
    }
  });
  result.shown = shortened(readable_line(shown.str()), 60);
  return result;
}

TomlTable copy_of(const toml::table& table) {
  TomlTable result;
  for (const auto& [key, node] : table) {
    result.push_back({std::string(key.str()), copy_of(node)});
  }
  return result;
}

// Appends what stands between quotation marks as text that is ASCII alone; `quoted`: with escapes.
void append_escaped(std::string& result, std::string_view content, bool quoted) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  while (!content.empty()) {
    const auto first = static_cast<unsigned char>(content.front());
    const std::size_t size = first < 0x80U ? 1 : first < 0xE0U ? 2 : first < 0xF0U ? 3 : 4;
    if (size == 1) {
      if (!quoted && (first == '"' || first == '\\')) result += '\\';
      result += content.front();
    } else {
      std::uint32_t number = first & (0x7FU >> size);
      for (std::size_t i = 1; i < size; ++i) {
        number = number << 6U | (static_cast<unsigned char>(content[i]) & 0x3FU);
      }
      result += "\\U";
      for (int shift = 28; shift >= 0; shift -= 4) result += digits[(number >> shift) & 15U];
    }
    content.remove_prefix(size);
  }
}

// The same TOML in ASCII alone. The parser follows names that are joined by dots by recursion
// without a bound, and characters beyond ASCII lead it to a statement that it calls unreachable,
// wherever it looks for blanks: around names and values, within texts of several lines, and where
// a number is followed by what looks like a text. Throws FileError where the text has too many
// dots, such characters outside of quotation marks, or quotation marks that it may take for others.
std::string plain_text(std::string_view text, const std::filesystem::path& path) {
  constexpr int max_parts = 64;
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  std::string result;
  for (int number = 1; !text.empty(); ++number) {
    const std::size_t text_size = text.size();
    const std::size_t end = std::min(text.find('\n'), text_size);
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const auto refuse = [&](const std::string& what) {
      throw FileError(path.string(), "line " + std::to_string(number) + " has " + what);
    };
    int dots = 0;
    std::size_t i = 0;
    for (; i < line.size() && line[i] != '#'; ++i) {
      const char c = line[i];
      constexpr std::string_view borders = "=,[]{}";
      if (static_cast<unsigned char>(c) >= 0x80U) {
        refuse("a character beyond ASCII outside of quotation marks; allowed: within them");
      }
      if (borders.find(c) != std::string_view::npos) dots = 0;
      if (c == '.' && ++dots >= max_parts) {
        refuse("a name of too many parts; allowed: up to " + std::to_string(max_parts));
      }
      if (c != '"' && c != '\'') {
        result += c;
        continue;
      }
      if (line.substr(i).starts_with(std::string(3, c))) {
        refuse("a text in three quotation marks; allowed: one, around a text on one line");
      }
      constexpr std::string_view before = " \t=,[{.";
      if (i > 0 && before.find(line[i - 1]) == std::string_view::npos) {
        refuse("a quotation mark within a name or a value; allowed: around them");
      }
      const std::size_t begin = i + 1;
      for (++i; i < line.size() && line[i] != c; ++i) {
        if (c == '"' && line[i] == '\\') ++i;
      }
      if (i >= line.size()) refuse("a quotation mark that is not closed");
      const std::string_view content = line.substr(begin, i - begin);
      const bool is_ascii = std::ranges::all_of(
          content, [](char one) { return static_cast<unsigned char>(one) < 0x80U; });
      if (!is_ascii && readable_line(content) != content) {
        refuse("a control character or bytes that are not UTF-8 in a text");
      }
      const char mark = is_ascii ? c : '"';
      result += mark;
      if (is_ascii) {
        result += content;
      } else {
        append_escaped(result, content, c == '"');
      }
      result += mark;
    }
    for (; i < line.size(); ++i) {  // a comment
      result += static_cast<unsigned char>(line[i]) < 0x80U ? line[i] : '?';
    }
    if (end < text_size) result += '\n';
  }
  return result;
}

std::optional<double> as_number(const TomlValue& value) {
  if (const auto* real = std::get_if<double>(&value.content)) return *real;
  if (const auto* whole = std::get_if<std::int64_t>(&value.content)) {
    return static_cast<double>(*whole);
  }
  return std::nullopt;
}

}  // namespace

TomlTable read_toml(const std::filesystem::path& path) {
  const auto bytes = read_file(path, document_limit_bytes);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string plain = plain_text(text, path);
  try {
    return copy_of(toml::parse(std::string_view(plain)));
  } catch (const toml::parse_error& error) {
    throw FileError(path.string(), "line " + std::to_string(error.source().begin.line) +
                                       " is not TOML: " + readable_line(error.description()));
  }
}

std::string toml_text(std::string_view text) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string result = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (byte < ' ' || byte == 0x7F) {
      result += "\\u00";
      result += digits[byte >> 4U];
      result += digits[byte & 15U];
    } else {
      result += c;
    }
  }
  return result + "\"";
}

TomlFields::TomlFields(std::filesystem::path path, std::string section, const TomlTable& table)
    : path_(std::move(path)), section_(std::move(section)), table_(&table) {}

const TomlValue* TomlFields::get(std::string_view field) {
  asked_.emplace(field);
  const auto found = std::ranges::find(*table_, field, &TomlField::name);
  return found == table_->end() ? nullptr : &found->value;
}

std::optional<double> TomlFields::number(std::string_view field) {
  const TomlValue* value = get(field);
  if (value == nullptr) return std::nullopt;
  const auto number = as_number(*value);
  if (!number || !std::isfinite(*number)) fail(field, value->shown, "a finite number");
  return number;
}

std::optional<std::int64_t> TomlFields::integer(std::string_view field) {
  const TomlValue* value = get(field);
  if (value == nullptr) return std::nullopt;
  const auto* integer = std::get_if<std::int64_t>(&value->content);
  if (integer == nullptr) fail(field, value->shown, "a whole number");
  return *integer;
}

std::optional<bool> TomlFields::boolean(std::string_view field) {
  const TomlValue* value = get(field);
  if (value == nullptr) return std::nullopt;
  const auto* boolean = std::get_if<bool>(&value->content);
  if (boolean == nullptr) fail(field, value->shown, "true, false");
  return *boolean;
}

std::optional<std::string> TomlFields::text(std::string_view field) {
  const TomlValue* value = get(field);
  if (value == nullptr) return std::nullopt;
  const auto* text = std::get_if<std::string>(&value->content);
  if (text == nullptr) fail(field, value->shown, "a text in quotation marks");
  return *text;
}

std::optional<std::vector<double>> TomlFields::numbers(std::string_view field) {
  const TomlValue* value = get(field);
  if (value == nullptr) return std::nullopt;
  const auto* list = std::get_if<std::vector<TomlValue>>(&value->content);
  if (list == nullptr) fail(field, value->shown, "a list of numbers");
  std::vector<double> numbers;
  for (const TomlValue& element : *list) {
    const auto number = as_number(element);
    if (!number || !std::isfinite(*number)) fail(field, value->shown, "a list of finite numbers");
    numbers.push_back(*number);
  }
  return numbers;
}

std::optional<TomlFields> TomlFields::section(std::string_view field) {
  const TomlValue* value = get(field);
  if (value == nullptr) return std::nullopt;
  const auto* table = std::get_if<TomlTable>(&value->content);
  if (table == nullptr) fail(field, value->shown, "a section in square brackets");
  std::string name = section_.empty() ? "" : section_ + ".";
  name += field;
  return TomlFields(path_, std::move(name), *table);
}

double TomlFields::required_number(std::string_view field) {
  const auto value = number(field);
  if (!value) fail(field, "missing", "a number");
  return *value;
}

std::string TomlFields::required_text(std::string_view field, std::string_view allowed) {
  auto value = text(field);
  if (!value) fail(field, "missing", allowed);
  return *std::move(value);
}

std::optional<std::size_t> TomlFields::choice(std::string_view field,
                                              std::span<const std::string_view> choices) {
  const auto value = text(field);
  if (!value) return std::nullopt;
  std::string allowed;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (*value == choices[i]) return i;
    allowed += (i > 0 ? ", \"" : "\"") + std::string(choices[i]) + "\"";
  }
  fail(field, readable_line("\"" + *value + "\""), allowed);
}

void TomlFields::fail(std::string_view field, std::string_view found,
                      std::string_view allowed) const {
  const std::string where = section_.empty() ? std::string() : "[" + section_ + "] ";
  throw FileError(path_.string(), where + readable_line(field) + " is " + readable_line(found) +
                                      "; allowed: " + std::string(allowed));
}

void TomlFields::finish() const {
  for (const TomlField& field : *table_) {
    if (asked_.contains(field.name)) continue;
    std::string known;
    for (const auto& name : asked_) known += (known.empty() ? "" : ", ") + name;
    const std::vector<std::string_view> names(asked_.begin(), asked_.end());
    throw FileError(path_.string(), (section_.empty() ? "" : "[" + section_ + "] ") +
                                        readable_line(field.name) + " is not a known field" +
                                        did_you_mean(field.name, names) + "; known: " + known);
  }
}

}  // namespace panonav
