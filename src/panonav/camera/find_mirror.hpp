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
  /// Limits for the circles that `find_mirror` accepts as rim.
  struct SearchOptions {
    double min_rim = 0.2;           ///< smallest rim radius, in shorter sides of the image; (0, 2]
    double max_rim = 0.75;          ///< largest rim radius, in longer sides of the image; (0, 2]
    double visible_fraction = 0.6;  ///< smallest part of the rim inside the frame; [0.25, 1]
    double min_quality = 0.55;      ///< smallest `Circle::quality` of a rim; (0, 1]
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
    /// Share of the visible circumference, 0 to 1, that has an edge within the larger of 0.75 px
    /// and 0.002 of the radius. In textures without circles, the best circle reaches about 0.3.
    double quality = 0.0;
    /// Root mean square radial distance of the edge points used in the fit from the circle.
    double residual_px = 0.0;
    friend bool operator==(const Circle&, const Circle&) = default;
  };

  ImageSize image_size;        ///< of the images that were searched
  PixelPoint centre;           ///< of the rim
  double rim_radius_px = 0.0;  ///< where the mirrored scene ends
  /// Radius around `centre` that encloses the dark disc or the camera's own reflection; nullopt if
  /// no clear circle is found.
  std::optional<double> inner_radius_px;
  double quality = 0.0;      ///< of the rim, see Circle
  double residual_px = 0.0;  ///< of the rim, see Circle
  /// Rim found in each single image; nullopt if an image alone does not show it clearly.
  std::vector<std::optional<Circle>> rim_per_image;
  friend bool operator==(const MirrorCircle&, const MirrorCircle&) = default;
};

void visit_options(MirrorCircle::SearchOptions& options, OptionVisitor& visitor);

/// Finds the mirror in one or several raw images of one camera: circles along which edges run, over
/// all centres and radii, refined to a fraction of a pixel by a robust fit. In several images,
/// edges that move average out. A plain ring around the mirror is excluded. Returns nullopt if no
/// circle reaches `min_quality`. Limits: other round objects that fill the picture are taken for a
/// mirror; a mirror in patterned surroundings may be missed; a ring with almost as much
/// structure as the scene is included in the mirror. Throws ContractError when there is no image,
/// sizes differ, or a side is shorter than 32 px; OptionError. Cost: 0.4 s for an image of 640 x
/// 480.
[[nodiscard]] std::optional<MirrorCircle> find_mirror(
    std::span<const ImageView> images, const MirrorCircle::SearchOptions& options = {});

/// Compares the rims found in single images; nullopt if fewer than two images show one.
[[nodiscard]] std::optional<MirrorCircle::Agreement> agreement(const MirrorCircle& mirror);

/// Largest standard deviation of the rim's centre and radius over images of one fixed camera, as a
/// share of the rim's radius: a centre that is off by it turns directions by 1.1 degrees.
inline constexpr double max_rim_scatter = 0.02;

/// True if the rims in single images deviate by more than `max_rim_scatter`: the camera moved
/// relative to the mirror, or the circle is no mirror, and a calibration from it is wrong.
[[nodiscard]] bool is_scattered(const MirrorCircle& mirror);

}  // namespace panonav
