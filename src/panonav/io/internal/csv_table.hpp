#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace panonav {

/// A small table of text with a header line. Fields are separated by commas, may stand in double
/// quotes, and are trimmed of blanks; empty lines and lines that start with # do not count.
class CsvTable {
 public:
  /// Throws FileError: missing, larger than 64 MB, no header, a row with another number of fields
  /// than the header (with its line), a column name that stands twice.
  [[nodiscard]] static CsvTable read(const std::filesystem::path& path);

  /// Lines that count, the header not among them.
  [[nodiscard]] std::size_t rows() const noexcept { return cells_.size(); }
  /// Names of the columns, in the order of the header.
  [[nodiscard]] const std::vector<std::string>& columns() const noexcept { return columns_; }
  /// True if the header names the column.
  [[nodiscard]] bool has(std::string_view column) const noexcept {
    return index(column).has_value();
  }
  /// Throws FileError when there is no such column.
  [[nodiscard]] const std::string& text(std::size_t row, std::string_view column) const;
  /// Throws FileError that names line, column and value unless it is a finite number.
  [[nodiscard]] double number(std::size_t row, std::string_view column) const;
  /// The same for a coordinate in metres, which `is_position`.
  [[nodiscard]] double position(std::size_t row, std::string_view column) const;
  /// Throws FileError: the field of this row is `found`, and what is allowed instead.
  [[noreturn]] void fail(std::size_t row, std::string_view column, std::string_view found,
                         std::string_view allowed) const;

 private:
  [[nodiscard]] std::optional<std::size_t> index(std::string_view column) const noexcept;
  std::filesystem::path path_;
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> cells_;
  std::vector<std::size_t> lines_;  // line of the file of each row
};

}  // namespace panonav
