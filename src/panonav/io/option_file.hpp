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

/// A TOML file of options (docs/formats.md): one section for each options struct, with a field for
/// each member that `visit_options` of the struct passes.
class OptionFile {
 public:
  /// Reads a file. Throws FileError if it is missing or not TOML, or has a field outside all
  /// sections.
  explicit OptionFile(std::filesystem::path path);
  ~OptionFile();
  /// A moved-from object may only be destroyed or assigned to.
  OptionFile(OptionFile&&) noexcept;
  OptionFile& operator=(OptionFile&&) noexcept;

  /// Sets the members that `visit` passes from the fields of [section]; members without a field
  /// keep their values, and all do if the file has no such section. Throws FileError with one line
  /// that names file, section, field, value and what is allowed, if a field is unknown, of a wrong
  /// type or out of range.
  void apply(std::string_view section, const std::function<void(OptionVisitor&)>& visit);
  /// Sets the members of an options struct from a section, by its `visit_options`.
  template <class Options>
  requires requires(Options& options, OptionVisitor& visitor) { visit_options(options, visitor); }
  void apply(std::string_view section, Options& options) {
    apply(section, [&options](OptionVisitor& visitor) { visit_options(options, visitor); });
  }

  /// Removes a text field, which `apply` would refuse as unknown, and returns it; nullopt if there
  /// is none. Throws FileError on another type.
  std::optional<std::string> take_text(std::string_view section, std::string_view field);

  /// True if the file has this field.
  [[nodiscard]] bool has(std::string_view section, std::string_view field) const;
  /// Throws FileError if the file has a section that is neither in `own` nor in `others`, because a
  /// misspelt section would otherwise be ignored. The message names `own` only.
  void require_sections(std::span<const std::string_view> own,
                        std::span<const std::string_view> others = {}) const;

 private:
  std::filesystem::path path_;
  std::vector<TomlField> table_;
};

}  // namespace panonav
