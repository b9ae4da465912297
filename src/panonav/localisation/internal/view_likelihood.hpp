#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/kernels/similarity.hpp"
#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/internal/cell_table.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/localisation/particle_modes.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// How well one view fits at any pose, also between references (`ObservationModel`).
///
/// The similarity of the view to the references around a pose is correlated with what is expected
/// there, exp(-distance / range): with amplitude a free, least squares explain
/// (sum similarity expected)^2 / sum expected^2 of the squared similarity. A heading that differs
/// from what a reference tells takes that reference's similarity away. References that were not
/// compared count as unlike.
class ViewLikelihood {
 public:
  /// Over the posed views of the ranking's memory; the ranking must outlive *this. Cost: linear in
  /// them. `compass` false: headings do not count.
  ViewLikelihood(const ColumnRanking& ranking, const ObservationModel& model, bool compass);

  /// The position of a posed view.
  struct Site {
    ViewId view;
    Point2 position;
    float reference_heading_rad;  ///< NaN: not known
    float heading_rad;  ///< absolute, of the robot that took the view compared; NaN: not known
    float similarity;   ///< 0: unlike, or not compared
    float log_similarity;
    float other_heading_rad;  ///< the second heading that fits (`match_columns_twice`), and
    float other_similarity;   ///< the similarity then
    float other_log_similarity;
    std::uint32_t compared_at;  ///< number of the view that it was compared with
  };

  /// Forgets the last view. Throws ContractError on a signature of another shape.
  void begin(const PackedSignature& view);
  /// Compares the view with a site's reference, unless it was; returns their difference. Cost: 1
  /// microsecond.
  double compare(std::uint32_t site);
  [[nodiscard]] bool compared(std::uint32_t site) const noexcept {
    return sites_[site].compared_at == number_;
  }
  [[nodiscard]] std::optional<double> min_difference(std::span<const std::uint32_t> sites) const;

  /// Log-likelihood of the view at each pose, over that of a view which no reference there
  /// explains; >= 0. Cost: 15 ns a pose where those of one cell follow each other (`arrange`).
  void log_ratios(const Particles& particles, std::span<double> ratios);
  /// Changes the order of particles so that those of one cell follow each other. Cost: 10 ns each.
  void arrange(Particles& particles);

  [[nodiscard]] std::span<const Site> sites() const noexcept { return sites_; }
  /// Nearest sites of a place, 12 at most; empty far from all references.
  [[nodiscard]] std::span<const std::uint32_t> sites_near(Point2 position) const noexcept;
  /// The sites near most of the particles' weight, heaviest first: those with at least `least` of
  /// it around them, `most` at most.
  [[nodiscard]] std::vector<std::uint32_t> sites_near_most(const Particles& particles,
                                                           std::size_t most, double least);
  [[nodiscard]] std::optional<std::uint32_t> site_of(ViewId view) const noexcept;
  /// Compared with the view so far, in the order of comparison.
  [[nodiscard]] std::span<const std::uint32_t> compared_sites() const noexcept {
    return compared_sites_;
  }

 private:
  /// What is near a cell.
  struct Cell {
    GridCell place;
    std::uint32_t begin, end;      ///< in `near_`
    std::uint32_t lanes_revision;  ///< of the comparisons that `lanes` tells
    std::uint32_t lanes;
  };
  /// Particles of one cell; all that are in no cell are a group too.
  struct Group {
    std::uint32_t cell;  ///< in `cells_`; their number for no cell
    std::uint32_t count;
    double weight;
  };
  void index_sites();
  /// Fills `groups_`, in the order of their first particles, and `group_of_`.
  void group(const Particles& particles);
  [[nodiscard]] GridCell cell_of(Point2 position) const noexcept;
  [[nodiscard]] Point2 centre_of(GridCell cell) const noexcept;
  [[nodiscard]] const kernels::SimilarityLanes& lanes_of(Cell& cell);

  const ColumnRanking* ranking_;
  ObservationModel model_;
  bool compass_;
  std::vector<Site> sites_;
  std::vector<double> differences_;
  std::vector<ColumnProfiles> profiles_;
  std::vector<ViewId> views_;  ///< of the sites, ascending
  CellTable table_;            ///< of the cells with references near
  std::vector<Cell> cells_;    ///< as `table_` numbers them
  std::vector<std::uint32_t> near_;
  std::vector<kernels::SimilarityLanes> lanes_;  ///< of cells asked for since the last comparison
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_of_;       ///< each particle
  std::vector<std::uint32_t> group_of_cell_;  ///< right only where the group is of the cell
  Particles arranged_;
  std::uint32_t revision_ = 1;
  std::vector<std::uint32_t> compared_sites_;
  std::optional<ColumnProfiles> asked_;
  double max_similarity_ = 0.0;
  kernels::SimilarityLanes::Fall fall_{1.0F, 0.0F};
  std::uint32_t number_ = 0;
  double cell_m_ = 1.0;
  double cells_per_metre_ = 1.0;
};

}  // namespace panonav
