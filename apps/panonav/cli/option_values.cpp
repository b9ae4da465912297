#include "cli/option_values.hpp"

#include <charconv>
#include <cmath>

#include "cli/arguments.hpp"

namespace panonav::command {

namespace {

[[noreturn]] void refuse(std::string_view flag, std::string_view text, std::string_view allowed) {
  throw UsageError(std::string(flag) + " is '" + std::string(text) +
                   "'; allowed: " + std::string(allowed));
}

}  // namespace

double number_from_text(std::string_view flag, std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    refuse(flag, text, "a number");
  }
  return value;
}

const std::string* TextApplier::text(const OptionInfo& info) const {
  const auto found = entries_.find(std::string(info.name));
  return found != entries_.end() && found->second.text ? &*found->second.text : nullptr;
}

void TextApplier::visit(const OptionInfo& info, int& value) {
  const std::string* typed = text(info);
  if (typed == nullptr) return;
  const auto [end, error] = std::from_chars(typed->data(), typed->data() + typed->size(), value);
  if (error != std::errc() || end != typed->data() + typed->size()) {
    refuse(info.name, *typed, "whole numbers " + range_text(info));
  }
}

void TextApplier::visit(const OptionInfo& info, double& value) {
  if (const std::string* typed = text(info)) value = number_from_text(info.name, *typed);
}

void TextApplier::visit(const OptionInfo& info, bool& value) {
  const std::string* typed = text(info);
  if (typed == nullptr) return;
  if (*typed != "true" && *typed != "false") refuse(info.name, *typed, "true, false");
  value = *typed == "true";
}

void TextApplier::visit(const OptionInfo& info, std::span<const std::string_view> choices,
                        int& value) {
  const std::string* typed = text(info);
  if (typed == nullptr) return;
  std::string all;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (choices[i] == *typed) {
      value = static_cast<int>(i);
      return;
    }
    all += (all.empty() ? "" : ", ") + std::string(choices[i]);
  }
  refuse(info.name, *typed, all);
}

}  // namespace panonav::command
