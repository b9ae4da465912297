#include "panonav/localisation/position_model.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "panonav/localisation/internal/kriging.hpp"

namespace panonav {

namespace {

/// Noise of the evidence in spacings: the bound of a query that equals a view is not 0.
constexpr double noise_spacings = 0.1;
/// Range of the median errors in spacings from which the coefficients were learnt; no radius is
/// smaller.
constexpr double min_error_spacings = 0.02;
constexpr double max_error_spacings = 1.0;

// Returns the distance at which `value` of the changes reaches `squared_difference`. Squared
// differences of near views are proportional to their distance; nullopt beyond all changes.
std::optional<double> find_distance_m(const PositionModel& model,
                                      double PositionModel::Change::*value,
                                      double squared_difference) {
  PositionModel::Change below;
  for (const PositionModel::Change& change : model.changes) {
    if (squared_difference <= change.*value) {
      const double step = change.*value - below.*value;
      if (!(step > 0.0)) return below.distance_m;
      return below.distance_m +
             (change.distance_m - below.distance_m) * (squared_difference - below.*value) / step;
    }
    below = change;
  }
  return std::nullopt;
}

// Returns the distance beyond which 95 % of the views of the memory differ more than the query from
// its best match; nullopt if no distances were learnt.
std::optional<double> find_farthest_m(const PositionModel& model, double squared_difference) {
  using Change = PositionModel::Change;
  const Change& last = model.changes.back();
  if (!(last.small_squared_difference > 0.0)) return std::nullopt;
  const auto found_m =
      find_distance_m(model, &Change::small_squared_difference, squared_difference);
  if (found_m) return found_m;
  return last.distance_m * squared_difference / last.small_squared_difference;
}

// Returns the radius of 95 % of the errors.
std::optional<double> find_radius_m(const PositionModel& model, LocalLayout::Kind layout,
                                    double difference, double kriging_variance) {
  const auto radius_m = layout == LocalLayout::Kind::area && model.area_error_ratio
                            ? std::sqrt(*model.area_error_ratio * kriging_variance)
                            : find_farthest_m(model, difference * difference);
  if (!radius_m) return std::nullopt;
  return std::max(*radius_m, min_error_spacings * model.spacing_m);
}

// Returns the length within which 95 % of the errors along a line lie.
std::optional<double> find_bound_along_m(const PositionModel& model, double difference) {
  // Learnt by `bench/position_bound` (docs/decisions.md), in the order of `bound_terms`.
  constexpr std::array<double, bound_term_count> learnt{0.54, 0.95, 0.50};
  const auto terms = bound_terms(model, difference);
  if (!terms) return std::nullopt;
  return model.spacing_m *
         std::exp(std::inner_product(learnt.begin(), learnt.end(), terms->begin(), 0.0));
}

}  // namespace

std::array<double, 3> PositionEstimate::covariance() const noexcept {
  // 95 % of a circular normal distribution lie within 2.4477 standard deviations, 95 % of one
  // coordinate within 1.96.
  constexpr double deviations_of_radius = 2.4477;
  constexpr double deviations_of_coordinate = 1.96;
  if (radius_m && !along_route) {
    const double variance = std::pow(*radius_m / deviations_of_radius, 2.0);
    return {variance, 0.0, variance};
  }
  // Nearly all of the error on a line is across it.
  const double across =
      std::pow(radius_m ? *radius_m / deviations_of_coordinate : unknown_deviation_m, 2.0);
  if (!along_route) return {across, 0.0, across};
  const double along = std::pow(along_route->within_m / deviations_of_coordinate, 2.0);
  const double c = std::cos(along_route->direction_rad);
  const double s = std::sin(along_route->direction_rad);
  return {along * c * c + across * s * s, (along - across) * c * s, along * s * s + across * c * c};
}

std::optional<std::array<double, bound_term_count>> bound_terms(const PositionModel& model,
                                                                double difference) {
  if (!model.line_error_m) return std::nullopt;
  const double distance_m =
      find_distance_m(model, &PositionModel::Change::squared_difference, difference * difference)
          .value_or(model.changes.back().distance_m);
  const double distance_spacings = distance_m / model.spacing_m;
  const double error_spacings =
      std::clamp(*model.line_error_m / model.spacing_m, min_error_spacings, max_error_spacings);
  return {{1.0, std::log(distance_spacings + noise_spacings), std::log(error_spacings)}};
}

std::optional<PositionEstimate> interpolate_position(
    const ColumnRanking& ranking, const PositionModel& model, const ReferenceLayout& layout,
    std::span<const RankedMatch> matches, std::span<const ViewId> excluded, bool is_place_certain) {
  if (matches.empty()) return std::nullopt;
  const auto nearest = find_position(ranking.memory().info(matches[0].match.view));
  if (!nearest) return std::nullopt;
  PositionEstimate estimate;
  if (!model.learnt) {
    estimate.x_m = nearest->point.x_m;
    estimate.y_m = nearest->point.y_m;
    estimate.shares = {{matches[0].match.view, 1.0}};
    return estimate;
  }
  const ResemblingViews near = compare_with_each_other(ranking, matches, model.neighbourhood_m);
  const KrigedPosition kriged =
      krige(near, model.neighbourhood_m, model.exponent, model.difference_unit);
  estimate.x_m = kriged.position.x_m;
  estimate.y_m = kriged.position.y_m;
  const LocalLayout local = layout.around(*nearest, excluded);
  const double difference = matches[0].columns.difference;
  const bool is_ambiguous = !is_place_certain && model.ambiguous_from &&
                            ratio_to_elsewhere(near, model.spacing_m) >= *model.ambiguous_from;
  const double min_bound_m = is_ambiguous ? model.ambiguous_radius_m : 0.0;
  if (const auto radius_m = find_radius_m(model, local.kind, difference, kriged.variance))
    estimate.radius_m = std::max(*radius_m, min_bound_m);
  if (local.kind == LocalLayout::Kind::line) {
    if (const auto along_m = find_bound_along_m(model, difference))
      estimate.along_route = {
          {.direction_rad = local.direction_rad, .within_m = std::max(*along_m, min_bound_m)}};
  }
  for (std::size_t i = 0; i < kriged.used.size(); ++i) {
    estimate.shares.push_back({near.views[kriged.used[i]], kriged.weights[i]});
  }
  return estimate;
}

}  // namespace panonav
