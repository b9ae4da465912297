#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/panorama/tilt.hpp"

namespace panonav {

/// An image of a robot's camera with all that is known about that moment. Folders, videos, live
/// cameras and recordings all become observations, and everything in `pipeline` takes them one at a
/// time.
struct Observation {
  // NOLINTNEXTLINE(google-explicit-constructor): a picture alone is an observation
  /// Makes an observation of a picture as the camera delivered it, and nothing else known.
  Observation(Image image) : picture(std::move(image)) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  /// Makes an observation of a panoramic cylinder, and nothing else known.
  Observation(Panorama panorama) : picture(std::move(panorama)) {}

  /// Picture as the camera delivered it, or a panoramic cylinder.
  std::variant<Image, Panorama> picture;
  /// The PNG or JPEG that a live picture was decoded from, to be passed on; may be empty.
  std::vector<std::uint8_t> encoded;
  std::string name;  ///< name of the view in a memory, and in messages
  /// File of the image, if any; errors about the image are then FileErrors that name it.
  std::filesystem::path file;
  std::optional<double> stamp_s;  ///< time of exposure, seconds; must ascend where time matters
  /// Absolute pose in the frame of the odometry, which drifts relative to the world.
  std::optional<Pose2> odometry;
  /// Pose in the world frame, from a survey or a simulation. Memories store it; the pose of a query
  /// is never used to estimate its own place.
  std::optional<ReferencePose> pose;
  /// Tilt measured by an inertial sensor, which panoramas compensate. If the elevations of the
  /// image are unknown, more than half a degree throws ContractError.
  std::optional<Tilt> tilt;
};

/// Returns `make()`. If the image was read from a file, a ContractError becomes a FileError that
/// names it.
template <class Make>
auto rethrow_with_file_name(const Observation& observation, const Make& make) {
  try {
    return make();
  } catch (const ContractError& error) {
    if (observation.file.empty()) throw;
    throw FileError(observation.file.string(), error.what());
  }
}

}  // namespace panonav
