#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/memory/internal/comparison.hpp"
#include "panonav/memory/internal/exact_search.hpp"

namespace panonav {

namespace {

using Row = ViewStore::Row;

struct Candidate {
  Row row;
  std::uint32_t partial;
};

class Hierarchy {
 public:
  Hierarchy(const SearchedViews& searched, const Comparison& comparison, const SearchMask& mask,
            double tolerance, const kernels::DistanceKernels& kernels)
      : searched_(searched),
        comparison_(comparison),
        mask_(mask),
        tolerance_(tolerance),
        kernels_(kernels) {}

  std::vector<VisualMemory::HierarchyLevel> run(
      const std::function<bool(const VisualMemory::HierarchyLevel&)>& stop) {
    std::vector<VisualMemory::HierarchyLevel> levels;
    collect_initial_candidates();
    for (int m = 1; m <= comparison_.components() && !candidates_.empty(); ++m) {
      compare_component(m);
      levels.push_back(make_level(m));
      if (stop && stop(levels.back())) break;
    }
    return levels;
  }

 private:
  [[nodiscard]] double limit() const { return (1.0 + tolerance_) * best_full_; }

  /// Completes the distance of a candidate, whose `partial` is the sum over the first `compared`
  /// components, and updates the best full distance.
  void compare_in_full(const Candidate& candidate, int compared) {
    const std::uint32_t rest =
        comparison_.partial_distance(candidate.row, compared, comparison_.components());
    bytes_read_ += (comparison_.components() - compared) * comparison_.component_bytes();
    best_full_ = std::min(best_full_, static_cast<double>(candidate.partial) + rest);
  }

  /// Collects the views whose lower bound over the first component is within the limit. The limit
  /// comes from the view with the smallest bound over all components, which is compared in full.
  void collect_initial_candidates() {
    const SketchIndex& index = searched_.index;
    const auto keep_all_views = [this] {
      for (const Row row : searched_.rows) {
        if (!comparison_.is_excluded(row)) candidates_.push_back({row, 0});
      }
    };
    if (!index.layout().has_sketches()) {
      keep_all_views();
      return;
    }
    std::vector<std::uint32_t> bounds(index.blocks() * SketchIndex::rows_per_block);
    std::vector<std::uint32_t> smallest(index.blocks());
    const auto compute_bounds = [&](int components) {
      const SketchIndex::Query query =
          index.make_query(comparison_.query(), components, mask_.allowed_rows);
      index.compute_coarse_bounds(kernels_, query, bounds, smallest);
      for (const Row row : comparison_.excluded_rows()) bounds[row] = SketchIndex::no_view;
      bytes_read_ += std::uint64_t{bounds.size()} * index.coarse_bytes_per_row(query);
    };
    compute_bounds(comparison_.components());
    const auto first = std::ranges::min_element(bounds);
    if (first == bounds.end() || *first >= SketchIndex::no_view) return;
    compare_in_full({static_cast<Row>(first - bounds.begin()), 0}, 0);

    compute_bounds(1);
    for (std::size_t row = 0; row < bounds.size(); ++row) {
      if (bounds[row] < SketchIndex::no_view && bounds[row] <= limit()) {
        candidates_.push_back({static_cast<Row>(row), 0});
      }
    }
  }

  /// Adds component m - 1 to the partial sums and drops the views beyond the limit.
  void compare_component(int m) {
    const Candidate* leader = &candidates_.front();
    for (Candidate& candidate : candidates_) {
      candidate.partial += comparison_.partial_distance(candidate.row, m - 1, m);
      if (std::pair(candidate.partial, searched_.view_of_row[candidate.row]) <
          std::pair(leader->partial, searched_.view_of_row[leader->row])) {
        leader = &candidate;
      }
    }
    bytes_read_ += candidates_.size() * comparison_.component_bytes();
    compare_in_full(*leader, m);
    std::erase_if(candidates_,
                  [this](const Candidate& candidate) { return candidate.partial > limit(); });
  }

  [[nodiscard]] VisualMemory::HierarchyLevel make_level(int m) const {
    VisualMemory::HierarchyLevel result;
    result.components = m;
    result.limit = limit();
    result.bytes_read = bytes_read_;
    result.candidates.reserve(candidates_.size());
    for (const Candidate& candidate : candidates_) {
      result.candidates.push_back({searched_.view_of_row[candidate.row], candidate.partial});
    }
    std::ranges::sort(result.candidates, is_nearer);
    return result;
  }

  const SearchedViews& searched_;
  const Comparison& comparison_;
  const SearchMask& mask_;
  double tolerance_;
  const kernels::DistanceKernels& kernels_;
  std::vector<Candidate> candidates_;
  double best_full_ = std::numeric_limits<double>::infinity();
  std::uint64_t bytes_read_ = 0;
};

}  // namespace

std::vector<VisualMemory::HierarchyLevel> hierarchical_search(
    const SearchedViews& searched, const PackedSignature& query, double tolerance, int components,
    const std::function<bool(const VisualMemory::HierarchyLevel&)>& stop, const SearchMask& mask,
    kernels::Instructions instructions) {
  require(std::isfinite(tolerance) && tolerance >= 0.0, "tolerance", tolerance, "finite, >= 0");
  const kernels::DistanceKernels& kernels = kernels::distance_kernels(instructions);
  const Comparison comparison(searched, query, components, mask, kernels);
  return Hierarchy(searched, comparison, mask, tolerance, kernels).run(stop);
}

}  // namespace panonav
