#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/panorama/preprocessing.hpp"
#include "panonav/panorama/sector_view.hpp"

namespace panonav {

/// Features of a view by which narrow pictures are localised: the strongest corners within 3
/// degrees of azimuth, each with an upright histogram of gradients of the 8 degrees around it
/// (4 x 4 cells of 8 directions, as SIFT's [Lowe 2004], square roots [Arandjelovic 2012]). They
/// distinguish places better than `LocalFeatures` where only a part of the azimuth is seen, but
/// take ten times the space.
struct GradientFeatures {
  static constexpr int max_count = 800;  ///< features kept of a panorama at most
  static constexpr int directions = 8;   ///< of gradients, counter-clockwise from the right
  static constexpr int cells = 4;        ///< along each side of a patch
  static constexpr int dimensions = cells * cells * directions;  ///< values of a histogram
  static constexpr int max_level = 15;                           ///< largest value of a histogram
  /// Bytes of a packed feature: column, row (two bytes each, little-endian; the highest bit of the
  /// row marks leading features), two values a byte.
  static constexpr std::size_t packed_bytes = 4 + dimensions / 2;

  /// Square roots of the shares of a patch's gradients, 0 .. 15: index (cell row * 4 + cell column)
  /// * 8 + direction, from the upper left as seen, where azimuths run to the left.
  using Histogram = std::array<std::uint8_t, dimensions>;

  /// A corner: its bearing, in the frame of the view.
  struct Corner {
    float azimuth_rad = 0.0F;    ///< counter-clockwise from the forward direction
    float elevation_rad = 0.0F;  ///< above the horizon
    friend bool operator==(const Corner&, const Corner&) = default;
  };

  std::vector<Corner> corners;        ///< leading ones first; in each part by row, then column
  std::vector<Histogram> histograms;  ///< one for each corner
  /// Number of leading features, which fewer than five stronger corners are near to. Views are
  /// preselected by them.
  std::size_t leading = 0;
  friend bool operator==(const GradientFeatures&, const GradientFeatures&) = default;
};

/// Returns the shape of the cylinders of which features are extracted: one to eight times a
/// memory's shape, whichever is nearest to 1,024 columns.
[[nodiscard]] PanoramaShape find_gradient_shape(PanoramaShape shape) noexcept;

/// Extracts the features of a panorama; nullopt if the elevations of its rows are unknown. Cost:
/// about 30 ms for 160 x 1024.
[[nodiscard]] std::optional<GradientFeatures> extract_gradient_features(
    const Panorama& panorama, const PreprocessingOptions& preprocessing = {});
/// Extracts the features of a sector: corners whose neighbourhood is visible, and of which at least
/// three fifths of the patch are visible; the rest of it is left out of the histogram. Each corner
/// has histograms of three patches, which are 0.71, 1 and 1.41 times as large as those of
/// panoramas: what the robot has approached or left appears larger or smaller. `share`: that of the
/// features of a narrow picture which this sector may have, 1 unless it is one of several.
[[nodiscard]] GradientFeatures extract_gradient_features(
    const SectorView& sector, const PreprocessingOptions& preprocessing = {}, double share = 1.0);

/// Mirrors features left to right: those of a place that does not exist.
[[nodiscard]] GradientFeatures mirror(const GradientFeatures& features);
/// Returns the features whose azimuth is within half of `width_rad` from `middle_rad`, rotated so
/// that `middle_rad` is forward, and whose elevation is within the band: those that a narrow
/// picture would show.
[[nodiscard]] GradientFeatures cut_sector(const GradientFeatures& features, double middle_rad,
                                          double width_rad, const ElevationBand& elevations);

/// Packs the features of a panorama of this shape, `packed_bytes` for each.
[[nodiscard]] std::vector<std::uint8_t> pack(const GradientFeatures& features, PanoramaShape shape,
                                             const ElevationBand& elevations);
/// Unpacks features. Throws ContractError on bytes that `pack` does not make for this shape.
[[nodiscard]] GradientFeatures unpack_gradient_features(std::span<const std::uint8_t> bytes,
                                                        PanoramaShape shape,
                                                        const ElevationBand& elevations);

/// Bytes of a view's local features in a memory, and of its gradient features (docs/formats.md).
struct FeatureBytes {
  std::span<const std::uint8_t> local;     ///< packed `LocalFeatures`
  std::span<const std::uint8_t> gradient;  ///< packed `GradientFeatures`; empty: none
};
/// Joins packed local features and packed gradient features, for one entry of a memory.
[[nodiscard]] std::vector<std::uint8_t> join_feature_bytes(const FeatureBytes& parts);
/// Splits an entry of a memory into its parts; one without gradient features is all local.
[[nodiscard]] FeatureBytes split_feature_bytes(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace panonav
