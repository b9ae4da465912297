#pragma once

#include <string>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/pipeline/view_encoder.hpp"

/// Motion of robots without wheel odometry, estimated from their images.
namespace panonav {

/// Returns the noise that a map assumes for visual odometry.
[[nodiscard]] OdometryNoise visual_odometry_noise();
/// Makes visual odometry whose scale is calibrated by views of the memory with known positions.
[[nodiscard]] VisualOdometry visual_odometry(const VisualMemory& memory);
/// Sets the odometry of all entries by `VisualOdometry`, with the scale calibrated by the memory.
/// Returns a message with the scale and the number of steps that could not be estimated, which are
/// set to no motion. Throws FileError on an image that cannot be read.
[[nodiscard]] std::string add_visual_odometry(Dataset& run, const VisualMemory& memory,
                                              const ViewEncoder& encoder, Executor& executor);

}  // namespace panonav
