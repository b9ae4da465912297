#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "panonav/core/options.hpp"

namespace panonav::command {

/// What was typed for each option of a struct, by the option's name; empty where nothing was.
using OptionTexts = std::map<std::string, std::optional<std::string>>;

/// Throws UsageError unless the whole text is one finite number.
[[nodiscard]] double number_from_text(std::string_view flag, std::string_view text);

/// Writes texts into the members that it visits. Throws UsageError on a text of the wrong type;
/// ranges are left to `validate`.
class TextApplier final : public OptionVisitor {
 public:
  explicit TextApplier(const OptionTexts& texts) : texts_(texts) {}
  void visit(const OptionInfo& info, int& value) override;
  void visit(const OptionInfo& info, double& value) override;
  void visit(const OptionInfo& info, bool& value) override;
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override;

 private:
  [[nodiscard]] const std::string* text(const OptionInfo& info) const;
  const OptionTexts& texts_;
};

}  // namespace panonav::command
