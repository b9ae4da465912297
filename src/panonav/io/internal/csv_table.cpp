#include "panonav/io/internal/csv_table.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav {

namespace {

constexpr std::size_t table_limit_bytes = 64U << 20U;

// Splits a line; nullopt if a quote is not closed or text follows it.
std::optional<std::vector<std::string>> split_fields(std::string_view line) {
  std::vector<std::string> fields;
  std::size_t i = 0;
  while (true) {
    while (i < line.size() && (line[i] == ' ' || line[i] == '\t')) ++i;
    std::string field;
    if (i < line.size() && line[i] == '"') {
      ++i;
      while (true) {
        if (i >= line.size()) return std::nullopt;
        if (line[i] == '"') {
          if (i + 1 >= line.size() || line[i + 1] != '"') break;
          ++i;
        }
        field += line[i++];
      }
      ++i;
      while (i < line.size() && (line[i] == ' ' || line[i] == '\t')) ++i;
      if (i < line.size() && line[i] != ',') return std::nullopt;
    } else {
      const std::size_t end = std::min(line.find(',', i), line.size());
      field = trim_blanks(line.substr(i, end - i));
      i = end;
    }
    fields.push_back(std::move(field));
    if (i >= line.size()) return fields;
    ++i;
  }
}

}  // namespace

std::string_view trim_blanks(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

CsvTable CsvTable::read(const std::filesystem::path& path) {
  const auto bytes = read_file(path, table_limit_bytes);
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  // Some programs begin tables with a byte order mark.
  if (rest.starts_with("\xEF\xBB\xBF")) rest.remove_prefix(3);
  CsvTable table;
  table.path_ = path;
  std::size_t line_number = 0;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = trim_blanks(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    ++line_number;
    if (line.empty() || line.front() == '#') continue;
    auto fields = split_fields(line);
    const std::string where = "line " + std::to_string(line_number);
    if (!fields)
      throw FileError(path.string(),
                      where + " has quotation marks that do not enclose a whole field");
    if (table.columns_.empty()) {
      table.columns_ = std::move(*fields);
      for (std::size_t i = 0; i < table.columns_.size(); ++i) {
        if (*table.index(table.columns_[i]) != i) {
          throw FileError(path.string(),
                          where + ": the column '" + table.columns_[i] + "' stands twice");
        }
      }
      continue;
    }
    if (fields->size() != table.columns_.size()) {
      throw FileError(path.string(), where + " has " + std::to_string(fields->size()) +
                                         " fields; allowed: " +
                                         std::to_string(table.columns_.size()) + " as the header");
    }
    table.cells_.push_back(std::move(*fields));
    table.lines_.push_back(line_number);
  }
  if (table.columns_.empty()) throw FileError(path.string(), "has no header line");
  return table;
}

std::optional<std::size_t> CsvTable::index(std::string_view column) const noexcept {
  const auto found = std::find(columns_.begin(), columns_.end(), column);
  if (found == columns_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - columns_.begin());
}

const std::string& CsvTable::text(std::size_t row, std::string_view column) const {
  const auto i = index(column);
  if (!i) throw FileError(path_.string(), "has no column '" + std::string(column) + "'");
  return cells_[row][*i];
}

double CsvTable::number(std::size_t row, std::string_view column) const {
  const std::string& field = text(row, column);
  double value = 0.0;
  const std::string_view digits = std::string_view(field).substr(field.starts_with('+') ? 1 : 0);
  if (!read_number(digits, value) || !std::isfinite(value)) {
    fail(row, column, field.empty() ? "empty" : "'" + field + "'", "a finite number");
  }
  return value;
}

double CsvTable::position(std::size_t row, std::string_view column) const {
  const double value = number(row, column);
  if (!is_position(value)) fail(row, column, text(row, column), position_range);
  return value;
}

void CsvTable::fail(std::size_t row, std::string_view column, std::string_view found,
                    std::string_view allowed) const {
  throw FileError(path_.string(), "line " + std::to_string(lines_[row]) + ": " +
                                      std::string(column) + " is " + std::string(found) +
                                      "; allowed: " + std::string(allowed));
}

}  // namespace panonav
