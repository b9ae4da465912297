#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/pipeline/view_encoder.hpp"

/// Motion of robots without wheel odometry, estimated from their images.
namespace panonav {

/// Number of images beside a gap of odometry whose steps give the scale of the motion in it, as
/// that of the memory's views may differ by half.
inline constexpr std::size_t gap_scale_images = 6;
/// Smallest number of such steps, of which one may be wrong; with fewer the memory gives the scale.
inline constexpr std::size_t min_gap_scale_steps = 3;

/// Returns the noise of motion that is read from images at the scale of a memory: lengths vary more
/// than in a map of the drive, where the speed is steady.
[[nodiscard]] OdometryNoise visual_odometry_noise();
/// Makes visual odometry whose scale is calibrated by views of the memory with known positions.
[[nodiscard]] VisualOdometry visual_odometry(const VisualMemory& memory);
/// Describes the motion that was read from images: the number of steps that they show, and advice
/// if these are fewer than half.
[[nodiscard]] std::string describe_visual_motion(const VisualOdometry& odometry);
/// Sets the odometry of the entries that have none by `VisualOdometry`. Between entries with
/// odometry, the motions forwards from the one before and backwards from the one after are
/// interpolated, so that the path meets both. The scale is that of steps beside the gap whose
/// length odometry gives, else calibrated by the memory. Returns the description of the motion.
/// Throws FileError on an image that cannot be read. Reads only images without odometry and the
/// `gap_scale_images` before and after them.
[[nodiscard]] std::string add_visual_odometry(Dataset& run, const VisualMemory& memory,
                                              const ViewEncoder& encoder, Executor& executor);
/// Returns the entries from the first to the last one with odometry; empty if none has any.
[[nodiscard]] std::span<DatasetEntry> find_odometry_part(Dataset& run);
/// Does the same as `add_visual_odometry` for the pauses of odometry in these entries, of which the
/// first and the last have odometry. An image that cannot be read gives no step.
void bridge_odometry_pauses(std::span<DatasetEntry> entries, VisualOdometry odometry,
                            const ViewEncoder& encoder, Executor& executor);

}  // namespace panonav
