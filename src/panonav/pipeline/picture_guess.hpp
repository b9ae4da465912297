#pragma once

#include <optional>
#include <span>
#include <string>

#include "panonav/core/executor.hpp"
#include "panonav/core/image.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/panorama/picture_source.hpp"

namespace panonav {

/// Form of the images of a camera that is not known.
enum class PictureForm {
  sphere,      ///< twice as wide as high: the whole sphere
  two_lenses,  ///< two circles side by side: the raw images of a 360 degree camera
  mirror,      ///< a ring or circle: a mirror camera, or a fisheye camera that points up
  strip,       ///< a panorama wider than a sphere, whose edges continue each other
  ordinary     ///< no form that shows all directions
};

/// Guess how the images of an unknown camera are read.
struct PictureGuess {
  PictureForm form = PictureForm::ordinary;  ///< of most of the images
  /// How the images are read; nullopt if they cannot be used as they are.
  std::optional<PictureSource> source;
  std::string explanation;  ///< for people: what was found, what was assumed, what to do
};

/// Guesses how to read the images of an unknown camera from some of them, by their shape, their
/// dark corners, their circles and whether the left edge continues the right one. A mirror gets the
/// default profile (elevations from -60 to 20 degrees), lenses are calibrated from single images
/// (`calibrate_dual_fisheye`), a strip gets square pixels with the horizon in the middle; the
/// explanation mentions these assumptions. Images alone do not show whether they are mirrored.
/// Throws ContractError without samples. Cost: up to some seconds.
[[nodiscard]] PictureGuess guess_pictures(std::span<const Image> samples, Executor& executor);

/// Lean of a camera against the vertical.
struct Lean {
  double rad = 0.0;        ///< typical size
  bool is_common = false;  ///< the same in all images, as of a camera that is mounted askew
};
/// Estimates from the slant of the upright edges of walls, doors and trees by how much the camera
/// leans; up to 20 degrees, to about a third. nullopt if no lean is significant (three standard
/// errors) between the images and between two halves of the azimuths: most upright images, images
/// without upright edges or with unknown elevations, and fewer than 8 images. Cost: some 20 ms an
/// image.
[[nodiscard]] std::optional<Lean> estimate_lean(std::span<const Panorama> panoramas,
                                                Executor& executor);

/// Counts the lowest rows that look the same in all panoramas, as those that show the camera's
/// carrier. Needs panoramas of one shape from different places; 0 for fewer than 8.
[[nodiscard]] int count_carrier_rows(std::span<const Panorama> panoramas);

}  // namespace panonav
