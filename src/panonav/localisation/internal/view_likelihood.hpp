#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "panonav/kernels/similarity.hpp"
#include "panonav/localisation/internal/cell_table.hpp"
#include "panonav/localisation/internal/compared_views.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/localisation/particles.hpp"

namespace panonav {

/// Likelihood of one view at any pose, also between references (`ObservationModel`).
///
/// The similarity of the view to the references around a pose is correlated with the expected one,
/// exp(-distance / range): with amplitude a free, least squares explain
/// (sum similarity expected)^2 / sum expected^2 of the squared similarity. A heading that differs
/// from that of a reference takes the reference's similarity away. References that were not
/// compared count as dissimilar.
class ViewLikelihood {
 public:
  /// Covers the posed views of a memory. Without `compass` headings do not count. Cost: linear in
  /// the views.
  ViewLikelihood(std::unique_ptr<ComparedViews> views, const ObservationModel& model, bool compass);

  /// Covers the views that have positions now; nothing is compared then. Throws ContractError when
  /// there is none, FileError as a `ViewIndex`; then all stays as it was.
  void update_sites();

  /// The position of a posed view.
  struct Site {
    ViewId view;
    Point2 position;
    float reference_heading_rad;  ///< NaN: not known
    float heading_rad;  ///< absolute, of the robot that took the compared view; NaN: not known
    float similarity;   ///< 0: dissimilar, or not compared
    float log_similarity;
    float other_heading_rad;  ///< the second heading that fits (`match_columns_two_best`)
    float other_similarity;   ///< in the second heading
    float other_log_similarity;
    std::uint32_t compared_at;  ///< number of the view with which it was compared
  };

  /// Sets the view to compare. Throws ContractError on a signature of another shape.
  void set_view(const PackedSignature& view);
  /// Searches all views for the most similar ones, at most `count`; returns those with a site.
  [[nodiscard]] std::vector<std::uint32_t> search(int count);
  /// Compares the view with the references of the sites, except those that are compared already and
  /// those that no longer exist. Cost: 1 microsecond each, and 10 for one whose profiles are not
  /// cached. Throws FileError as a `ViewIndex`.
  void compare(std::span<const std::uint32_t> sites);
  /// Ends the work with the view: the next one sees what others changed in the memory.
  void release() { views_->release(); }
  [[nodiscard]] bool is_compared(std::uint32_t site) const noexcept {
    return sites_[site].compared_at == number_;
  }
  /// Returns the smallest difference to those of the sites that were compared; nullopt when none
  /// was.
  [[nodiscard]] std::optional<double> min_difference(std::span<const std::uint32_t> sites) const;

  /// Computes the log-likelihood of the view at each pose, over that of an unexplained view; >= 0.
  /// Cost: 15 ns a pose where those of one cell follow each other (`arrange`).
  void compute_log_ratios(const Particles& particles, std::span<double> ratios);
  /// Reorders particles so that those of one cell follow each other. Cost: 10 ns each.
  void arrange(Particles& particles);

  [[nodiscard]] std::span<const Site> sites() const noexcept { return sites_; }
  /// Returns the nearest sites of a position, 12 at most; none far from all references.
  [[nodiscard]] std::span<const std::uint32_t> sites_near(Point2 position) const noexcept;
  /// Returns at most `max_sites` sites with at least `min_weight` of the particles around them,
  /// heaviest first.
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
    GridCell place;
    std::uint32_t begin, end;      ///< in `near_`
    std::uint32_t lanes_revision;  ///< of the comparisons when `lanes` was made
    std::uint32_t lanes;
  };
  /// The particles of one cell; all that are in no cell form a group too.
  struct Group {
    std::uint32_t cell;  ///< in `cells_`; their number for no cell
    std::uint32_t count;
    double weight;
  };
  void index_sites();
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
  std::vector<std::optional<ColumnProfiles>> profiles_;  ///< cached ones
  std::size_t cached_profiles_ = 0;
  CellTable table_;          ///< of the cells with references near
  std::vector<Cell> cells_;  ///< as `table_` numbers them
  std::vector<std::uint32_t> near_;
  std::vector<kernels::SimilarityLanes> lanes_;  ///< made since the last comparison
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_of_;       ///< each particle
  std::vector<std::uint32_t> group_of_cell_;  ///< valid only where the group is of the cell
  Particles arranged_;
  std::uint32_t revision_ = 1;
  std::vector<std::uint32_t> compared_sites_;
  std::optional<PackedSignature> signature_;  ///< of the view
  std::optional<ColumnProfiles> view_;
  double max_similarity_ = 0.0;
  kernels::SimilarityLanes::Fall fall_{1.0F, 0.0F};
  std::uint32_t number_ = 0;
  double cell_m_ = 1.0;
  double cells_per_metre_ = 1.0;
};

}  // namespace panonav
