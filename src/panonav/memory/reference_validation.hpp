#pragma once

#include <cstddef>
#include <string_view>

#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// Largest stamp of a view, in seconds either way: 31,700 years, so that the time of any epoch fits
/// while a double keeps it to about a tenth of a millisecond. Chosen.
inline constexpr double max_stamp_s = 1e12;

/// The same for messages.
inline constexpr std::string_view stamp_range = "-1000000000000 to 1000000000000 s";

/// Largest length of the name of a view. Chosen: the longest path on Linux.
inline constexpr std::size_t max_name_bytes = 4096;

/// The one check of a view's name, pose and stamp, for whatever is written, loaded, taken over from
/// a server or verified. Throws ContractError with the field: a name that is empty or longer than
/// `max_name_bytes`, a position beyond `max_position_m`, a heading that is not finite, a stamp
/// beyond `max_stamp_s`.
void validate(const ReferenceInfo& info);

/// The same for a pose alone.
void validate(const ReferencePose& pose);

}  // namespace panonav
