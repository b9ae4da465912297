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

std::vector<std::string> option_faults(const OptionInfo& info, double value) {
  const bool inside = std::isfinite(value) && value <= info.high &&
                      (info.low_open ? value > info.low : value >= info.low);
  if (inside) return {};
  return {std::string(info.name) + " is " + to_text(value) + "; allowed: " + describe_range(info)};
}

namespace detail {

void FaultCollector::visit(const OptionInfo& info, int& value) {
  for (auto& fault : option_faults(info, value)) faults_.push_back(std::move(fault));
}

void FaultCollector::visit(const OptionInfo& info, double& value) {
  for (auto& fault : option_faults(info, value)) faults_.push_back(std::move(fault));
}

void FaultCollector::visit(const OptionInfo& /*info*/, bool& /*value*/) {}

void FaultCollector::visit(const OptionInfo& info, std::span<const std::string_view> choices,
                           int& value) {
  if (value >= 0 && value < static_cast<int>(choices.size())) return;
  std::string text = std::string(info.name) + " is " + std::to_string(value) + "; allowed:";
  for (const auto choice : choices) text.append(" ").append(choice);
  faults_.push_back(std::move(text));
}

void FaultCollector::finish() const {
  if (faults_.empty()) return;
  std::string text;
  for (const auto& fault : faults_) {
    if (!text.empty()) text += "; ";
    text += fault;
  }
  throw OptionError(text);
}

}  // namespace detail

}  // namespace panonav
