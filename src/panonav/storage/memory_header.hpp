#pragma once

#include "panonav/storage/memory_file.hpp"
#include "panonav/storage/memory_schema.hpp"

namespace panonav {

/// Throws ContractError or OptionError that names the field, its value and its range.
void validate(const MemoryHeader& header);

/// The header as settings, and back. `header_from` throws ContractError on a missing, unknown or
/// impossible entry. Entries whose key starts with "parameter." are no part of the header.
[[nodiscard]] Settings settings_of(const MemoryHeader& header);
[[nodiscard]] MemoryHeader header_from(const Settings& settings);

}  // namespace panonav
