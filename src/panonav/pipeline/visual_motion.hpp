#pragma once

#include <string>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/pipeline/view_encoder.hpp"

/// Motion of robots without wheels' odometry, from their pictures.
namespace panonav {

/// The noise of odometry that is read from pictures, as a map takes it to be.
[[nodiscard]] OdometryNoise visual_odometry_noise();
/// Reads motion from pictures in metres as views of the memory differ over known ways.
[[nodiscard]] VisualOdometry visual_odometry(const VisualMemory& memory);
/// Fills the odometry of all entries from the pictures themselves (`VisualOdometry`); metres as
/// views of the memory differ over known ways. Says how many steps could not be read, where the
/// robot then seems to stand, and which scale it took. Throws FileError on a picture that cannot be
/// read.
[[nodiscard]] std::string add_visual_odometry(Dataset& run, const VisualMemory& memory,
                                              const ViewEncoder& encoder, Executor& executor);

}  // namespace panonav
