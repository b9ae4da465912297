#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "panonav/core/options.hpp"

namespace panonav::command {

/// Records how the user set one option of a struct.
struct OptionEntry {
  std::optional<std::string> text;  ///< typed on the command line
  bool in_file = false;             ///< given in the --config file
};

/// Maps option names to their entries.
using OptionEntries = std::map<std::string, OptionEntry>;

/// Converts `cell_size_m` to `--cell-size-m`.
[[nodiscard]] std::string to_flag(std::string_view option);

/// Replaces "the option NAME" in messages of the library by the flag: "the option image_topic"
/// becomes "--image-topic".
[[nodiscard]] std::string replace_options_by_flags(std::string_view message);

/// Returns the texts with commas between them.
[[nodiscard]] std::string join_texts(const auto& texts) {
  std::string all;
  for (const auto& text : texts) {
    if (!all.empty()) all += ", ";
    all += text;
  }
  return all;
}

/// True if the word is a flag, not a positional or a negative number.
[[nodiscard]] bool looks_like_flag(std::string_view word);

/// Parses the value of a flag. Throws UsageError unless the whole text is one finite number.
[[nodiscard]] double parse_number(std::string_view flag, std::string_view text);

/// Parses the typed texts into the members of an options struct. Throws UsageError on a text of the
/// wrong type; `validate` checks ranges afterwards.
class TextApplier final : public OptionVisitor {
 public:
  explicit TextApplier(const OptionEntries& entries) : entries_(entries) {}
  void visit(const OptionInfo& info, int& value) override;
  void visit(const OptionInfo& info, double& value) override;
  void visit(const OptionInfo& info, bool& value) override;
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override;

 private:
  [[nodiscard]] const std::string* text(const OptionInfo& info) const;
  const OptionEntries& entries_;
};

/// Describes a member of an options struct for help, completion and config files.
struct ListedOption {
  const OptionInfo& info;
  std::string_view type;  ///< placeholder of its value, such as "INT"
  std::string value;
  std::string range;  ///< allowed numbers; empty: any
  std::span<const std::string_view> choices;
};

/// Calls a function with the description of each member that it visits.
class OptionLister final : public OptionVisitor {
 public:
  explicit OptionLister(std::function<void(const ListedOption&)> list) : list_(std::move(list)) {}
  void visit(const OptionInfo& info, int& value) override;
  void visit(const OptionInfo& info, double& value) override;
  void visit(const OptionInfo& info, bool& value) override;
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override;

 private:
  std::function<void(const ListedOption&)> list_;
};

}  // namespace panonav::command
