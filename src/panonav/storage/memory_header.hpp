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
/// Entries by key, ascending.
using Settings = std::map<std::string, SettingValue, std::less<>>;

/// Name of the parameter with the marks of the recordings that were memorised: to be emptied when
/// views are removed or renamed.
inline constexpr std::string_view recordings_parameter = "recordings";

/// Throws ContractError or OptionError that names the field, its value and its range.
void validate(const MemoryHeader& header);

/// The header as settings, and back. `header_from` throws ContractError on a missing, unknown or
/// impossible entry. Entries whose key starts with "parameter." or "synchronised." are no part of
/// the header.
[[nodiscard]] Settings settings_of(const MemoryHeader& header);
/// The header that such settings tell.
[[nodiscard]] MemoryHeader header_from(const Settings& settings);

}  // namespace panonav
