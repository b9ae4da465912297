#pragma once

#include <string>
#include <vector>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "panonav/pipeline/orientation_check.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

/// Says in a line what is stated wrongly about the columns of the images, by which evidence, and
/// which fields or flags correct it; empty if nothing is. `source`: as stated; `recording`: its
/// name, as the user wrote it; empty for a memory.
[[nodiscard]] std::string describe_fault(const OrientationCheck& check, const PictureSource& source,
                                         const std::string& recording);
/// Returns the same for machines: null without a fault.
[[nodiscard]] ordered_json orientation_json(const OrientationCheck& check);

/// Checks the stated orientation of the images of the input, a recording, and writes its corrected
/// camera file or dataset.toml to `out` if it is wrong. Throws UsageError for several inputs.
[[nodiscard]] ExitCode correct_recording(const std::vector<std::string>& inputs,
                                         const PictureArguments& pictures, const std::string& out,
                                         Session& session);

}  // namespace panonav::command
