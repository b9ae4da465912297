#pragma once

#include <filesystem>
#include <istream>
#include <optional>
#include <string_view>

#include "panonav/io/dataset.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/panorama/tilt.hpp"

namespace panonav {

/// XMP data of a 360 degree picture [Photo Sphere XMP Metadata, GPano]: how the camera was held and
/// which part of the sphere the picture shows.
struct GpanoData {
  double pitch_rad = 0.0;  ///< elevation of the picture's centre, -pi/2 .. pi/2; positive looks up
  double roll_rad = 0.0;   ///< about the view through the centre; positive lowers the right side
  /// Compass heading of the picture's centre, clockwise from north.
  std::optional<double> heading_rad;
  double azimuth_width_rad = 0.0;  ///< width of the part that the picture shows; 2 pi: all azimuths
  /// Azimuth of its left edge, clockwise from the centre of the whole sphere.
  double azimuth_left_rad = 0.0;
  /// Elevations of its lower and upper edge, with the camera upright; nullopt: not stated.
  std::optional<ElevationBand> elevations;

  /// True if the picture shows all azimuths, within 2 %.
  [[nodiscard]] bool has_all_azimuths() const noexcept;
};

/// Reads the GPano data of an XMP text. nullopt if it has none, or states another projection than
/// the equirectangular one. Values that are no numbers or out of range count as not stated.
[[nodiscard]] std::optional<GpanoData> parse_gpano(std::string_view xmp);

/// Reads the GPano data of a JPEG (APP1 segment) or PNG (iTXt chunk). nullopt if it has none; never
/// throws, whatever the bytes. Cost: reads the head of the file, not its pixels.
[[nodiscard]] std::optional<GpanoData> read_gpano(const std::filesystem::path& file);

/// Converts pitch and roll to the tilt of a robot whose images have this layout. It may exceed
/// `max_tilt_rad`, which images of the whole sphere allow.
[[nodiscard]] Tilt to_tilt(const GpanoData& data, const PictureLayout& layout);

/// Applies the GPano data of the files of a data set of equirectangular pictures or panoramas: sets
/// the tilt of entries that have none, and takes the elevations of the layout from the pictures if
/// they show a part. Moves entries that show only a sector, or other elevations than the first, to
/// `unusable`; adds one line about all this to `warnings`. Throws FileError if no entry is left, or
/// if `kept_elevations` is no part of what the pictures show. Cost: opens each file.
void apply_gpano(Dataset& dataset);

}  // namespace panonav
