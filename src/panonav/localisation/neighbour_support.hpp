#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"

namespace panonav {

/// Decides between places that look alike. A view taken between references is explained by several
/// of them together: what the nearest one shows from too far to the left, another shows from too
/// far to the right. At a place that only looks alike no neighbour explains what the best match
/// does not. Needs references with headings; others take part in nothing here.
class NeighbourSupport {
 public:
  /// Neighbours are the 8 nearest references within 1.5 spacings of the memory. The ranking must
  /// outlive *this. `spacing_m`: what `spacing_m()` gave for the same views.
  explicit NeighbourSupport(const ColumnRanking& ranking,
                            std::optional<double> spacing_m = std::nullopt);

  /// Within which neighbours lie, for this spacing of a memory.
  [[nodiscard]] static double radius_m(double spacing_m) noexcept;
  /// The matches that `rank_by_support` may look at, of those that it is given.
  static constexpr std::size_t max_examined = 30;

  /// Between references with headings; 0 where there are fewer than two.
  [[nodiscard]] double spacing_m() const noexcept { return spacing_m_; }

  /// Ascending by distance; empty for a view without a position or heading.
  [[nodiscard]] std::vector<ViewId> neighbours(ViewId view) const;

  /// How much the query and the place of `match` differ, as `ColumnMatch::difference`: of the place
  /// and its neighbours, all in the heading that `match` tells, the four that fit best are taken,
  /// and in each column the mean of the two that fit best there. Empty for a view without a
  /// position or heading. Both over all rows. `excluded` views support nothing.
  [[nodiscard]] std::optional<double> supported_difference(
      const ColumnProfiles& query, const RankedMatch& match,
      std::span<const ViewId> excluded = {}) const;

  /// Puts the match with the least score, by its supported difference, and its neighbours first,
  /// each group in the order that it was in. Only matches whose score is within a quarter of the
  /// first one's are looked at, `max_examined` at most. `ranked` stays as it is when no match has
  /// neighbours.
  void rank_by_support(const ColumnProfiles& query, std::vector<RankedMatch>& ranked,
                       std::span<const ViewId> excluded = {}) const;

 private:
  struct Site {
    std::int64_t cell_x, cell_y;
    ViewId view;
  };
  [[nodiscard]] const ReferencePose* placed(ViewId view) const;
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> cell_of(Point2 position) const;

  const ColumnRanking* ranking_;
  double spacing_m_ = 0.0;
  double radius_m_ = 0.0;
  std::vector<Site> sites_;  ///< ascending by cell, then view
};

}  // namespace panonav
