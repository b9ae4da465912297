#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
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
/// Limits of the bins of distances, in spacings, in which the changes of views are learnt; each is
/// about 1.3 times the one before.
constexpr std::array<double, 11> change_distances = {0.5, 1.2, 1.6, 2.1, 2.6, 3.3,
                                                     4.3, 5.5, 7.0, 9.0, 12.0};
static_assert(change_distances.size() == std::tuple_size_v<decltype(PositionModel::changes)> + 1);
/// Smallest number of pairs of views in a bin: the median's error is then a fifth of the spread.
constexpr std::size_t min_change_pairs = 20;
/// Smallest unit of squared differences; avoids a division by 0 if all views are identical.
constexpr double min_difference_unit = 1e-4;

/// Views left out of the memory in turn, and the views that resemble them.
struct LeftOutViews {
  std::vector<FloorPosition> true_positions;
  /// All matches of the search, aliased views included. The interpolation is learnt from these,
  /// since they matter if there are few views.
  std::vector<ResemblingViews> found;
  /// Matches without aliased views, ranked as for a query; bounds are learnt from these.
  std::vector<ResemblingViews> answered;
  std::vector<LocalLayout> layouts;  ///< of the other views around the best match of `answered`

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
std::vector<ViewId> find_aliased_views(const VisualMemory& memory, const FloorPosition& truth,
                                       std::span<const RankedMatch> ranked, double spacing_m) {
  std::vector<FloorPosition> places{truth};
  std::vector<ViewId> aliased;
  for (const RankedMatch& match : ranked) {
    const auto position = find_position(memory.info(match.match.view));
    if (!position || std::ranges::any_of(places, [&](const FloorPosition& place) {
          return distance(*position, place) <= elsewhere_spacings * spacing_m;
        })) {
      continue;
    }
    places.push_back(*position);
    aliased.push_back(match.match.view);
  }
  return aliased;
}

void add_left_out_view(const ColumnRanking& ranking, const NeighbourSupport& support,
                       const ReferenceLayout& layout, ViewId view, double spacing_m,
                       LeftOutViews& left_out) {
  const VisualMemory& memory = ranking.memory();
  const PackedSignature own = memory.packed(view);
  const FloorPosition truth = *find_position(memory.info(view));
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
  support.rank_by_support(*ranking.profiles(view), ranked, excluded);
  // `Localiser` computes a position only if the best match has a pose, so only such are learnt
  // from.
  const auto begins_posed = [&](std::span<const RankedMatch> matches) {
    return !matches.empty() && memory.info(matches[0].match.view).pose;
  };
  if (!begins_posed(ranked) || !begins_posed(all)) return;
  left_out.found.push_back(compare_with_each_other(ranking, all));
  left_out.answered.push_back(compare_with_each_other(ranking, ranked));
  left_out.layouts.push_back(
      layout.around(left_out.answered.back().positions[0], std::span(&view, 1)));
  left_out.true_positions.push_back(truth);
}

LeftOutViews leave_out_in_turn(const ColumnRanking& ranking, std::span<const ViewId> views,
                               double spacing_m) {
  const NeighbourSupport support(ranking);
  const ReferenceLayout layout(ranking.memory(), spacing_m);
  LeftOutViews left_out;
  for (const ViewId view : views) {
    add_left_out_view(ranking, support, layout, view, spacing_m, left_out);
  }
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
        sum_m += distance(kriged.position, left_out.true_positions[i].point);
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

/// Error of the interpolated position of a view left out.
struct LeftOutError {
  Point2 error;
  double kriging_variance = 0.0;  ///< expected squared error, in the unit of the variogram
  [[nodiscard]] double length_m() const { return std::hypot(error.x_m, error.y_m); }
};

std::vector<LeftOutError> interpolate_all(const LeftOutViews& left_out,
                                          const PositionModel& model) {
  std::vector<LeftOutError> errors;
  for (std::size_t i = 0; i < left_out.size(); ++i) {
    const KrigedPosition found =
        krige(left_out.answered[i], model.neighbourhood_m, model.exponent, model.difference_unit);
    const Point2 truth = left_out.true_positions[i].point;
    errors.push_back(
        {{found.position.x_m - truth.x_m, found.position.y_m - truth.y_m}, found.variance});
  }
  return errors;
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

// Learns the errors of views found near their place, where the others surround them and where they
// form a line.
void learn_errors(const LeftOutViews& left_out, std::span<const LeftOutError> errors,
                  PositionModel& model) {
  using Kind = LocalLayout::Kind;
  std::vector<double> area_ratios;
  std::vector<double> along_line;
  for (std::size_t i = 0; i < left_out.size(); ++i) {
    if (!left_out.is_answered_near(i, model.spacing_m)) continue;
    const LocalLayout& layout = left_out.layouts[i];
    const Point2 error = errors[i].error;
    if (layout.kind == Kind::area && errors[i].kriging_variance > 0.0) {
      area_ratios.push_back(std::pow(errors[i].length_m(), 2.0) / errors[i].kriging_variance);
    } else if (layout.kind == Kind::line) {
      along_line.push_back(std::abs(error.x_m * std::cos(layout.direction_rad) +
                                    error.y_m * std::sin(layout.direction_rad)));
    }
  }
  constexpr std::size_t min_count = PositionModel::min_views;
  if (area_ratios.size() >= min_count) model.area_error_ratio = quantile(area_ratios, coverage);
  if (along_line.size() >= min_count) model.line_error_m = quantile(along_line, 0.5);
}

// Learns how views change with distance, from the resembling views of each view left out.
void learn_changes(const LeftOutViews& left_out, PositionModel& model) {
  struct Pairs {
    std::vector<double> distances_m;
    std::vector<double> squared_differences;
  };
  std::array<Pairs, change_distances.size() - 1> bins;
  for (const ResemblingViews& near : left_out.answered) {
    for (std::size_t i = 0; i < near.views.size(); ++i) {
      for (std::size_t j = 0; j < near.views.size(); ++j) {
        const double apart_m = distance(near.positions[i], near.positions[j]);
        const auto bin = std::ranges::upper_bound(change_distances, apart_m / model.spacing_m) -
                         change_distances.begin();
        if (bin == 0 || bin == static_cast<std::ptrdiff_t>(change_distances.size())) continue;
        Pairs& pairs = bins[static_cast<std::size_t>(bin) - 1];
        pairs.distances_m.push_back(apart_m);
        pairs.squared_differences.push_back(near.squared_mutual_differences(
            static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
      }
    }
  }
  std::size_t learnt = 0;
  for (const Pairs& pairs : bins) {
    if (pairs.distances_m.size() < min_change_pairs) continue;
    const PositionModel::Change before =
        learnt > 0 ? model.changes[learnt - 1] : PositionModel::Change{};
    const auto& differences = pairs.squared_differences;
    model.changes[learnt++] = {
        quantile(pairs.distances_m, 0.5),
        std::max(before.squared_difference, quantile(differences, 0.5)),
        std::max(before.small_squared_difference, quantile(differences, 1.0 - coverage))};
  }
  // Empty bins repeat the last change.
  if (learnt == 0) return;
  std::fill(model.changes.begin() + static_cast<std::ptrdiff_t>(learnt), model.changes.end(),
            model.changes[learnt - 1]);
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
  const auto errors = interpolate_all(left_out, model);
  std::vector<double> errors_m;
  for (const LeftOutError& error : errors) errors_m.push_back(error.length_m());
  model.median_error_m = quantile(errors_m, 0.5);
  model.error95_m = quantile(errors_m, coverage);
  learn_ambiguity(left_out, errors_m, model);
  learn_errors(left_out, errors, model);
  learn_changes(left_out, model);
  model.learnt = true;
  return model;
}

}  // namespace panonav
