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
#include "panonav/panorama/picture_source.hpp"
#include "panonav/panorama/tilt.hpp"

namespace panonav {

/// An image of a robot's camera, with everything known about the moment at which it was taken.
/// Folders, videos, live cameras and recordings deliver observations; all classes in `pipeline`
/// process them one by one.
struct Observation {
  // NOLINTNEXTLINE(google-explicit-constructor): a picture alone is an observation
  /// Makes an observation of a camera picture without any other data.
  Observation(Image image) : picture(std::move(image)) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  /// Makes an observation of a panoramic cylinder without any other data.
  Observation(Panorama panorama) : picture(std::move(panorama)) {}

  /// The picture as delivered by the camera, or a panoramic cylinder.
  std::variant<Image, Panorama> picture;
  /// PNG or JPEG file from which a live picture was decoded, to be forwarded; may be empty.
  std::vector<std::uint8_t> encoded;
  std::string name;  ///< name of the view in a memory, and in messages
  /// File of the image, if any. Errors about the image are then FileErrors with this file's name.
  std::filesystem::path file;
  std::optional<double> stamp_s;  ///< time of exposure in seconds; must ascend if it is used
  /// Absolute pose in the frame of the odometry, which drifts relative to the world.
  std::optional<Pose2> odometry;
  /// Pose in the world frame, from a survey or a simulation. Stored with memorised views; never
  /// used to localise the observation itself.
  std::optional<ReferencePose> pose;
  /// Tilt measured by an inertial sensor, which unwrapping compensates. Encoding throws
  /// ContractError if the tilt exceeds half a degree and the elevations of the image are unknown.
  std::optional<Tilt> tilt;
  /// Layout of this picture, if it is a narrow one (`PictureKind::pinhole`) among panoramic ones:
  /// a question with a phone to the memory of a panoramic camera. Only `PlaceRecogniser` takes it.
  std::optional<PictureSource> narrow_source;
};

/// Returns `make()`. If the image was read from a file, converts a ContractError into a FileError
/// with the file's name.
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
