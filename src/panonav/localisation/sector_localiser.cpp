#include "panonav/localisation/sector_localiser.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/nearest_points.hpp"
#include "panonav/localisation/alternative_places.hpp"
#include "panonav/localisation/internal/sector_learning.hpp"
#include "panonav/localisation/sample.hpp"
#include "panonav/memory/floors.hpp"

namespace panonav {

namespace {

/// Number of best candidates that are grouped to places.
constexpr int sector_candidates = 12;
/// Number of best views of a place whose mean gives position and heading: the corners of a square.
constexpr std::size_t averaged_views = 4;
/// Number of views that leading features preselect, unless more matches are requested.
constexpr std::size_t preselected_views = 24;
/// Distances in spacings within which a view is the same place as the best one, and within which
/// its position is averaged.
constexpr double same_place_spacings = 2.0;
constexpr double averaged_spacings = 1.5;
/// Largest difference of the headings by two views of one place.
constexpr double same_heading_rad = radians(30.0);
constexpr std::size_t max_named_places = 3;
/// Number of candidates that estimate the tilt, and the factor by which their scores must grow:
/// chance alone reaches less among the tried tilts.
constexpr std::size_t tilt_candidates = 3;
constexpr double min_tilt_gain = 1.15;
/// Memories of fewer views are compared with mirrored views, too.
constexpr std::size_t min_background_views = 12;
/// Views that are cut for learning, and others that each is compared with.
constexpr int learnt_views = 24;
constexpr std::size_t nearest_compared = 50;
constexpr std::size_t sampled_compared = 100;

}  // namespace

double sector_place_probability(double score, double width_rad, std::size_t views) noexcept {
  if (!(score > 0.0)) return 0.0;
  // Learnt on `ciirc_b670`, `indoor_walk_360`, `lab` and `corridor` (docs/decisions.md), with 9 to
  // 117 views.
  constexpr double offset = -18.8;
  constexpr double per_log_score = 9.03;
  constexpr double per_log_width = -4.50;  // wider pictures reach larger scores by chance
  constexpr double per_log_views = -0.26;  // the largest of many scores by chance is larger
  constexpr double middle_width_rad = radians(70.0);
  constexpr double middle_views = 100.0;
  constexpr double min_views = 8.0;
  constexpr double max_views = 1000.0;
  const double log_odds =
      offset + per_log_score * std::log1p(score) +
      per_log_width * std::log(width_rad / middle_width_rad) +
      per_log_views *
          std::log(std::clamp(static_cast<double>(views), min_views, max_views) / middle_views);
  return 1.0 / (1.0 + std::exp(-log_odds));
}

SectorLocaliser::SectorLocaliser(const VisualMemory& memory, const GradientSource& features,
                                 const std::optional<SectorModel>& model)
    : memory_(&memory) {
  for (const ViewId view : memory.views()) {
    auto found = features(view);
    if (found && !found->corners.empty()) references_.push_back({view, *std::move(found)});
  }
  if (references_.empty()) {
    throw ContractError("features for narrow pictures", "missing", "in the memory");
  }
  const std::vector<std::string> floor_names = list_floors(memory);
  std::vector<Point2> points;
  std::vector<std::size_t> floors;
  for (const Reference& reference : references_) {
    const auto placed = find_position(memory.info(reference.view));
    if (!placed) continue;
    points.push_back(placed->point);
    floors.push_back(static_cast<std::size_t>(std::ranges::lower_bound(floor_names, placed->floor) -
                                              floor_names.begin()));
  }
  const std::vector<double> nearest_m = distances_between_nearest_positions(points, floors);
  if (!nearest_m.empty()) spacing_m_ = median(nearest_m);
  if (model) {
    model_ = *model;
  } else {
    learn();
  }
}

std::vector<SectorLocaliser::Ranked> SectorLocaliser::rank(
    const GradientFeatures& query, NearestFeatures::Part part, std::size_t top,
    std::span<const std::size_t> compared) const {
  NearestFeatures nearest(query, part);
  for (const std::size_t i : compared) nearest.add(references_[i].features);
  if (compared.size() < min_background_views) {
    for (const Reference& reference : references_) {
      nearest.add_background(mirror(reference.features));
    }
  }
  std::vector<std::vector<SectorPair>> pairs = nearest.weigh_pairs();
  struct Bounded {
    double bound;
    std::size_t number;
  };
  std::vector<Bounded> order;
  for (std::size_t k = 0; k < compared.size(); ++k) {
    order.push_back({bound_score(query, references_[compared[k]].features, pairs[k]), k});
  }
  std::ranges::stable_sort(order, std::greater<>(), &Bounded::bound);
  std::vector<Ranked> best;  // descending score
  for (const auto& [bound, k] : order) {
    if (best.size() == top && bound <= best.back().score) break;
    const double score =
        verify_sector(query, references_[compared[k]].features, pairs[k], true).score;
    const auto at = std::ranges::upper_bound(best, score, std::greater<>(), &Ranked::score);
    best.insert(at, {compared[k], std::move(pairs[k]), score});
    if (best.size() > top) best.pop_back();
  }
  return best;
}

std::vector<SectorLocaliser::Candidate> SectorLocaliser::find_candidates(
    const GradientFeatures& query, int top, std::span<const std::size_t> compared,
    bool has_known_tilt) const {
  const auto count = static_cast<std::size_t>(std::max(1, top));
  std::vector<std::size_t> preselected;
  for (const Ranked& view :
       rank(query, NearestFeatures::Part::leading, std::max(count, preselected_views), compared)) {
    preselected.push_back(view.reference);
  }
  std::ranges::sort(preselected);
  const std::vector<Ranked> best = rank(query, NearestFeatures::Part::all, count, preselected);
  const double roll_pitch_step = radians(2.5);
  GradientFeatures level = query;
  if (!has_known_tilt) {
    const auto sum_scores = [&](const Tilt& tilt) {
      const GradientFeatures turned = level_corners(query, tilt);
      double sum = 0.0;
      for (const Ranked& view : std::span(best).first(std::min(tilt_candidates, best.size()))) {
        sum += verify_sector(turned, references_[view.reference].features, view.pairs, true).score;
      }
      return sum;
    };
    const Tilt tilt = search_tilt(sum_scores, roll_pitch_step, min_tilt_gain);
    if (tilt != Tilt{}) level = level_corners(query, tilt);
  }
  std::vector<Candidate> candidates;
  for (const Ranked& view : best) {
    candidates.push_back(
        {view.reference, verify_sector(level, references_[view.reference].features, view.pairs)});
  }
  std::ranges::stable_sort(candidates, std::greater<>(),
                           [](const Candidate& c) { return c.match.score; });
  return candidates;
}

bool SectorLocaliser::are_near(std::size_t a, std::size_t b, double spacings) const {
  const auto here = find_position(memory_->info(references_[a].view));
  const auto there = find_position(memory_->info(references_[b].view));
  return here && there && distance(*here, *there) <= spacings * spacing_m_;
}

std::vector<SectorLocaliser::Group> SectorLocaliser::group_by_place(
    std::span<const Candidate> candidates) const {
  const auto heading = [&](const Candidate& c) {
    const auto& pose = memory_->info(references_[c.reference].view).pose;
    return pose && pose->heading_rad
               ? std::optional(wrap_angle(*pose->heading_rad + c.match.heading_rad))
               : std::nullopt;
  };
  std::vector<Group> groups;
  for (const Candidate& candidate : candidates) {
    const auto own = heading(candidate);
    const auto group = std::ranges::find_if(groups, [&](const Group& g) {
      const Candidate& first = g.candidates.front();
      const auto other = heading(first);
      return are_near(first.reference, candidate.reference, same_place_spacings) &&
             (!own || !other || std::abs(angle_difference(*own, *other)) <= same_heading_rad);
    });
    if (group == groups.end()) {
      groups.push_back({{candidate}, 0.0});
    } else {
      group->candidates.push_back(candidate);
    }
  }
  double total = 0.0;
  for (Group& group : groups) {
    group.share =
        share_of_score(group.candidates.front().match.score,
                       groups.front().candidates.front().match.score, model_.share_exponent);
    total += group.share;
  }
  for (Group& group : groups) group.share /= total;
  return groups;
}

std::optional<PositionEstimate> SectorLocaliser::average_position(const Group& group) const {
  const Candidate& best = group.candidates.front();
  if (!memory_->info(references_[best.reference].view).pose) return std::nullopt;
  PositionEstimate estimate;
  double total = 0.0;
  for (const Candidate& candidate : group.candidates) {
    if (estimate.shares.size() == averaged_views) break;
    if (candidate.reference != best.reference &&
        !are_near(best.reference, candidate.reference, averaged_spacings)) {
      continue;
    }
    const double weight = std::max(candidate.match.score * candidate.match.score, 1e-12);
    const ReferencePose& pose = *memory_->info(references_[candidate.reference].view).pose;
    estimate.x_m += weight * pose.x_m;
    estimate.y_m += weight * pose.y_m;
    total += weight;
    estimate.shares.push_back({references_[candidate.reference].view, weight});
  }
  estimate.x_m /= total;
  estimate.y_m /= total;
  for (auto& share : estimate.shares) share.weight /= total;
  return estimate;
}

std::optional<double> SectorLocaliser::average_heading(const Group& group) const {
  double x = 0.0;
  double y = 0.0;
  std::size_t used = 0;
  for (const Candidate& candidate : group.candidates) {
    const auto& pose = memory_->info(references_[candidate.reference].view).pose;
    if (!pose || !pose->heading_rad || candidate.match.score <= 0.0) continue;
    if (used++ == averaged_views) break;
    const double heading_rad = *pose->heading_rad + candidate.match.heading_rad;
    const double weight = candidate.match.score * candidate.match.score;
    x += weight * std::cos(heading_rad);
    y += weight * std::sin(heading_rad);
  }
  if (x == 0.0 && y == 0.0) return std::nullopt;
  return std::atan2(y, x);
}

std::optional<double> SectorLocaliser::radius_at(double width_rad) const {
  const auto nearest = std::ranges::min_element(
      SectorModel::widths_rad, {}, [&](double width) { return std::abs(width - width_rad); });
  return model_.radius_m[static_cast<std::size_t>(nearest - SectorModel::widths_rad.begin())];
}

PlaceMatch SectorLocaliser::describe(const Candidate& candidate, double azimuth_rad) const {
  PlaceMatch match;
  match.view = references_[candidate.reference].view;
  match.name = memory_->info(match.view).name;
  match.column_difference = std::numeric_limits<double>::quiet_NaN();  // of whole rows only
  match.verified_features = candidate.match.verified;
  if (candidate.match.score > 0.0) {
    match.heading_rad = wrap_angle(candidate.match.heading_rad - azimuth_rad);
  }
  return match;
}

Place SectorLocaliser::localise(const SectorQuery& query, int top,
                                std::span<const ViewId> excluded) const {
  std::vector<std::size_t> compared;
  for (std::size_t i = 0; i < references_.size(); ++i) {
    if (std::ranges::find(excluded, references_[i].view) == excluded.end()) compared.push_back(i);
  }
  Place place;
  place.components = memory_->shape().components;
  place.views_compared = compared.size();
  place.bytes_read = place.bytes_in_full =
      compared.size() * GradientFeatures::packed_bytes * GradientFeatures::max_count;
  if (compared.empty()) return place;
  const std::vector<Candidate> candidates = find_candidates(
      query.features, std::max(top, sector_candidates), compared, query.has_known_tilt);
  const Candidate& best = candidates.front();
  place.evidence.views = static_cast<int>(compared.size());
  place.evidence.components = place.components;
  place.evidence.features =
      PlaceEvidence::Features{.verified = best.match.verified,
                              .chance = 0,
                              .neighbour = 0,
                              .seen = static_cast<int>(query.features.corners.size())};
  place.known_probability =
      sector_place_probability(best.match.score, query.width_rad, compared.size());
  place.known = place.known_probability >= 0.5;
  place.probability = place.known_probability;
  for (const Candidate& candidate : candidates) {
    if (static_cast<int>(place.matches.size()) == top) break;
    place.matches.push_back(describe(candidate, query.azimuth_rad));
  }
  if (!place.known || spacing_m_ == 0.0) return place;

  const std::vector<Group> groups = group_by_place(
      std::span(candidates).first(std::min<std::size_t>(candidates.size(), sector_candidates)));
  const auto radius_m = radius_at(query.width_rad);
  const auto heading_of = [&](const Group& group) -> std::optional<double> {
    const auto heading = average_heading(group);
    return heading ? std::optional(wrap_angle(*heading - query.azimuth_rad)) : std::nullopt;
  };
  place.position = average_position(groups.front());
  place.heading_rad = heading_of(groups.front());
  place.probability = groups.front().share * place.known_probability;
  if (!place.position) return place;
  std::vector<OtherPlace> others;
  const auto floor = floor_of(place.matches.front().name);
  for (const Group& group : std::span(groups).subspan(1)) {
    auto position = average_position(group);
    if (!position) continue;
    position->radius_m = radius_m;
    PlaceMatch match = describe(group.candidates.front(), query.azimuth_rad);
    if (floor_of(match.name) == floor) {
      others.push_back(
          {distance(position->position(), place.position->position()) + radius_m.value_or(0.0),
           group.share});
    }
    if (group.share < min_named_share || place.alternatives.size() == max_named_places) continue;
    place.alternatives.push_back({std::move(match), group.share * place.known_probability,
                                  std::move(position), heading_of(group)});
  }
  if (radius_m) {
    place.position->radius_m =
        std::max(*radius_m, radius_over_places(*radius_m, groups.front().share, others));
  }
  return place;
}

std::vector<SectorLocaliser::Group> SectorLocaliser::find_places_of_cut(std::size_t reference,
                                                                        std::size_t width,
                                                                        std::uint64_t seed) const {
  Random random(seed, references_[reference].view.value);
  const double middle_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
  const double width_rad = SectorModel::widths_rad[width];
  // A picture of 4:3, less what its corners' neighbourhoods take.
  constexpr double margin_rad = radians(3.0);
  const double half_height_rad = std::atan(0.75 * std::tan(0.5 * width_rad)) - margin_rad;
  const GradientFeatures cut =
      cut_sector(references_[reference].features, middle_rad, width_rad - 2.0 * margin_rad,
                 {-half_height_rad, half_height_rad});
  std::vector<std::size_t> compared;
  std::vector<std::pair<double, std::size_t>> near;
  const auto here = find_position(memory_->info(references_[reference].view));
  for (std::size_t i = 0; i < references_.size(); ++i) {
    if (i == reference) continue;
    const auto there = find_position(memory_->info(references_[i].view));
    const double apart = here && there
                             ? distance(*here, *there)
                             : std::abs(static_cast<double>(i) - static_cast<double>(reference));
    if (here && there && apart == 0.0) continue;  // a standing robot takes the same view repeatedly
    near.emplace_back(apart, i);
  }
  std::ranges::sort(near);
  for (std::size_t k = 0; k < near.size(); ++k) {
    if (k >= nearest_compared && near.size() > nearest_compared + sampled_compared &&
        random.uniform(0.0, 1.0) * static_cast<double>(near.size()) > sampled_compared) {
      continue;
    }
    compared.push_back(near[k].second);
  }
  if (compared.empty() || cut.corners.size() < 2) return {};
  return group_by_place(find_candidates(cut, sector_candidates, compared, true));
}

void SectorLocaliser::learn() {
  if (references_.size() < static_cast<std::size_t>(SectorModel::min_views)) return;
  if (spacing_m_ == 0.0) return;
  std::vector<ViewId> views;
  for (const Reference& reference : references_) views.push_back(reference.view);
  std::vector<ShareCase> shares;
  for (std::size_t width = 0; width < SectorModel::width_count; ++width) {
    std::vector<double> errors_m;
    for (const ViewId view : sample_views(views, learnt_views, 1)) {
      const auto reference =
          static_cast<std::size_t>(std::ranges::lower_bound(views, view) - views.begin());
      const auto truth = find_position(memory_->info(view));
      if (!truth) continue;
      ShareCase share;
      for (const Group& group : find_places_of_cut(reference, width, width + 1)) {
        const auto found = average_position(group);
        const auto there =
            find_position(memory_->info(references_[group.candidates.front().reference].view));
        const bool is_right = there && distance(*there, *truth) <= same_place_spacings * spacing_m_;
        share.scores.push_back(group.candidates.front().match.score);
        if (!is_right || share.right) continue;
        share.right = share.scores.size() - 1;
        if (found) errors_m.push_back(distance(found->position(), truth->point));
      }
      if (share.right) shares.push_back(std::move(share));
    }
    constexpr std::size_t min_errors = 6;
    if (errors_m.size() >= min_errors) model_.radius_m[width] = quantile(errors_m, 0.95);
  }
  if (shares.size() >= static_cast<std::size_t>(SectorModel::min_views)) {
    model_.share_exponent = fit_share_exponent(shares);
  }
  model_.learnt = true;
}

}  // namespace panonav
