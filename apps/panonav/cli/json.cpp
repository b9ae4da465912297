#include "cli/json.hpp"

#include <array>

namespace panonav::command {

namespace {

struct FormerKey {
  std::string_view now;
  std::string_view former;
};

/// Keys of JSON output that have another name since the last version; the only list of them.
constexpr std::array<FormerKey, 2> former_keys{{
    {"column_difference", "difference"},  // localise: column by column, after turning
    {"image_difference", "difference"},   // navigate: of whole views
}};

ordered_json with_former_keys(const ordered_json& value) {
  if (!value.is_structured()) return value;
  ordered_json renamed = value.is_array() ? ordered_json::array() : ordered_json::object();
  for (const auto& [key, member] : value.items()) {
    if (value.is_array()) {
      renamed.push_back(with_former_keys(member));
      continue;
    }
    std::string_view name = key;
    for (const FormerKey& entry : former_keys) {
      if (name == entry.now) name = entry.former;
    }
    renamed[std::string(name)] = with_former_keys(member);
  }
  return renamed;
}

}  // namespace

std::string with_former_keys(std::string_view line) {
  const auto value = ordered_json::parse(line);
  const auto renamed = with_former_keys(value);
  return renamed == value ? std::string(line) : renamed.dump();
}

}  // namespace panonav::command
