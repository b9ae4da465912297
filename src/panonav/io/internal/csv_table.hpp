#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace panonav {

/// Removes blanks, tabs and carriage returns at both ends.
[[nodiscard]] std::string_view trim_blanks(std::string_view text);

/// A small table of text with a header line. Fields are separated by commas, may be in double
/// quotes, and are trimmed of blanks; empty lines and lines that begin with # are ignored.
class CsvTable {
 public:
  /// Reads a table. Throws FileError if the file is missing or larger than 64 MB, has no header, a
  /// row whose number of fields differs from the header, or two columns of one name.
  [[nodiscard]] static CsvTable read(const std::filesystem::path& path);

  /// Returns the number of rows without the header.
  [[nodiscard]] std::size_t rows() const noexcept { return cells_.size(); }
  /// Returns the names of the columns, in the order of the header.
  [[nodiscard]] const std::vector<std::string>& columns() const noexcept { return columns_; }
  /// True if the header names the column.
  [[nodiscard]] bool has(std::string_view column) const noexcept {
    return index(column).has_value();
  }
  /// Returns the text of a field. Throws FileError if there is no such column.
  [[nodiscard]] const std::string& text(std::size_t row, std::string_view column) const;
  /// Returns the number in a field. Throws FileError that names line, column and value unless it is
  /// finite.
  [[nodiscard]] double number(std::size_t row, std::string_view column) const;
  /// Returns a coordinate in metres, and throws as `number`, also if it is no `is_position`.
  [[nodiscard]] double position(std::size_t row, std::string_view column) const;
  /// Throws FileError: the field of this row is `found`; it also names what is `allowed`.
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
