#pragma once

#include <optional>
#include <string>

#include "cli/json.hpp"
#include "panonav/pipeline/orientation_check.hpp"

namespace panonav::command {

/// Says in a sentence what is stated wrongly about the columns of the images, how many of the
/// compared pairs show it, and which fields or flags correct it. `source`: as stated; `recording`:
/// its name, as the user wrote it.
[[nodiscard]] std::string describe_orientation(const OrientationFault& fault,
                                               const OrientationEvidence& evidence,
                                               const PictureSource& source,
                                               const std::string& recording);
/// Returns the same for machines: null without a fault.
[[nodiscard]] ordered_json orientation_json(const std::optional<OrientationFault>& fault,
                                            const OrientationEvidence& evidence);

}  // namespace panonav::command
