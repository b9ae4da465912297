#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// A view that is compared column by column: for each of 128 directions around the robot, the
/// profile of brightness from top to bottom. The view that the signature's components describe is
/// rebuilt, its rows are averaged to at most 16 bands, and each column is freed of its mean and
/// divided by its contrast. An occlusion therefore changes only the columns where it stands, and
/// light that differs from one direction to another cancels.
class ColumnProfiles {
 public:
  static constexpr int columns = 128;  ///< directions around the robot, 2 pi / 128 apart
  static constexpr int bands =
      16;  ///< largest number of bands of elevation, the size of a stored column
  static constexpr int compared_columns = 32;  ///< of a query: every fourth

  /// Makes profiles of the first `components` of the signature, 0 for all, at most 64; rows that
  /// are 0 in `allowed_rows` do not count (empty: all do). Throws ContractError on a number of
  /// components or rows that the signature does not have. Cost: about 7 microseconds for 80 x 15.
  explicit ColumnProfiles(const PackedSignature& signature, int components = 0,
                          std::span<const std::uint8_t> allowed_rows = {});

  /// Bands that rows were averaged to: 1 .. 16.
  [[nodiscard]] int used_bands() const noexcept { return used_bands_; }
  /// Band-major; 128 stands for the mean of a column, and for all bands that are not used.
  [[nodiscard]] std::span<const std::uint8_t> values() const noexcept { return values_; }
  /// Values of the compared columns, one column after the other.
  [[nodiscard]] std::span<const std::uint8_t> compared_values() const noexcept {
    return compared_values_;
  }
  friend bool operator==(const ColumnProfiles&, const ColumnProfiles&) = default;

 private:
  int used_bands_ = 0;
  std::vector<std::uint8_t> values_;
  std::vector<std::uint8_t> compared_values_;
};

/// Agreement of two views at one turn between them.
struct ColumnMatch {
  /// Mean over the columns of the root of their mean absolute difference, in units of their
  /// contrast: 0 for equal views, 0.2 to 0.5 for neighbouring places, above about 0.6 for unrelated
  /// places. The root limits the weight of an occluded column.
  double difference = 0.0;
  /// Heading of the query minus heading of the reference, in [-pi, pi), in steps of 2 pi / 128.
  double heading_rad = 0.0;
};

/// Finds the turn at which the columns of two views differ least, among all 128 turns; every fourth
/// column of the query is compared. Throws ContractError on profiles with other bands. Cost: 1
/// microsecond with AVX2 or AVX-512, 9 without vectors.
[[nodiscard]] ColumnMatch match_columns(const ColumnProfiles& query,
                                        const ColumnProfiles& reference);

/// Finds that turn and the best one at least 60 degrees from that one, because a corridor looks
/// much the same when turned by half a circle. Costs a little more.
[[nodiscard]] std::array<ColumnMatch, 2> match_columns_twice(const ColumnProfiles& query,
                                                             const ColumnProfiles& reference);

/// Computes the mean absolute difference of each compared column in units of contrast, when the
/// robot is turned by `heading_rad` relative to the reference: the minimum over the nearest turn
/// and the two beside it, column by column. `ColumnMatch::difference` is the mean of the roots of
/// such values, all at one turn. Throws ContractError on profiles with other bands. Cost: 1
/// microsecond.
[[nodiscard]] std::array<double, ColumnProfiles::compared_columns> column_distances_near(
    const ColumnProfiles& query, const ColumnProfiles& reference, double heading_rad);

}  // namespace panonav
