#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/voronoi.hpp"
#include "panonav/localisation/internal/kriging.hpp"
#include "panonav/localisation/internal/posed_views.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/localisation/position_model.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

namespace {

/// Candidates for the radius of the neighbourhood, in spacings (rings of a grid), and for the
/// variogram's exponent. An exponent of 1 is exact if signatures change with position as a random
/// walk, 2 if they change linearly; but 2 has no unique solution.
constexpr std::array<double, 6> neighbourhood_choices = {1.6, 2.3, 3.2, 4.5, 6.5, 9.0};
constexpr std::array<double, 3> exponent_choices = {1.0, 1.25, 1.5};
/// Share of the true positions within the radius. Half of the others may be due to lookalike
/// places.
constexpr double coverage = 0.95;
constexpr double max_wrong_share = 0.5 * (1.0 - coverage);
/// Number of matches searched for a left-out view: `max_candidates` remain after its best matches
/// at up to 48 other places have been removed.
constexpr int searched_match_count = 4 * PositionModel::max_candidates;
/// Largest distance between a view and its best match, in spacings, at which the match is right: a
/// grid's neighbours are nearer.
constexpr double max_right_match_spacings = 2.0;
/// Smallest unit of squared differences; avoids a division by 0 if all views are identical.
constexpr double min_difference_unit = 1e-4;

/// Views left out of the memory in turn, and the views that resemble them.
struct LeftOutViews {
  std::vector<Point2> true_positions;
  /// All matches of the search, aliased views included. The interpolation is learnt from these,
  /// since they matter if there are few views.
  std::vector<ResemblingViews> found;
  /// Matches without aliased views, ranked as for a query; the radius is learnt from these.
  std::vector<ResemblingViews> answered;

  [[nodiscard]] std::size_t size() const { return true_positions.size(); }
  [[nodiscard]] bool is_found_near(std::size_t i, double spacing_m) const {
    return distance(found[i].positions[0], true_positions[i]) <=
           max_right_match_spacings * spacing_m;
  }
  [[nodiscard]] bool is_answered_near(std::size_t i, double spacing_m) const {
    return distance(answered[i].positions[0], true_positions[i]) <=
           max_right_match_spacings * spacing_m;
  }
};

// Returns the best match at each place farther than `elsewhere_spacings` from `truth` and from the
// others: perceptual aliasing.
std::vector<ViewId> find_aliased_views(const VisualMemory& memory, Point2 truth,
                                       std::span<const RankedMatch> ranked, double spacing_m) {
  std::vector<Point2> places{truth};
  std::vector<ViewId> aliased;
  for (const RankedMatch& match : ranked) {
    const auto& pose = memory.info(match.match.view).pose;
    if (!pose || std::ranges::any_of(places, [&](Point2 place) {
          return distance(pose->position(), place) <= elsewhere_spacings * spacing_m;
        })) {
      continue;
    }
    places.push_back(pose->position());
    aliased.push_back(match.match.view);
  }
  return aliased;
}

void add_left_out_view(const ColumnRanking& ranking, const NeighbourSupport& support, ViewId view,
                       double spacing_m, LeftOutViews& left_out) {
  const VisualMemory& memory = ranking.memory();
  const PackedSignature own = memory.packed(view);
  const Point2 truth = memory.info(view).pose->position();
  std::vector<ViewId> excluded{view};
  const SearchResult found =
      memory.search(own, {.top = searched_match_count, .components = ranking.components()},
                    {.excluded_views = excluded, .allowed_rows = {}});
  std::vector<RankedMatch> ranked = ranking.rank(own, found.matches);
  const auto nearest =
      std::span(found.matches)
          .first(std::min<std::size_t>(found.matches.size(), PositionModel::max_candidates));
  const std::vector<RankedMatch> all = ranking.rank(own, nearest);
  for (const ViewId other : find_aliased_views(memory, truth, ranked, spacing_m)) {
    excluded.push_back(other);
    std::erase_if(ranked, [&](const RankedMatch& match) { return match.match.view == other; });
  }
  support.rank_by_support(ranking.profiles(view), ranked, excluded);
  // `Localiser` computes a position only if the best match has a pose, so only such are learnt
  // from.
  const auto begins_posed = [&](std::span<const RankedMatch> matches) {
    return !matches.empty() && memory.info(matches[0].match.view).pose;
  };
  if (!begins_posed(ranked) || !begins_posed(all)) return;
  left_out.found.push_back(compare_with_each_other(ranking, all));
  left_out.answered.push_back(compare_with_each_other(ranking, ranked));
  left_out.true_positions.push_back(truth);
}

LeftOutViews leave_out_in_turn(const ColumnRanking& ranking, std::span<const ViewId> views,
                               double spacing_m) {
  const NeighbourSupport support(ranking);
  LeftOutViews left_out;
  for (const ViewId view : views) add_left_out_view(ranking, support, view, spacing_m, left_out);
  return left_out;
}

double learn_difference_unit(const LeftOutViews& left_out) {
  std::vector<double> differences;
  for (const ResemblingViews& near : left_out.found)
    differences.push_back(near.squared_query_differences(0));
  return std::max(min_difference_unit, quantile(differences, 0.5));
}

// Chooses the neighbourhood and the exponent with the smallest position errors. Returns false if no
// view is found near its place. Views found at a lookalike are ignored: they would favour a wide
// neighbourhood, because averaging over many wrong places lowers their error.
bool choose_interpolation(const LeftOutViews& left_out, PositionModel& model) {
  double best_sum_m = std::numeric_limits<double>::infinity();
  for (const double spacings : neighbourhood_choices) {
    for (const double exponent : exponent_choices) {
      const double neighbourhood_m = spacings * model.spacing_m;
      double sum_m = 0.0;
      for (std::size_t i = 0; i < left_out.size(); ++i) {
        if (!left_out.is_found_near(i, model.spacing_m)) continue;
        const KrigedPosition kriged =
            krige(left_out.found[i], neighbourhood_m, exponent, model.difference_unit);
        sum_m += distance(kriged.position, left_out.true_positions[i]);
      }
      if (sum_m < best_sum_m) {
        best_sum_m = sum_m;
        model.neighbourhood_m = neighbourhood_m;
        model.exponent = exponent;
      }
    }
  }
  return std::isfinite(best_sum_m);
}

/// Errors of the interpolated positions, and their kriging variances.
struct InterpolationErrors {
  std::vector<double> errors_m;
  std::vector<double> variances;
};

InterpolationErrors interpolate_all(const LeftOutViews& left_out, const PositionModel& model) {
  InterpolationErrors result;
  for (std::size_t i = 0; i < left_out.size(); ++i) {
    const KrigedPosition kriged =
        krige(left_out.answered[i], model.neighbourhood_m, model.exponent, model.difference_unit);
    result.errors_m.push_back(distance(kriged.position, left_out.true_positions[i]));
    result.variances.push_back(kriged.variance);
  }
  return result;
}

// Learns `ambiguous_from`: sorts the views by ratio and takes the longest prefix in which hardly
// any view was found elsewhere; the next ratio is the first ambiguous one.
void learn_ambiguity(const LeftOutViews& left_out, std::span<const double> errors_m,
                     PositionModel& model) {
  std::vector<std::pair<double, std::size_t>> by_ratio;
  for (std::size_t i = 0; i < left_out.size(); ++i) {
    by_ratio.emplace_back(ratio_to_elsewhere(left_out.answered[i], model.spacing_m), i);
  }
  std::ranges::sort(by_ratio);
  std::size_t clear = 0;
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < by_ratio.size(); ++i) {
    wrong += left_out.is_answered_near(by_ratio[i].second, model.spacing_m) ? 0 : 1;
    const double max_wrong = max_wrong_share * static_cast<double>(i + 1);
    if (static_cast<double>(wrong) <= max_wrong) clear = i + 1;
  }
  if (clear == by_ratio.size()) return;
  std::vector<double> ambiguous_errors_m;
  for (std::size_t i = clear; i < by_ratio.size(); ++i) {
    ambiguous_errors_m.push_back(errors_m[by_ratio[i].second]);
  }
  model.ambiguous_from = by_ratio[clear].first;
  model.ambiguous_radius_m = quantile(ambiguous_errors_m, coverage);
}

