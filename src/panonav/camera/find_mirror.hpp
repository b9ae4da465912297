#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"

namespace panonav {

/// The mirror that `find_mirror` found. Invariant: rim_radius_px > 0; inner_radius_px, if any, is
/// below it.
struct MirrorCircle {
  /// Bounds of the circles that `find_mirror` takes for a rim.
  struct SearchOptions {
    double min_rim = 0.2;           ///< smallest rim radius, in shorter sides of the image; (0, 2]
    double max_rim = 0.75;          ///< largest rim radius, in longer sides of the image; (0, 2]
    double visible_fraction = 0.6;  ///< least part of the rim inside the frame; [0.25, 1]
    double min_quality = 0.55;      ///< a rim below this is no rim; (0, 1]
    friend bool operator==(const SearchOptions&, const SearchOptions&) = default;
  };

  /// Agreement of the per-image rims: standard deviations over the images that show the rim.
  struct Agreement {
    int images = 0;              ///< that show the rim on their own
    double centre_u_px = 0.0;    ///< of the centre's column
    double centre_v_px = 0.0;    ///< of the centre's row
    double rim_radius_px = 0.0;  ///< of the radius
  };

  /// A circle found in an image.
  struct Circle {
    PixelPoint centre;       ///< in the image, to a fraction of a pixel
    double radius_px = 0.0;  ///< of the circle, > 0
    /// Part of the visible circumference, 0 to 1, that has an edge on the circle: within 0.75 px or
    /// 0.002 of the radius, whichever is more. About 0.3 for the best circle in textures without
    /// circles.
    double quality = 0.0;
    /// Root mean square distance of the edge points used from the circle, across it.
    double residual_px = 0.0;
    friend bool operator==(const Circle&, const Circle&) = default;
  };

  ImageSize image_size;        ///< of the images that were searched
  PixelPoint centre;           ///< of the rim
  double rim_radius_px = 0.0;  ///< where the mirrored scene ends
  /// Radius about `centre` that covers the dark disc or the camera's own reflection in the middle;
  /// empty when no such circle stands out.
  std::optional<double> inner_radius_px;
  double quality = 0.0;      ///< of the rim, see Circle
  double residual_px = 0.0;  ///< of the rim, see Circle
  /// The rim as each image alone shows it; empty where an image alone does not show it. One entry
  /// for each image.
  std::vector<std::optional<Circle>> rim_per_image;
  friend bool operator==(const MirrorCircle&, const MirrorCircle&) = default;
};

void visit_options(MirrorCircle::SearchOptions& options, OptionVisitor& visitor);

/// Finds the mirror in one or several raw images of one camera: circles along which edges run, over
/// all centres and radii, refined to a fraction of a pixel by a robust fit. In several images what
/// moves averages out. A plain ring around the mirror does not belong to it. nullopt when no circle
/// reaches `min_quality`. Limits: other round things that fill the picture are taken for a mirror;
/// a mirror in patterned surroundings may be missed; a ring hardly different from the scene counts
/// as mirror. Throws ContractError when there is no image, sizes differ, or a side is
/// shorter than 32 px; OptionError. Cost: about 0.4 s for each image of 640 x 480.
[[nodiscard]] std::optional<MirrorCircle> find_mirror(
    std::span<const ImageView> images, const MirrorCircle::SearchOptions& options = {});

/// Compares the rims of single images; nullopt with fewer than two that show one.
[[nodiscard]] std::optional<MirrorCircle::Agreement> agreement(const MirrorCircle& mirror);

}  // namespace panonav
