#include "panonav/core/options.hpp"

#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav {

std::string describe_range(const OptionInfo& info) {
  const bool has_low = std::isfinite(info.low);
  const bool has_high = std::isfinite(info.high);
  std::string low(info.low_open ? "> " : ">= ");
  low += to_text(info.low);
  if (has_low && has_high) return low + " and <= " + to_text(info.high);
  if (has_low) return low;
  if (has_high) return "<= " + to_text(info.high);
  return "any finite number";
}

std::optional<std::string> find_option_fault(const OptionInfo& info, double value) {
  const bool inside = std::isfinite(value) && value <= info.high &&
                      (info.low_open ? value > info.low : value >= info.low);
  if (inside) return std::nullopt;
  return std::string(info.name) + " is " + to_text(value) + "; allowed: " + describe_range(info);
}

namespace {

/// Collects the faults of all options.
class FaultCollector final : public OptionVisitor {
 public:
  void visit(const OptionInfo& info, int& value) override { add(find_option_fault(info, value)); }
  void visit(const OptionInfo& info, double& value) override {
    add(find_option_fault(info, value));
  }
  void visit(const OptionInfo& /*info*/, bool& /*value*/) override {}
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    if (value >= 0 && value < static_cast<int>(choices.size())) return;
    std::string text = std::string(info.name) + " is " + std::to_string(value) + "; allowed:";
    for (const auto choice : choices) text.append(" ").append(choice);
    add(std::move(text));
  }
  std::string faults;

 private:
  void add(std::optional<std::string> fault) {
    if (fault) faults += (faults.empty() ? "" : "; ") + *fault;
  }
};

}  // namespace

void detail::require_valid(const std::function<void(OptionVisitor&)>& visit) {
  FaultCollector collector;
  visit(collector);
  if (!collector.faults.empty()) throw OptionError(collector.faults);
}

}  // namespace panonav
