#include "panonav/localisation/alternative_places.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>

#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/internal/kriging.hpp"

namespace panonav {

namespace {

/// Increase of a place's log odds with each shared feature, from a conditional logistic regression
/// over corridors, halls and a loop (docs/decisions.md); 0.2 to 0.6 in each of them alone.
constexpr double log_odds_per_feature = 0.34;
/// Largest number of places that are compared: more tell a user no more than that the place is
/// ambiguous.
constexpr std::size_t max_places = 8;
/// Number of views of each place that are compared: the corners of a grid square.
constexpr std::size_t compared_views = 4;
/// Largest difference between the robot's headings by two matches of one place: larger than the
/// compass's error between neighbours, far below the quarter rotation of places that look similar.
constexpr double heading_tolerance_rad = radians(20.0);
/// Share of the true positions within a radius.
constexpr double coverage = 0.95;

// Returns the robot's heading by a match; nullopt if its view has none.
std::optional<double> find_heading(const VisualMemory& memory, const RankedMatch& match) {
  const auto& pose = memory.info(match.match.view).pose;
  if (!pose->heading_rad) return std::nullopt;
  return *pose->heading_rad + match.columns.heading_rad;
}

// Groups the posed matches by single linkage: a chain of matches within `elsewhere_spacings` of
// each other on one floor that agree on the robot's heading is one place, such as the next metres
// of a drive.
std::vector<PlaceShare> group_by_place(const VisualMemory& memory, double spacing_m,
                                       std::span<const RankedMatch> matches) {
  std::vector<RankedMatch> rest;
  for (const RankedMatch& match : matches) {
    if (rest.size() == PositionModel::max_candidates) break;
    if (memory.info(match.match.view).pose) rest.push_back(match);
  }
  const auto is_linked = [&](const RankedMatch& a, const RankedMatch& b) {
    if (distance(*find_position(memory.info(a.match.view)),
                 *find_position(memory.info(b.match.view))) > elsewhere_spacings * spacing_m) {
      return false;
    }
    const auto heading_a = find_heading(memory, a);
    const auto heading_b = find_heading(memory, b);
    return !heading_a || !heading_b ||
           std::abs(angle_difference(*heading_a, *heading_b)) <= heading_tolerance_rad;
  };
  std::vector<PlaceShare> places;
  while (!rest.empty() && places.size() < max_places) {
    std::vector<RankedMatch>& place = places.emplace_back().matches;
    place.push_back(rest.front());
    rest.erase(rest.begin());
    for (std::size_t i = 0; i < place.size(); ++i) {
      const RankedMatch linked = place[i];
      const auto others = std::stable_partition(
          rest.begin(), rest.end(),
          [&](const RankedMatch& match) { return !is_linked(linked, match); });
      place.insert(place.end(), others, rest.end());
      rest.erase(others, rest.end());
    }
    std::ranges::sort(place.begin() + 1, place.end(), {}, &RankedMatch::score);
  }
  return places;
}

std::span<RankedMatch> find_compared_views(PlaceShare& place) {
  return std::span(place.matches).first(std::min(compared_views, place.matches.size()));
}

// Divides the shares by their sum.
void normalise(std::vector<PlaceShare>& places) {
  double total = 0.0;
  for (const PlaceShare& place : places) total += place.share;
  for (PlaceShare& place : places) place.share /= total;
}

}  // namespace

std::vector<PlaceShare> share_probability(const ColumnRanking& ranking,
                                          const NeighbourSupport& support,
                                          const PositionModel& model, const ColumnProfiles& query,
                                          std::span<const RankedMatch> matches,
                                          std::span<const ViewId> excluded) {
  std::vector<PlaceShare> places = group_by_place(ranking.memory(), model.spacing_m, matches);
  if (!model.learnt && !places.empty()) places.resize(1);
  std::vector<double> differences;
  for (PlaceShare& place : places) {
    double smallest = std::numeric_limits<double>::infinity();
    for (const RankedMatch& match : find_compared_views(place)) {
      const auto supported = support.supported_difference(query, match, excluded);
      smallest = std::min(smallest, supported.value_or(match.columns.difference));
    }
    differences.push_back(std::max(smallest, min_shared_difference));
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i].share = std::pow(differences.front() / differences[i], share_exponent);
  }
  normalise(places);
  // The first place stays, even if another one fits better.
  if (!places.empty()) {
    std::ranges::stable_sort(places.begin() + 1, places.end(), std::greater{}, &PlaceShare::share);
  }
  return places;
}

bool share_probability_by_features(std::vector<PlaceShare>& places,
                                   const VerifiedFeatureCounter& count) {
  std::vector<int> verified;
  for (PlaceShare& place : places) {
    std::optional<int> max_verified;
    for (RankedMatch& match : find_compared_views(place)) {
      match.verified_features = count(match);
      max_verified = std::max(max_verified, match.verified_features);
    }
    if (!max_verified) return false;
    verified.push_back(*max_verified);
  }
  if (places.empty()) return false;
  const int largest = std::ranges::max(verified);
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i].share = std::exp(log_odds_per_feature * (verified[i] - largest));
  }
  normalise(places);
  std::ranges::stable_sort(places, std::greater{}, &PlaceShare::share);
  return true;
}

double radius_over_places(double radius_m, double share, std::vector<OtherPlace> others) {
  std::ranges::sort(others, {}, &OtherPlace::reach_m);
  double total = share;
  for (const OtherPlace& other : others) total += other.share;
  double covered = 0.0;  // share of the other places within `inner_m`
  double inner_m = 0.0;
  for (auto other = others.begin();; ++other) {
    // The share of the errors at the chosen place that the radius must still contain.
    const double needed = (coverage * total - covered) / share;
    if (needed <= 0.0) return inner_m;
    if (needed < 1.0) {
      const double found_m =
          std::max(inner_m, radius_m * std::sqrt(std::log1p(-needed) / std::log1p(-coverage)));
      if (other == others.end() || found_m <= other->reach_m) return found_m;
    }
    covered += other->share;
    inner_m = other->reach_m;
  }
}

}  // namespace panonav
