#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "lab/reporting/table.hpp"
#include "panonav/core/error.hpp"

namespace panonav::lab {

namespace {

using nlohmann::json;

// Returns a JSON value as text for error messages, at most 40 characters.
std::string shorten_value(const json& value) {
  if (value.is_structured()) return "an " + std::string(value.type_name());
  constexpr std::size_t max_length = 40;
  const std::string text = value.dump();
  return text.size() <= max_length ? text : text.substr(0, max_length) + "...";
}

// Reads the fields of one row; errors name the row and the field.
class RowReader {
 public:
  RowReader(const json& row, std::size_t number, std::string_view file)
      : row_(row), name_("row " + std::to_string(number)), file_(file) {
    if (!row.is_object())
      throw FileError(file_, name_ + " is " + shorten_value(row) + "; allowed: an object");
  }

  [[noreturn]] void fail(const std::string& field, const std::string& allowed) const {
    const std::string found =
        row_.contains(field) ? "is " + shorten_value(row_[field]) : "is missing";
    throw FileError(file_, name_ + ": " + field + " " + found + "; allowed: " + allowed);
  }

  [[nodiscard]] std::string text(const std::string& field) const {
    if (!row_.contains(field) || !row_[field].is_string()) fail(field, "a text");
    return row_[field].get<std::string>();
  }

  [[nodiscard]] const json& member(const std::string& field) const {
    if (!row_.contains(field)) fail(field, "any value of its kind, or null");
    return row_[field];
  }

  // Returns NaN for null, which `to_json` writes for values that are not finite.
  [[nodiscard]] double number_or_null(const std::string& field, const json& value) const {
    if (value.is_null()) return std::numeric_limits<double>::quiet_NaN();
    if (!value.is_number())
      fail(field, field == "ours" ? "a number or null" : "two numbers or null");
    return value.get<double>();
  }

  [[nodiscard]] std::optional<std::pair<double, double>> range(const std::string& field) const {
    const json& value = member(field);
    if (value.is_null()) return std::nullopt;
    if (value.is_number()) return std::pair{value.get<double>(), value.get<double>()};
    if (!value.is_array() || value.size() != 2) fail(field, "a number, two of them, or null");
    return std::pair{number_or_null(field, value[0]), number_or_null(field, value[1])};
  }

  [[nodiscard]] std::optional<Target> target() const {
    const json& value = member("target");
    if (value.is_null()) return std::nullopt;
    if (!value.is_object() || !value.contains("op") || !value.contains("value") ||
        !value["value"].is_number() || (value["op"] != "<=" && value["op"] != ">=")) {
      fail("target", R"({"op": "<=" or ">=", "value": a number} or null)");
    }
    return Target{value["op"] == "<=" ? Comparison::at_most : Comparison::at_least,
                  value["value"].get<double>()};
  }

 private:
  const json& row_;
  std::string name_;
  std::string_view file_;
};

}  // namespace

std::vector<ResultRow> rows_from_json(std::string_view text, std::string_view file) {
  const json list = json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (list.is_discarded()) throw FileError(file, "is no JSON, or not all of it");
  if (!list.is_array()) throw FileError(file, "is no list of rows");
  std::vector<ResultRow> rows;
  for (const json& entry : list) {
    const RowReader reader(entry, rows.size() + 1, file);
    ResultRow row{.id = reader.text("id"),
                  .what = reader.text("what"),
                  .published = reader.range("published"),
                  .ours = reader.number_or_null("ours", reader.member("ours")),
                  .interval = reader.range("interval"),
                  .unit = reader.text("unit"),
                  .target = reader.target()};
    if (entry.contains("over")) row.over = reader.text("over");
    if (entry.contains("reason") && !entry["reason"].is_null()) row.reason = reader.text("reason");
    if (reader.member("holds") != row.holds()) {
      reader.fail("holds",
                  std::string(row.holds() ? "true" : "false") + ", as `ours` and `target` have it");
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace panonav::lab
