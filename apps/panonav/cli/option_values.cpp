#include "cli/option_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "cli/arguments.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"

namespace panonav::command {

namespace {

[[noreturn]] void throw_invalid_value(std::string_view flag, std::string_view text,
                                      std::string_view allowed) {
  throw UsageError(std::string(flag) + " is '" + std::string(text) +
                   "'; allowed: " + std::string(allowed));
}

}  // namespace

std::string to_flag(std::string_view option) {
  std::string flag = "--" + std::string(option);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

std::string replace_options_by_flags(std::string_view message) {
  constexpr std::string_view lead = "the option ";
  std::string named;
  for (std::size_t at = message.find(lead); at != std::string_view::npos; at = message.find(lead)) {
    const std::size_t begin = at + lead.size();
    const std::size_t end =
        std::min(message.find_first_not_of("abcdefghijklmnopqrstuvwxyz_", begin), message.size());
    named += message.substr(0, begin == end ? end : at);
    if (begin < end) named += to_flag(message.substr(begin, end - begin));
    message.remove_prefix(end);
  }
  return named.append(message);
}

bool looks_like_flag(std::string_view word) {
  return word.size() > 1 && word.front() == '-' && word != "--" &&
         std::string_view("0123456789.").find(word[1]) == std::string_view::npos;
}

double parse_number(std::string_view flag, std::string_view text) {
  double value = 0.0;
  if (!read_number(text, value) || !std::isfinite(value))
    throw_invalid_value(flag, text, "a number");
  return value;
}

const std::string* TextApplier::text(const OptionInfo& info) const {
  const auto found = entries_.find(std::string(info.name));
  return found != entries_.end() && found->second.text ? &*found->second.text : nullptr;
}

void TextApplier::visit(const OptionInfo& info, int& value) {
  const std::string* typed = text(info);
  if (typed == nullptr) return;
  if (!read_number(*typed, value)) {
    throw_invalid_value(info.name, *typed, "whole numbers " + describe_range(info));
  }
}

void TextApplier::visit(const OptionInfo& info, double& value) {
  if (const std::string* typed = text(info)) value = parse_number(info.name, *typed);
}

void TextApplier::visit(const OptionInfo& info, bool& value) {
  const std::string* typed = text(info);
  if (typed == nullptr) return;
  if (*typed != "true" && *typed != "false") throw_invalid_value(info.name, *typed, "true, false");
  value = *typed == "true";
}

void TextApplier::visit(const OptionInfo& info, std::span<const std::string_view> choices,
                        int& value) {
  const std::string* typed = text(info);
  if (typed == nullptr) return;
  const auto found = std::ranges::find(choices, *typed);
  if (found == choices.end()) throw_invalid_value(info.name, *typed, join_texts(choices));
  value = static_cast<int>(found - choices.begin());
}

namespace {

// Writes whole numbers without exponent: 1000000, not 1e+06.
std::string format_bound(double value) {
  const bool whole = std::abs(value) < 1e12 && value == std::floor(value);
  return whole ? std::to_string(static_cast<long long>(value)) : to_text(value);
}

std::string format_range(const OptionInfo& info) {
  std::string text;
  if (std::isfinite(info.low)) text = (info.low_open ? "above " : "from ") + format_bound(info.low);
  if (!std::isfinite(info.high)) return text;
  return text + (text.empty() ? "up to " : " to ") + format_bound(info.high);
}

}  // namespace

void OptionLister::visit(const OptionInfo& info, int& value) {
  list_({info, "INT", std::to_string(value), format_range(info), {}});
}

void OptionLister::visit(const OptionInfo& info, double& value) {
  list_({info, "NUMBER", to_text(value), format_range(info), {}});
}

void OptionLister::visit(const OptionInfo& info, bool& value) {
  static constexpr std::array<std::string_view, 2> choices{"true", "false"};
  list_({info, "BOOL", value ? "true" : "false", {}, choices});
}

void OptionLister::visit(const OptionInfo& info, std::span<const std::string_view> choices,
                         int& value) {
  list_({info, "NAME", std::string(choices[static_cast<std::size_t>(value)]), {}, choices});
}

}  // namespace panonav::command