// Learns the radii that contain the errors of views found near their place, separately for
// surrounded views and views at the edge. Returns false if no view was found near its place.
bool learn_radii(const LeftOutViews& left_out, const InterpolationErrors& errors,
                 PositionModel& model) {
  std::vector<double> all;
  std::vector<double> surrounded;
  std::vector<double> at_edge;
  for (std::size_t i = 0; i < left_out.size(); ++i) {
    const double variance = errors.variances[i] + min_variance_share * model.variance_unit;
    if (!(variance > 0.0) || !left_out.is_answered_near(i, model.spacing_m)) continue;
    all.push_back(errors.errors_m[i] / std::sqrt(variance));
    (is_surrounded(left_out.answered[i], model.spacing_m) ? surrounded : at_edge)
        .push_back(all.back());
  }
  // If no view was found near its place, every answer is ambiguous, and `ambiguous_radius_m`
  // decides.
  if (all.empty() && model.ambiguous_from) all.push_back(0.0);
  if (all.empty()) return false;
  // Returns the value that a further sample exceeds with at most the probability 1 - `coverage`.
  // Uses all errors if there are few of this kind.
  const auto bound = [&](const std::vector<double>& kind) {
    const auto& of = kind.size() < PositionModel::min_views ? all : kind;
    const double n = static_cast<double>(of.size());
    return quantile(of, std::min(1.0, coverage * (n + 1.0) / n));
  };
  model.radius_m_per_deviation = bound(surrounded);
  model.edge_radius_m_per_deviation = bound(at_edge);
  return true;
}

}  // namespace

PositionModel learn_position_model(const ColumnRanking& ranking, const LearningOptions& options) {
  validate(options);
  const PosedViews posed(ranking.memory());
  PositionModel model;
  model.components = ranking.components();
  model.spacing_m = VoronoiCells(posed.positions).spacing_m();
  if (posed.views.size() < PositionModel::min_views || model.spacing_m == 0.0) return model;
  const std::vector<ViewId> sample =
      sample_views(posed.views, options.sampled_views, static_cast<std::uint64_t>(options.seed));
  const LeftOutViews left_out = leave_out_in_turn(ranking, sample, model.spacing_m);
  if (left_out.size() < PositionModel::min_views) return model;
  model.sampled_views = static_cast<int>(left_out.size());
  model.difference_unit = learn_difference_unit(left_out);
  if (!choose_interpolation(left_out, model)) return model;  // [M04 footnote 1]
  const InterpolationErrors errors = interpolate_all(left_out, model);
  model.variance_unit = quantile(errors.variances, 0.5);
  model.median_error_m = quantile(errors.errors_m, 0.5);
  model.error95_m = quantile(errors.errors_m, coverage);
  learn_ambiguity(left_out, errors.errors_m, model);
  model.learnt = learn_radii(left_out, errors, model);
  return model;
}

}  // namespace panonav
