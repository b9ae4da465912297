#pragma once

#include <toml++/toml.h>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace panonav {

// Reading TOML tables with one clear line for everything that is wrong. For the .cpp files of this
// module.

/// Parses the file. Throws FileError: missing, larger than 1 MB, not TOML (with the line).
[[nodiscard]] toml::table read_toml(const std::filesystem::path& path);

/// One table of a file. Remembers which fields were asked for, so that `finish` can refuse the
/// others: a misspelt field would otherwise be silently ignored.
class TomlFields {
 public:
  /// `section` is its name for messages; empty for the top level.
  TomlFields(const std::filesystem::path& path, std::string section, const toml::table& table)
      : path_(path), section_(std::move(section)), table_(table) {}

  [[nodiscard]] bool has(std::string_view field) const { return table_.contains(field); }
  /// Empty when the field is absent; FileError when it is of another type.
  std::optional<double> number(std::string_view field);
  std::optional<std::string> text(std::string_view field);
  std::optional<std::vector<double>> numbers(std::string_view field);
  std::optional<TomlFields> section(std::string_view field);
  /// The same, FileError when absent.
  double required_number(std::string_view field);
  std::string required_text(std::string_view field, std::string_view allowed);
  /// Index into `choices`; empty when absent.
  std::optional<std::size_t> choice(std::string_view field,
                                    std::span<const std::string_view> choices);

  [[noreturn]] void fail(std::string_view field, std::string_view found,
                         std::string_view allowed) const;
  /// Throws FileError when the table has a field that nobody asked for.
  void finish() const;

 private:
  const toml::node* get(std::string_view field);
  std::filesystem::path path_;
  std::string section_;
  const toml::table& table_;
  std::set<std::string, std::less<>> asked_;
};

}  // namespace panonav
