#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Value of a setting of a memory.
using SettingValue = std::variant<std::int64_t, double, std::string, std::vector<std::uint8_t>>;
/// Settings by key, ascending.
using Settings = std::map<std::string, SettingValue, std::less<>>;

/// Name of the parameter that lists the memorised recordings. It must be emptied when views are
/// removed or renamed.
inline constexpr std::string_view recordings_parameter = "recordings";

/// Checks a header. Throws ContractError or OptionError with the field, its value and its range.
void validate(const MemoryHeader& header);

/// Converts the header to settings.
[[nodiscard]] Settings to_settings(const MemoryHeader& header);
/// Converts settings to a header; ignores entries whose key begins with "parameter." or
/// "synchronised.". Throws ContractError on a missing, unknown or invalid entry.
[[nodiscard]] MemoryHeader to_header(const Settings& settings);

}  // namespace panonav
