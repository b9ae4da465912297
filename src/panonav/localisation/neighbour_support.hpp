#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/geometry/point_grid.hpp"
#include "panonav/localisation/column_ranking.hpp"

namespace panonav {

/// Decides between places that look similar. A view taken between references is explained by
/// several of them together: one shows a thing from too far left, another from too far right. At a
/// place that only looks similar, neighbours do not explain what the best match leaves unexplained.
/// Uses only references with headings.
class NeighbourSupport {
 public:
  /// Indexes the references; neighbours are the 8 nearest ones of its floor within 1.5 spacings.
  /// `spacing_m`: spacing of the references; computed if nullopt. The ranking must outlive *this.
  explicit NeighbourSupport(const ColumnRanking& ranking,
                            std::optional<double> spacing_m = std::nullopt);

  /// Returns the radius of the neighbourhood for this spacing of a memory.
  [[nodiscard]] static double radius_m(double spacing_m) noexcept;
  /// Largest number of matches that `rank_by_support` examines.
  static constexpr std::size_t max_examined = 30;

  /// Returns the spacing of references with headings; 0 if there are fewer than two.
  [[nodiscard]] double spacing_m() const noexcept { return spacing_m_; }

  /// Returns the neighbours ascending by distance; none for a view without a position or heading.
  [[nodiscard]] std::vector<ViewId> neighbours(ViewId view) const;

  /// Returns the joint difference (as `ColumnMatch::difference`) between the query and the match
  /// with its neighbours, all rotated to the heading estimated from `match`. Takes the four views
  /// that fit best, and for each column the mean of its two smallest differences. nullopt for a
  /// view without a position or heading. `query`: over all rows. `excluded`: views not used as
  /// neighbours.
  [[nodiscard]] std::optional<double> supported_difference(
      const ColumnProfiles& query, const RankedMatch& match,
      std::span<const ViewId> excluded = {}) const;

  /// Moves the match whose score by the supported difference is lowest to the front, together with
  /// its neighbours; otherwise keeps the order. Examines only matches whose score is at most 1.25
  /// times that of the first. Changes nothing if no match has neighbours.
  void rank_by_support(const ColumnProfiles& query, std::vector<RankedMatch>& ranked,
                       std::span<const ViewId> excluded = {}) const;

 private:
  /// Returns the pose of a view; null if it has no position or heading.
  [[nodiscard]] const ReferencePose* find_pose(ViewId view) const;

  const ColumnRanking* ranking_;
  double spacing_m_ = 0.0;
  double radius_m_ = 0.0;
  /// References with headings, by floor; empty: no neighbours.
  std::map<std::string, PointGrid, std::less<>> grids_;
};

}  // namespace panonav
