#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace panonav {

/// The scalars and lists of a YAML file of a camera calibration, by their path, such as
/// "cam0.intrinsics". Reads the part of YAML that such files use: nested mappings, scalars, lists
/// in brackets or of lines that begin with "-", comments, and tags, which it ignores. Nested lists
/// are joined.
class YamlFields {
 public:
  /// Parses the text of a file. Throws FileError that names a line which is none of these.
  YamlFields(std::filesystem::path path, std::string_view text);

  /// Returns the names at the top level, in alphabetical order.
  [[nodiscard]] std::vector<std::string> top_names() const;
  /// True if the file has this path, with a value.
  [[nodiscard]] bool has(const std::string& name) const { return values_.contains(name); }
  /// Returns the scalar of a path; nullopt if there is none.
  [[nodiscard]] std::optional<std::string> text(const std::string& name) const;
  /// Returns the first of these names that the file has, or the first one.
  [[nodiscard]] std::string find_name(const std::vector<std::string>& names) const;
  /// Returns the numbers of a path, of a list or one scalar; empty if there is none. Throws
  /// FileError if one is no finite number.
  [[nodiscard]] std::vector<double> numbers(const std::string& name) const;
  /// Returns exactly `count` numbers. Throws FileError on another count.
  [[nodiscard]] std::vector<double> numbers(const std::string& name, std::size_t count) const;
  /// Throws FileError: the field is `found`; it also names what is `allowed`.
  [[noreturn]] void fail(const std::string& name, std::string_view found,
                         std::string_view allowed) const;

 private:
  std::filesystem::path path_;
  std::map<std::string, std::vector<std::string>> values_;
};

}  // namespace panonav
