#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "panonav/core/options.hpp"

namespace panonav::command {

/// The values that the user set for one option of a struct.
struct OptionEntry {
  std::optional<std::string> text;  ///< typed on the command line
  bool in_file = false;             ///< given in the --config file
};

/// The entries by name of the option.
using OptionEntries = std::map<std::string, OptionEntry>;

/// `cell_size_m` as `--cell-size-m`.
[[nodiscard]] std::string to_flag(std::string_view option);

/// Replaces "the option NAME", as messages of the library have it, by the flag: "the option
/// image_topic" becomes "--image-topic".
[[nodiscard]] std::string name_flags(std::string_view message);

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

/// Throws UsageError unless the whole text is one finite number.
[[nodiscard]] double parse_number(std::string_view flag, std::string_view text);

/// Writes texts into the members that it visits. Throws UsageError on a text of the wrong type;
/// ranges are left to `validate`.
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

/// A member of an options struct as texts show it.
struct ListedOption {
  const OptionInfo& info;
  std::string_view type;  ///< what stands for its value: "INT"
  std::string value;
  std::string range;  ///< of a number; empty: any
  std::span<const std::string_view> choices;
};

/// Shows each member that it visits to a function.
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
