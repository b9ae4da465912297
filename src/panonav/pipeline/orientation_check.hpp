#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

#include "panonav/io/dataset.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/relative_pose/orientation_evidence.hpp"
#include "panonav/storage/memory_file.hpp"

/// Checks of the stated orientation of images: the direction in which their columns run, and the
/// column or angle that is forward.
namespace panonav {

/// A view or an image with its place.
struct PosedImage {
  Pose2 pose;              ///< of the robot
  std::string_view floor;  ///< with its own frame of poses
  std::size_t index = 0;   ///< number by which the view is read
};

/// Compares at most 60 images, evenly spread, with up to three others each: the first of the next
/// 100 that is 0.1 m away, the first that turned by 10 degrees within 2 m, and the nearest image in
/// another direction than the first. `view_at` returns the view of an index; nullopt: it cannot be
/// read. Cost: that of 240 views, and O(images) for each of the 60.
[[nodiscard]] OrientationEvidence collect_orientation_evidence(
    std::span<const PosedImage> images,
    const std::function<std::optional<HomingView>(std::size_t)>& view_at);
/// Compares images of a recording, as the encoder reads them, by poses with headings, or else by
/// odometry, or else by positions with headings along the path; has no evidence without these.
/// Images that cannot be read are left out.
[[nodiscard]] OrientationEvidence collect_orientation_evidence(const Dataset& recording,
                                                               const ViewEncoder& encoder);
/// The same with the views of a memory that have the names of the images, so that no image is read.
[[nodiscard]] OrientationEvidence collect_orientation_evidence(const Dataset& recording,
                                                               const MemoryFile& memory);

/// Returns the source with its orientation corrected; nullopt for two fisheye lenses, which are
/// calibrated again.
[[nodiscard]] std::optional<PictureSource> correct_orientation(PictureSource source,
                                                               const OrientationFault& fault);

}  // namespace panonav
