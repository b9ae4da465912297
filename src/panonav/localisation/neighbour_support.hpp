#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/point_grid.hpp"
#include "panonav/localisation/column_ranking.hpp"

namespace panonav {

/// Decides between places that look similar. A view taken between references is explained by
/// several of them together: what one shows from too far left, another shows from too far right. At
/// a place that only looks similar, no neighbour explains what the best match does not. Only
/// references with headings count.
class NeighbourSupport {
 public:
  /// Indexes the references; neighbours are the 8 nearest ones within 1.5 spacings. `spacing_m`:
  /// spacing of the references; computed if nullopt. The ranking must outlive *this.
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

  /// Returns the difference (`ColumnMatch::difference`) of the query from the match and its
  /// neighbours together, all rotated to the heading that `match` shows. Of the four best-fitting
  /// views, each column takes the mean of its two best ones. nullopt for a view without a position
  /// or heading. `query`: over all rows. `excluded`: views that do not count as neighbours.
  [[nodiscard]] std::optional<double> supported_difference(
      const ColumnProfiles& query, const RankedMatch& match,
      std::span<const ViewId> excluded = {}) const;

  /// Moves the match with the lowest score by its supported difference, and its neighbours, to the
  /// front; the order is otherwise kept. Examines only matches whose score is at most 1.25 times
  /// the first one's. Changes nothing if no match has neighbours.
  void rank_by_support(const ColumnProfiles& query, std::vector<RankedMatch>& ranked,
                       std::span<const ViewId> excluded = {}) const;

 private:
  /// Returns the pose of a view; null if it has no position or heading.
  [[nodiscard]] const ReferencePose* find_pose(ViewId view) const;

  const ColumnRanking* ranking_;
  double spacing_m_ = 0.0;
  double radius_m_ = 0.0;
  std::optional<PointGrid> grid_;  // of references with headings; nullopt: no neighbours
};

}  // namespace panonav
