#include "panonav/io/toml_fields.hpp"

#include <cmath>
#include <sstream>

#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav {

namespace {

constexpr std::size_t kLargestFile = 1U << 20U;

std::string shown(const toml::node& node) {
  std::ostringstream text;
  node.visit([&text](const auto& value) { text << value; });
  std::string result = text.str();
  for (auto& c : result) c = c == '\n' ? ' ' : c;
  if (result.size() > 60) result = result.substr(0, 57) + "...";
  return result;
}

}  // namespace

toml::table read_toml(const std::filesystem::path& path) {
  const auto bytes = read_file(path, kLargestFile);
  try {
    return toml::parse(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  } catch (const toml::parse_error& error) {
    throw FileError(path.string(), "line " + std::to_string(error.source().begin.line) +
                                       " is not TOML: " + std::string(error.description()));
  }
}

const toml::node* TomlFields::get(std::string_view field) {
  asked_.emplace(field);
  return table_.get(field);
}

std::optional<double> TomlFields::number(std::string_view field) {
  const toml::node* node = get(field);
  if (node == nullptr) return std::nullopt;
  const auto value = node->is_number() ? node->value<double>() : std::nullopt;
  if (!value || !std::isfinite(*value)) fail(field, shown(*node), "a finite number");
  return value;
}

std::optional<std::string> TomlFields::text(std::string_view field) {
  const toml::node* node = get(field);
  if (node == nullptr) return std::nullopt;
  if (!node->is_string()) fail(field, shown(*node), "a text in quotation marks");
  return node->value<std::string>();
}

std::optional<std::vector<double>> TomlFields::numbers(std::string_view field) {
  const toml::node* node = get(field);
  if (node == nullptr) return std::nullopt;
  const toml::array* array = node->as_array();
  if (array == nullptr) fail(field, shown(*node), "a list of numbers");
  std::vector<double> values;
  for (const auto& element : *array) {
    const auto value = element.is_number() ? element.value<double>() : std::nullopt;
    if (!value || !std::isfinite(*value)) fail(field, shown(*node), "a list of finite numbers");
    values.push_back(*value);
  }
  return values;
}

std::optional<TomlFields> TomlFields::section(std::string_view field) {
  const toml::node* node = get(field);
  if (node == nullptr) return std::nullopt;
  const toml::table* table = node->as_table();
  if (table == nullptr) fail(field, shown(*node), "a section in square brackets");
  return TomlFields(
      path_, section_.empty() ? std::string(field) : section_ + "." + std::string(field), *table);
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
  fail(field, "\"" + *value + "\"", allowed);
}

void TomlFields::fail(std::string_view field, std::string_view found,
                      std::string_view allowed) const {
  const std::string where = section_.empty() ? std::string() : "[" + section_ + "] ";
  throw FileError(path_.string(), where + std::string(field) + " is " + std::string(found) +
                                      "; allowed: " + std::string(allowed));
}

void TomlFields::finish() const {
  for (const auto& [key, value] : table_) {
    if (asked_.contains(key.str())) continue;
    std::string known;
    for (const auto& name : asked_) known += (known.empty() ? "" : ", ") + name;
    throw FileError(path_.string(), (section_.empty() ? "" : "[" + section_ + "] ") +
                                        std::string(key.str()) +
                                        " is not a known field; known: " + known);
  }
}

}  // namespace panonav
