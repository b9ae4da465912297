#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace panonav {

struct TomlField;
/// The fields of a TOML table in the order of the file.
using TomlTable = std::vector<TomlField>;

/// The value of a field.
struct TomlValue {
  /// monostate stands for dates and times, which we do not use.
  std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<TomlValue>,
               TomlTable>
      content;
  std::string shown;  ///< for error messages: one short line
};

/// A field of a table.
struct TomlField {
  std::string name;  ///< without its table's name
  TomlValue value;   ///< a number, a text, a list, a table and so on
};

/// Parses a file. Throws FileError with the line if it is missing, larger than 1 MB or not TOML,
/// has values nested more than 16 deep or a line with more than 100 dots; our files need none of
/// that.
[[nodiscard]] TomlTable read_toml(const std::filesystem::path& path);

/// Reads the fields of one table of a file, and throws FileError of one clear line for any fault.
/// It remembers which fields were read, so that `finish` can refuse all others; otherwise a
/// misspelt field would be ignored silently. The table must outlive this object.
class TomlFields {
 public:
  /// `section` is the name of the table in messages; empty for the top level.
  TomlFields(std::filesystem::path path, std::string section, const TomlTable& table);

  /// Returns a number; nullopt if the field is absent. Throws FileError on another type.
  std::optional<double> number(std::string_view field);
  /// Returns a whole number; reals are refused.
  std::optional<std::int64_t> integer(std::string_view field);
  std::optional<bool> boolean(std::string_view field);      ///< true or false.
  std::optional<std::string> text(std::string_view field);  ///< A text in quotation marks.
  /// Returns a list of finite numbers; whole numbers are converted to reals.
  std::optional<std::vector<double>> numbers(std::string_view field);
  /// Returns a list of texts.
  std::optional<std::vector<std::string>> texts(std::string_view field);
  /// Returns a table within this one; the caller must call its `finish`.
  std::optional<TomlFields> section(std::string_view field);
  /// Returns the tables of a list of tables; none if it is absent. The caller must call the
  /// `finish` of each.
  std::vector<TomlFields> sections(std::string_view field);
  /// Returns the number; throws FileError if it is absent.
  double required_number(std::string_view field);
  /// Returns the text; throws FileError with `allowed` if it is absent.
  std::string required_text(std::string_view field, std::string_view allowed);
  /// Returns the index of the field's text in `choices`; nullopt if the field is absent.
  std::optional<std::size_t> choice(std::string_view field,
                                    std::span<const std::string_view> choices);

  /// Throws FileError: the field of this table is `found`; it also names what is `allowed`.
  [[noreturn]] void fail(std::string_view field, std::string_view found,
                         std::string_view allowed) const;
  /// Throws FileError if the table has a field that was never read.
  void finish() const;

 private:
  const TomlValue* get(std::string_view field);
  /// Returns the content of a field; null when it is absent. Throws FileError on another type.
  template <class Value>
  const Value* get(std::string_view field, std::string_view allowed);
  template <class Value>
  std::optional<Value> copy(std::string_view field, std::string_view allowed);
  std::filesystem::path path_;
  std::string section_;
  const TomlTable* table_;
  std::set<std::string, std::less<>> queried_;
};

}  // namespace panonav
