#pragma once

#include <cstddef>
#include <string_view>

#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Largest absolute stamp of a view in seconds, 31,700 years. Chosen so that the time since any
/// epoch fits and a double still resolves about 0.1 ms.
inline constexpr double max_stamp_s = 1e12;

/// Allowed range of stamps as text, for error messages.
inline constexpr std::string_view stamp_range = "-1000000000000 to 1000000000000 s";

/// Largest length of the name of a view. Chosen: the longest path on Linux.
inline constexpr std::size_t max_name_bytes = 4096;

/// Checks name, pose and stamp of a view; used for all views that are written, loaded, received
/// from a server or verified. Throws ContractError that names the field, on a name that is empty or
/// longer than `max_name_bytes`, a position beyond `max_position_m`, a heading that is not finite,
/// a stamp beyond `max_stamp_s`.
void validate(const ReferenceInfo& info);

/// The same for a pose alone.
void validate(const ReferencePose& pose);

}  // namespace panonav
