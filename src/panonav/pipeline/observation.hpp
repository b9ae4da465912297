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

/// One moment of a robot: what its camera saw, and what else is known of it. A folder, a video, a
/// live camera and a recording all become observations, and everything in `pipeline` takes them one
/// at a time.
struct Observation {
  // NOLINTNEXTLINE(google-explicit-constructor): a picture alone is an observation
  /// A picture as the camera delivered it, and nothing else known.
  Observation(Image seen) : picture(std::move(seen)) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  /// A panoramic cylinder, and nothing else known.
  Observation(Panorama seen) : picture(std::move(seen)) {}

  /// As the camera delivered it, or a panoramic cylinder already.
  std::variant<Image, Panorama> picture;
  /// The PNG or JPEG that a live picture was decoded from, for who passes it on; may be empty.
  std::vector<std::uint8_t> encoded;
  std::string name;  ///< of the view that a memory keeps; messages name it
  /// Where the picture was read from; then errors about it are FileErrors that name the file.
  std::filesystem::path file;
  std::optional<double> stamp_s;  ///< when it was taken, seconds; ascending where times count
  /// Absolute, in the frame of the odometry, which drifts against the world.
  std::optional<Pose2> odometry;
  /// In the world frame, where a survey or a simulation knows it. Memories keep it; no estimate of
  /// this picture's own place ever reads it.
  std::optional<ReferencePose> pose;
  /// Measured by an inertial sensor. What is made of the picture is what a level robot would have
  /// seen; where the elevations of the picture are not known, more than half a degree is refused
  /// with ContractError.
  std::optional<Tilt> tilt;
};

/// Returns what `make()` returns. Where the picture was read from a file, a ContractError becomes a
/// FileError that names it.
template <class Make>
auto about_picture(const Observation& observation, const Make& make) {
  try {
    return make();
  } catch (const ContractError& error) {
    if (observation.file.empty()) throw;
    throw FileError(observation.file.string(), error.what());
  }
}

}  // namespace panonav
