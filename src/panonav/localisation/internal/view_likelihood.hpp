#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/kernels/similarity.hpp"
#include "panonav/localisation/internal/cell_table.hpp"
#include "panonav/localisation/internal/compared_views.hpp"
#include "panonav/localisation/internal/pose_likelihood.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/localisation/particles.hpp"

namespace panonav {

/// Computes the likelihood of one view at any pose, also between references (`ObservationModel`).
///
/// Fits the similarities of the view to the references around a pose by the expected ones,
/// exp(-distance / range), times a free amplitude. The fit explains (sum similarity expected)^2 /
/// sum expected^2 of the squared similarity. The similarity of a reference is reduced if its
/// heading differs from that of the pose. References that were not compared have similarity 0.
class ViewLikelihood final : public PoseLikelihood {
 public:
  /// Covers the posed views of a memory. `compass`: headings affect the likelihood. Cost: linear in
  /// the views.
  ViewLikelihood(std::unique_ptr<ComparedViews> views, const ObservationModel& model, bool compass);

  /// Reloads the positions of the views and discards all comparisons. Throws, without any change,
  /// ContractError if no view has a position, and exceptions of `ViewIndex` (FileError).
  void update_sites();

  /// The position of a posed view.
  struct Site {
    ViewId view;
    Point2 position;
    float reference_heading_rad;  ///< heading of the reference; NaN: unknown
    float heading_rad;            ///< of the robot at the compared view, absolute; NaN: unknown
    float similarity;             ///< 0: dissimilar, or not compared
    float log_similarity;
    float other_heading_rad;  ///< the second heading that fits (`find_two_best_column_matches`)
    float other_similarity;   ///< in the second heading
    float other_log_similarity;
    std::uint32_t compared_view_number;  ///< number of the view last compared to it
  };

  /// Sets the view to compare. Throws ContractError on a signature of another shape.
  void set_view(const PackedSignature& view);
  /// Searches the `count` most similar views; returns the sites of those with positions.
  [[nodiscard]] std::vector<std::uint32_t> search(int count);
  /// Compares the view with the references at the sites, except those already compared and those
  /// that no longer exist. Cost: 1 microsecond each; 4 microseconds if the profiles are not
  /// cached. Throws FileError like `ViewIndex`.
  void compare(std::span<const std::uint32_t> sites);
  /// Ends the work with the view; changes of the memory by other users become visible at the next
  /// view.
  void release() { views_->release(); }
  [[nodiscard]] bool is_compared(std::uint32_t site) const noexcept {
    return sites_[site].compared_view_number == view_number_;
  }
  /// Returns the smallest difference between the view and the compared ones of these sites; nullopt
  /// if none was compared.
  [[nodiscard]] std::optional<double> min_difference(std::span<const std::uint32_t> sites) const;

  /// Computes the log-likelihood of the view at each pose relative to an unexplained view; >= 0.
  /// Cost: 15 ns a pose if particles are ordered by cell (`reorder_by_cell`).
  void compute_log_ratios(const Particles& particles, std::span<double> ratios) override;
  /// Reorders particles so that those of one cell are adjacent. Cost: 10 ns each.
  void reorder_by_cell(Particles& particles);
  void reorder(Particles& particles) override { reorder_by_cell(particles); }

  [[nodiscard]] std::span<const Site> sites() const noexcept { return sites_; }
  /// True if a site is within this distance. Cost: linear in the sites.
  [[nodiscard]] bool has_site_within(Point2 position, double reach_m) const;
  /// Returns the number of squares of this side that have sites in them.
  [[nodiscard]] std::size_t count_cells(double side_m) const;
  /// Returns the sites nearest to a position, at most 12; none if all sites are far away.
  [[nodiscard]] std::span<const std::uint32_t> sites_near(Point2 position) const noexcept;
  /// Returns the sites around which the particles have a weight of at least `min_weight`, heaviest
  /// first, at most `max_sites`.
  [[nodiscard]] std::vector<std::uint32_t> heaviest_sites(const Particles& particles,
                                                          std::size_t max_sites, double min_weight);
  [[nodiscard]] std::optional<std::uint32_t> site_of(ViewId view) const noexcept;
  /// The sites compared with the view so far, in the order of comparison.
  [[nodiscard]] std::span<const std::uint32_t> compared_sites() const noexcept {
    return compared_sites_;
  }

 private:
  /// A cell with references near.
  struct Cell {
    GridCell grid_cell;
    std::uint32_t begin, end;      ///< in `near_sites_`
    std::uint32_t lanes_revision;  ///< value of `revision_` when `lanes` was made
    std::uint32_t lanes;
  };
  /// The particles of one cell; those outside all cells form one further group.
  struct Group {
    std::uint32_t cell;  ///< index in `cells_`; cells_.size(): no cell
    std::uint32_t count;
    double weight;
  };
  void index_sites();
  /// Adds the cells of column `x` with sites within `reach_m` of their centres. `near_column`:
  /// cells along y and sites of the columns within `around`, ascending.
  void add_cells(std::int32_t x,
                 std::span<const std::pair<std::int32_t, std::uint32_t>> near_column,
                 std::int32_t around, double reach_m);
  /// Keeps the cached profiles of views that still have a site: signatures never change.
  void keep_profiles(std::span<const Site> former_sites);
  void load_profiles(std::span<const std::uint32_t> sites);
  void compare_loaded(std::uint32_t site);
  /// Fills `groups_`, in the order of their first particles, and `group_of_`.
  void group_particles(const Particles& particles);
  [[nodiscard]] GridCell cell_of(Point2 position) const noexcept;
  [[nodiscard]] Point2 centre_of(GridCell cell) const noexcept;
  [[nodiscard]] const kernels::SimilarityLanes& get_or_create_lanes(Cell& cell);

  std::unique_ptr<ComparedViews> views_;
  ObservationModel model_;
  bool compass_;
  std::vector<Site> sites_;
  std::vector<double> differences_;
  std::vector<std::shared_ptr<const ColumnProfiles>> profiles_;  ///< cached ones; else null
  std::size_t cached_profiles_ = 0;
  CellTable table_;          ///< of the cells with references near
  std::vector<Cell> cells_;  ///< in the order of the numbers of `table_`
  std::vector<std::uint32_t> near_sites_;
  std::vector<kernels::SimilarityLanes> lanes_;  ///< made since the last comparison
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_of_;       ///< group of each particle
  std::vector<std::uint32_t> group_of_cell_;  ///< valid only if the group's cell is this one
  Particles arranged_;
  std::uint32_t revision_ = 1;
  std::vector<std::uint32_t> compared_sites_;
  std::optional<PackedSignature> signature_;  ///< of the view
  std::optional<ColumnProfiles> view_;
  double max_similarity_ = 0.0;
  kernels::SimilarityLanes::Decay decay_{1.0F, 0.0F};
  std::uint32_t view_number_ = 0;
  double cell_m_ = 1.0;
  double cells_per_metre_ = 1.0;
};

}  // namespace panonav
