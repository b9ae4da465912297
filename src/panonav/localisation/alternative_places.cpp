#include "panonav/localisation/alternative_places.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>

#include "panonav/localisation/internal/kriging.hpp"

namespace panonav {

namespace {

/// Exponent of a difference in the share of a place. Of the two sides of a symmetric hall, nine
/// tenths of the ratios are above 0.89; this exponent gives them at least `min_share`. A logistic
/// regression in corridors of similar doors gives 30 (docs/decisions.md).
constexpr double exponent = 25.0;
/// Smallest share of a place, as bounds hold for 95 %.
constexpr double min_share = 0.05;
/// Largest number of places: more tell a user no more than that the place is ambiguous.
constexpr std::size_t max_places = 4;
/// Number of views of each place that are compared: the corners of a grid square.
constexpr std::size_t compared_views = 4;
/// Smallest difference in a ratio; below it rounding dominates.
constexpr double min_difference = 1e-3;

// Groups the posed matches by single linkage: a chain of matches within `elsewhere_spacings` of
// each other on one floor is one place, such as the next metres of a drive.
std::vector<PlaceShare> group_by_place(const VisualMemory& memory, double spacing_m,
                                       std::span<const RankedMatch> matches) {
  std::vector<RankedMatch> rest;
  for (const RankedMatch& match : matches) {
    if (rest.size() == PositionModel::max_candidates) break;
    if (memory.info(match.match.view).pose) rest.push_back(match);
  }
  const auto is_linked = [&](const RankedMatch& a, const RankedMatch& b) {
    return distance(*find_position(memory.info(a.match.view)),
                    *find_position(memory.info(b.match.view))) <= elsewhere_spacings * spacing_m;
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

}  // namespace

std::vector<PlaceShare> share_probability(const ColumnRanking& ranking,
                                          const NeighbourSupport& support,
                                          const PositionModel& model, const ColumnProfiles& query,
                                          std::span<const RankedMatch> matches,
                                          std::span<const ViewId> excluded) {
  std::vector<PlaceShare> places = group_by_place(ranking.memory(), model.spacing_m, matches);
  if (!model.learnt && !places.empty()) places.resize(1);
  std::vector<double> differences;
  for (const PlaceShare& place : places) {
    double smallest = std::numeric_limits<double>::infinity();
    for (const RankedMatch& match :
         std::span(place.matches).first(std::min(compared_views, place.matches.size()))) {
      const auto supported = support.supported_difference(query, match, excluded);
      smallest = std::min(smallest, supported.value_or(match.columns.difference));
    }
    differences.push_back(std::max(smallest, min_difference));
  }
  double total = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    places[i].share = std::pow(differences.front() / differences[i], exponent);
    total += places[i].share;
  }
  // The first place stays, even if another one fits better.
  const auto is_improbable = [&](const PlaceShare& place) {
    return &place != &places.front() && place.share < min_share * total;
  };
  std::vector<PlaceShare> kept;
  double kept_total = 0.0;
  for (PlaceShare& place : places) {
    if (is_improbable(place)) continue;
    kept_total += place.share;
    kept.push_back(std::move(place));
  }
  for (PlaceShare& place : kept) place.share /= kept_total;
  std::ranges::stable_sort(kept.begin() + 1, kept.end(), std::greater{}, &PlaceShare::share);
  return kept;
}

}  // namespace panonav
