#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

namespace kernels {
struct BandWaves;
}

/// The Gaussian blur of a camera out of focus over azimuth and elevation, for the column profiles
/// of many views.
class ProfileBlur {
 public:
  static constexpr int max_components = 64;  ///< number of components that profiles use at most

  /// `rows`, `elevations`: of the views. `blur_rad`: deviation of the Gaussian.
  ProfileBlur(int rows, const ElevationBand& elevations, double blur_rad);

 private:
  friend class ColumnProfiles;
  std::vector<float> weights_;  // of each row its share in each band of `ColumnProfiles`
  std::array<float, max_components> damping_;  // of each component
};

/// Brightness profiles, from top to bottom, of 128 directions around the robot, by which two views
/// are compared column by column. The view is reconstructed from the signature, its rows are
/// averaged to at most 16 bands, and each column has its mean subtracted and is divided by its
/// contrast. An occlusion therefore changes only the columns that it covers, and lighting that
/// differs between directions cancels.
class ColumnProfiles {
 public:
  static constexpr int columns = 128;  ///< directions around the robot, 2 pi / 128 apart
  static constexpr int bands =
      16;  ///< largest number of bands of elevation, the size of a stored column
  static constexpr int compared_columns = 32;  ///< of a query: every fourth

  /// Makes the profiles from the first `components` of the signature (0: all; at most 64) and the
  /// rows that are not 0 in `allowed_rows` (empty: all rows). Throws ContractError on a number of
  /// components or rows that the signature does not have. Cost: about 3 microseconds for 80 x 15.
  explicit ColumnProfiles(const PackedSignature& signature, int components = 0,
                          std::span<const std::uint8_t> allowed_rows = {});
  /// Makes the profiles of the view as a camera out of focus sees it. Throws ContractError if the
  /// blur is of views with other rows. Cost: twice that of sharp profiles.
  ColumnProfiles(const PackedSignature& signature, const ProfileBlur& blur);

  /// Number of bands to which rows were averaged: at most 16.
  [[nodiscard]] int used_bands() const noexcept { return used_bands_; }
  /// Values in band-major order; 128 is the mean of a column, and the value of all unused bands.
  [[nodiscard]] std::span<const std::uint8_t> values() const noexcept { return values_; }
  /// Values of the compared columns, one column after the other.
  [[nodiscard]] std::span<const std::uint8_t> compared_values() const noexcept {
    return compared_values_;
  }
  friend bool operator==(const ColumnProfiles&, const ColumnProfiles&) = default;

 private:
  void fill(const kernels::BandWaves& waves);
  int used_bands_ = 0;
  std::array<std::uint8_t, static_cast<std::size_t>(columns* bands)> values_;
  std::array<std::uint8_t, static_cast<std::size_t>(compared_columns* bands)> compared_values_;
};

/// Difference of two views at one relative rotation.
struct ColumnMatch {
  /// Mean over the compared columns of the square root of each column's mean absolute difference in
  /// units of contrast: 0 for equal views, 0.2 to 0.5 for neighbouring places, above about 0.6 for
  /// unrelated places. The square root limits the influence of an occluded column.
  double difference = 0.0;
  /// Heading of the query minus heading of the reference, in [-pi, pi), in steps of 2 pi / 128.
  double heading_rad = 0.0;
};

/// Finds the turn at which the columns of two views differ least, among all 128 turns; every fourth
/// column of the query is compared. Throws ContractError on profiles with other bands. Cost: 1
/// microsecond with AVX2 or AVX-512, 9 without vectors.
[[nodiscard]] ColumnMatch match_columns(const ColumnProfiles& query,
                                        const ColumnProfiles& reference);

/// Finds the best rotation, as `match_columns`, and the best one at least 60 degrees away from it:
/// a corridor looks much the same after half a turn. Slightly slower than `match_columns`.
[[nodiscard]] std::array<ColumnMatch, 2> find_two_best_column_matches(
    const ColumnProfiles& query, const ColumnProfiles& reference);

/// Computes the mean absolute difference of each compared column in units of contrast, with the
/// robot rotated by `heading_rad` relative to the reference: for each column the minimum over the
/// nearest rotation step and its two neighbours. `ColumnMatch::difference` is the mean of the
/// square roots of such values, all at one rotation. Throws ContractError on profiles with other
/// bands. Cost: 0.2 microseconds.
[[nodiscard]] std::array<double, ColumnProfiles::compared_columns> column_distances_at_heading(
    const ColumnProfiles& query, const ColumnProfiles& reference, double heading_rad);

}  // namespace panonav
