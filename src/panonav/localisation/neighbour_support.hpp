#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/point_grid.hpp"
#include "panonav/localisation/column_ranking.hpp"

namespace panonav {

/// Decides between places that look alike. A view taken between references is explained by several
/// of them together: the nearest one shows some things from too far to the left, another shows them
/// from too far to the right. At a place that only looks alike no neighbour explains what the best
/// match does not. Only references with headings count.
class NeighbourSupport {
 public:
  /// Neighbours are the 8 nearest references within 1.5 spacings of the memory. The ranking must
  /// outlive *this. `spacing_m`: the result of `spacing_m()` for the same views, where it is known.
  explicit NeighbourSupport(const ColumnRanking& ranking,
                            std::optional<double> spacing_m = std::nullopt);

  /// Returns the radius of the neighbourhood for this spacing of a memory.
  [[nodiscard]] static double radius_m(double spacing_m) noexcept;
  /// Matches that `rank_by_support` examines, at most.
  static constexpr std::size_t max_examined = 30;

  /// Spacing of references with headings; 0 where there are fewer than two.
  [[nodiscard]] double spacing_m() const noexcept { return spacing_m_; }

  /// Returns the neighbours ascending by distance; none for a view without a position or heading.
  [[nodiscard]] std::vector<ViewId> neighbours(ViewId view) const;

  /// Difference between the query and the place of `match`, as `ColumnMatch::difference`: of the
  /// view and its neighbours, all in the heading that `match` shows, the four count that fit best,
  /// and in each column the mean of the two that fit best there. nullopt for a view without a
  /// position or heading. Both over all rows. `excluded` views support nothing.
  [[nodiscard]] std::optional<double> supported_difference(
      const ColumnProfiles& query, const RankedMatch& match,
      std::span<const ViewId> excluded = {}) const;

  /// Puts the match of the smallest score, by its supported difference, and its neighbours first,
  /// each group in the order that it had. Examines only matches whose score is within a quarter of
  /// the first one's. Changes nothing when no match has neighbours.
  void rank_by_support(const ColumnProfiles& query, std::vector<RankedMatch>& ranked,
                       std::span<const ViewId> excluded = {}) const;

 private:
  /// The pose of a view; null where it has no position or heading.
  [[nodiscard]] const ReferencePose* find_pose(ViewId view) const;

  const ColumnRanking* ranking_;
  double spacing_m_ = 0.0;
  double radius_m_ = 0.0;
  std::optional<PointGrid> grid_;  // of references with headings; nullopt: no neighbours
};

}  // namespace panonav
