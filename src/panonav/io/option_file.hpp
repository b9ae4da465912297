#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/options.hpp"

namespace panonav {

struct TomlField;

/// Returns the text in quotation marks as TOML writes it.
[[nodiscard]] std::string quote_for_toml(std::string_view text);

/// A TOML file of options (docs/formats.md): one section for each options struct, in it one field
/// for each member that the struct's `visit_options` shows.
class OptionFile {
 public:
  /// Throws FileError: missing, not TOML, a field outside all sections.
  explicit OptionFile(std::filesystem::path path);
  ~OptionFile();
  /// Leaves the other in a state in which it may only be destroyed or assigned to.
  OptionFile(OptionFile&&) noexcept;
  OptionFile& operator=(OptionFile&&) noexcept;

  /// Writes the fields of [section] into the members that `visit` shows; members without a field
  /// stay as they are, and so does everything when the file has no such section. Throws FileError
  /// with one line that names file, section, field, value and what is allowed: an unknown field, a
  /// wrong type, a value out of range.
  void apply(std::string_view section, const std::function<void(OptionVisitor&)>& visit);
  /// Applies a section to a struct of options: the members in its table.
  template <class Options>
  requires requires(Options& options, OptionVisitor& visitor) { visit_options(options, visitor); }
  void apply(std::string_view section, Options& options) {
    apply(section, [&options](OptionVisitor& visitor) { visit_options(options, visitor); });
  }

  /// Removes and returns a field that holds a text, since `apply` refuses unknown fields; nullopt
  /// when there is none. Throws FileError on another type.
  std::optional<std::string> take_text(std::string_view section, std::string_view field);

  /// True if the file has this field.
  [[nodiscard]] bool has(std::string_view section, std::string_view field) const;
  /// Throws FileError when the file has a section that is neither among `own` nor among `others`: a
  /// misspelt one would otherwise do nothing. The message names `own` only.
  void require_sections(std::span<const std::string_view> own,
                        std::span<const std::string_view> others = {}) const;

 private:
  std::filesystem::path path_;
  std::vector<TomlField> table_;
};

}  // namespace panonav
