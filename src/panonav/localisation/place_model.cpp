#include "panonav/localisation/place_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/localisation/sample.hpp"
#include "panonav/memory/floors.hpp"

namespace panonav {

namespace {

// Mirrors a view left to right: I'(phi) = I(-phi), so psi' = -psi.
PackedSignature mirror(PackedSignature signature) {
  for (std::uint8_t& phase : signature.phases) phase = static_cast<std::uint8_t>(-phase);
  return signature;
}

// Returns the nearest view taken at another position. Views at the same position are ignored, as a
// standing robot takes the same view repeatedly.
std::optional<ViewId> find_nearest_in_space(const VisualMemory& memory, ViewId view) {
  const auto position = find_position(memory.info(view));
  if (!position) return std::nullopt;
  std::optional<ViewId> nearest;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const ViewId other : memory.views()) {
    const ReferenceInfo& info = memory.info(other);
    if (!info.pose || std::abs(info.pose->x_m - position->point.x_m) > nearest_m)
      continue;  // quick
    const auto there = find_position(info);
    const double distance_m = distance(*there, *position);
    if (distance_m > 0.0 && distance_m < nearest_m) {
      nearest_m = distance_m;
      nearest = other;
    }
  }
  return nearest;
}

/// Number of sampled views compared with the mirrored query: enough to estimate the standard
/// deviation of the differences to 9 %.
constexpr std::size_t chance_view_count = 64;
/// Number of spare sampled views, which replace excluded ones. All 80 column profiles take 0.2 MB.
constexpr std::size_t spare_view_count = 16;
/// Number of views whose local features are compared for chance and for neighbours, 0.1 ms each.
constexpr std::size_t feature_view_count = 12;
/// Number of best matches that are compared by the better half of their columns to find the best
/// and the tenth best.
constexpr std::size_t examined_match_count = 16;
/// Distance of a Gaussian's 10 % quantile from its mean, in standard deviations.
constexpr double decile_deviations = 1.2816;

// Returns the mean difference over the half of the columns that agree best, at the rotation
// `heading_rad`.
double better_half_difference(const ColumnProfiles& query, const ColumnProfiles& reference,
                              double heading_rad) {
  auto columns = column_distances_at_heading(query, reference, heading_rad);
  const auto half = columns.begin() + columns.size() / 2;
  std::ranges::nth_element(columns, half);
  return std::accumulate(columns.begin(), half, 0.0,
                         [](double sum, double column) { return sum + std::sqrt(column); }) /
         static_cast<double>(half - columns.begin());
}

// Returns the tenth smallest difference; the largest one if there are fewer than ten.
double tenth_smallest(std::vector<double> differences) {
  std::ranges::sort(differences);
  return differences[std::min<std::size_t>(10, differences.size()) - 1];
}

double log_odds_by_columns(const PlaceEvidence& evidence) {
  // Learnt by `bench/place_probability` (docs/decisions.md), in the order of `column_terms`.
  constexpr std::array<double, column_term_count> learnt{-1.58, -16.46, -9.30, -0.60, -6.43, 0.91};
  const auto features = column_terms(evidence);
  return std::inner_product(learnt.begin(), learnt.end(), features.begin(), 0.0);
}

double log_ratio(int verified, int reference) {
  return std::log((1.0 + verified) / (1.0 + reference));
}

}  // namespace

std::vector<ViewId> sample_reference_views(std::span<const ViewId> views) {
  std::vector<std::pair<std::uint64_t, ViewId>> drawn;  // a heap, largest random number first
  for (const ViewId view : views) {
    const std::pair number(Random(1, view.value).next(), view);
    if (drawn.size() == chance_view_count + spare_view_count) {
      if (!(number < drawn.front())) continue;
      std::ranges::pop_heap(drawn);
      drawn.pop_back();
    }
    drawn.push_back(number);
    std::ranges::push_heap(drawn);
  }
  std::ranges::sort_heap(drawn);
  std::vector<ViewId> sample;
  for (const auto& [number, view] : drawn) sample.push_back(view);
  return sample;
}

PlaceModel learn_place_model(const ColumnRanking& ranking, const LearningOptions& options) {
  validate(options);
  const VisualMemory& memory = ranking.memory();
  PlaceModel model;
  const auto seed = static_cast<std::uint64_t>(options.seed);
  const std::vector<ViewId> sample = sample_views(memory.views(), options.sampled_views, seed);
  model.sampled_views = static_cast<int>(sample.size());
  if (memory.size() < static_cast<std::size_t>(PlaceModel::min_views)) return model;

  const std::vector<ViewId> compared =
      sample_views(memory.views(), options.compared_views, seed + 1);
  std::vector<std::shared_ptr<const ColumnProfiles>> references;
  references.reserve(compared.size());
  for (const ViewId view : compared) references.push_back(ranking.profiles(view));

  std::vector<double> between;
  std::vector<double> nearest;
  std::vector<double> nearest_of_mirrored;
  std::vector<double> nearest_view_differences;
  for (const ViewId view : sample) {
    const std::shared_ptr<const ColumnProfiles> own = ranking.profiles(view);
    const ColumnProfiles reversed(mirror(memory.packed(view)), ranking.components());
    double best = std::numeric_limits<double>::infinity();
    double best_of_mirrored = best;
    for (std::size_t i = 0; i < compared.size(); ++i) {
      best_of_mirrored =
          std::min(best_of_mirrored, match_columns(reversed, *references[i]).difference);
      if (compared[i] == view) continue;
      between.push_back(match_columns(*own, *references[i]).difference);
      best = std::min(best, between.back());
    }
    nearest.push_back(best);
    if (const auto neighbour = find_nearest_in_space(memory, view)) {
      nearest_view_differences.push_back(
          match_columns(*own, *ranking.profiles(*neighbour)).difference);
    }
    nearest_of_mirrored.push_back(best_of_mirrored);
  }
  model.neighbouring_difference = quantile(nearest, 0.5);
  model.arbitrary_difference = quantile(between, 0.5);
  model.mirrored_difference = quantile(nearest_of_mirrored, 0.5);
  double min_threshold = std::min(PlaceModel::related_share * model.arbitrary_difference,
                                  PlaceModel::unrelated_difference);
  if (nearest_view_differences.size() >= static_cast<std::size_t>(PlaceModel::min_views)) {
    model.nearest_view_difference = quantile(nearest_view_differences, 0.9);
    min_threshold = std::min(min_threshold, *model.nearest_view_difference);
  }
  model.threshold =
      std::max(0.5 * (model.neighbouring_difference + model.mirrored_difference), min_threshold);
  model.learnt = true;
  return model;
}

std::array<double, column_term_count> column_terms(const PlaceEvidence& evidence) noexcept {
  // Limits of the ranges used by `bench/place_probability` for learning. Below `min_difference`
  // rounding dominates; up to `large_difference` the difference over all columns is no evidence.
  constexpr double min_difference = 0.02;
  constexpr double large_difference = 0.5;
  constexpr int min_views = 8;
  constexpr int max_views = 1000;
  constexpr int max_components = 15;
  const double difference = std::max(evidence.difference, min_difference);
  return {
      1.0,
      std::log(difference / std::max(evidence.chance, min_difference)),
      std::log(difference / std::max(evidence.tenth_best_difference, min_difference)),
      std::log(std::clamp(evidence.views, min_views, max_views)),
      std::log(std::max(evidence.difference_of_all_columns, large_difference) / large_difference),
      std::log(std::clamp(evidence.components, 1, max_components) / double{max_components})};
}

double place_probability(const PlaceEvidence& evidence) noexcept {
  if (evidence.views < 1 || !(evidence.chance > 0.0)) return 0.0;
  const double by_columns = 1.0 / (1.0 + std::exp(-log_odds_by_columns(evidence)));
  if (!evidence.features || !is_inconclusive(evidence)) return by_columns;
  // Learnt by `bench/place_probability` (docs/decisions.md), in the order of `feature_terms`.
  constexpr std::array<double, feature_term_count> learnt{-2.99, 0.23, 3.10, 1.53};
  const PlaceEvidence::Features& found = *evidence.features;
  if (learnt[0] + learnt[2] * log_ratio(found.seen, found.chance) <= 0.0) return by_columns;
  const auto features = feature_terms(evidence);
  const double z = std::inner_product(learnt.begin(), learnt.end(), features.begin(), 0.0);
  return 1.0 / (1.0 + std::exp(-z));
}

bool is_inconclusive(const PlaceEvidence& evidence) noexcept {
  if (evidence.views < 1 || !(evidence.chance > 0.0)) return false;
  static const double max_inconclusive_log_odds =
      std::log(min_certain_probability / (1.0 - min_certain_probability));
  return std::abs(log_odds_by_columns(evidence)) < max_inconclusive_log_odds;
}

std::array<double, feature_term_count> feature_terms(const PlaceEvidence& evidence) noexcept {
  const PlaceEvidence::Features found = evidence.features.value_or(PlaceEvidence::Features{});
  return {1.0, log_odds_by_columns(evidence), log_ratio(found.verified, found.chance),
          log_ratio(found.verified, found.neighbour)};
}

PlaceCriterion::PlaceCriterion(const ColumnRanking& ranking, std::size_t views)
    : ranking_(&ranking),
      views_(static_cast<int>(std::min<std::size_t>(views, std::numeric_limits<int>::max()))),
      sample_(sample_reference_views(ranking.memory().views())) {
  for (const ViewId view : sample_) profiles_.push_back(profiles(view, {}));
}

PlaceCriterion::PlaceCriterion(const ColumnRanking& ranking, const PlaceCriterion& sampled)
    : ranking_(&ranking), views_(sampled.views_), sample_(sampled.sample_) {
  for (const ViewId view : sample_) profiles_.push_back(profiles(view, {}));
}

PlaceCriterion::PlaceCriterion(const ViewSource& source)
    : views_(static_cast<int>(source.views().size())),
      sample_(sample_reference_views(source.views())) {
  std::vector<ViewId> ascending = sample_;
  std::ranges::sort(ascending);
  const VisualMemory loaded = source.load(ascending);
  for (const ViewId view : sample_)
    profiles_.push_back(std::make_shared<const ColumnProfiles>(loaded.packed(view)));
}

std::shared_ptr<const ColumnProfiles> PlaceCriterion::profiles(
    ViewId view, std::span<const std::uint8_t> allowed_rows) const {
  return ranking_->components() == 0 && allowed_rows.empty()
             ? ranking_->profiles(view)
             : std::make_shared<const ColumnProfiles>(ranking_->memory().packed(view), 0,
                                                      allowed_rows);
}

double PlaceCriterion::max_chance_difference(const PackedSignature& query,
                                             const ColumnProfiles& query_profiles,
                                             const SearchMask& mask) const {
  // An image without structure matches any other image without structure, so it gives no evidence.
  const auto is_flat = [](std::uint8_t value) { return value == 128; };
  if (std::ranges::all_of(query_profiles.values(), is_flat)) return 0.0;
  const ColumnProfiles elsewhere(mirror(query), 0, mask.allowed_rows);
  std::vector<double> by_chance;
  for (std::size_t i = 0; i < sample_.size() && by_chance.size() < chance_view_count; ++i) {
    if (std::ranges::find(mask.excluded_views, sample_[i]) != mask.excluded_views.end()) continue;
    const auto reference =
        mask.allowed_rows.empty() ? profiles_[i] : profiles(sample_[i], mask.allowed_rows);
    by_chance.push_back(better_half_difference(elsewhere, *reference,
                                               match_columns(elsewhere, *reference).heading_rad));
  }
  if (by_chance.empty()) return PlaceEvidence{}.chance;
  const double middle = mean(by_chance);
  double variance = 0.0;
  for (const double value : by_chance) variance += (value - middle) * (value - middle);
  variance /= static_cast<double>(std::max<std::size_t>(1, by_chance.size() - 1));
  return std::max(0.0, middle - decile_deviations * std::sqrt(variance));
}

PlaceEvidence PlaceCriterion::evidence(const PackedSignature& query,
                                       std::span<const RankedMatch> matches,
                                       const SearchMask& mask) const {
  const VisualMemory& memory = ranking_->memory();
  PlaceEvidence found{.components = memory.shape().components};
  if (matches.empty()) return found;
  found.views = (views_ > 0 ? views_ : static_cast<int>(memory.size())) -
                static_cast<int>(std::ranges::count_if(
                    mask.excluded_views, [&](ViewId view) { return memory.contains(view); }));
  std::vector<const RankedMatch*> best(matches.size());
  std::ranges::transform(matches, best.begin(), [](const RankedMatch& match) { return &match; });
  const auto end =
      best.begin() + static_cast<std::ptrdiff_t>(std::min(examined_match_count, best.size()));
  std::ranges::partial_sort(best.begin(), end, best.end(), {}, [](const RankedMatch* match) {
    return std::pair(match->columns.difference, match->match.view);
  });
  const ColumnProfiles query_profiles(query, 0, mask.allowed_rows);
  std::vector<double> differences;
  for (auto match = best.begin(); match != end; ++match) {
    const auto reference = profiles((*match)->match.view, mask.allowed_rows);
    const ColumnMatch turned = match_columns(query_profiles, *reference);
    found.difference_of_all_columns = std::min(found.difference_of_all_columns, turned.difference);
    differences.push_back(better_half_difference(query_profiles, *reference, turned.heading_rad));
  }
  found.difference = *std::ranges::min_element(differences);
  found.tenth_best_difference = tenth_smallest(std::move(differences));
  found.chance = max_chance_difference(query, query_profiles, mask);
  return found;
}

std::optional<PlaceEvidence::Features> PlaceCriterion::feature_evidence(
    const LocalFeatures& query, const LocalFeatures& mirrored_query, const FeatureSource& features,
    std::span<const RankedMatch> matches, const SearchMask& mask) const {
  if (query.features.empty() || matches.empty() || !features(matches.front().match.view)) {
    return std::nullopt;
  }
  std::vector<int> by_chance;
  for (const ViewId view : sample_) {
    if (std::ranges::find(mask.excluded_views, view) != mask.excluded_views.end()) continue;
    const auto there = features(view);
    if (!there) continue;
    by_chance.push_back(match_features(mirrored_query, *there).verified);
    if (by_chance.size() == feature_view_count) break;
  }
  if (by_chance.empty()) return std::nullopt;
  PlaceEvidence::Features found{.chance = upper_median(std::move(by_chance)),
                                .seen = static_cast<int>(query.features.size())};
  std::vector<LocalFeatures> candidates;
  std::size_t best = 0;
  for (const RankedMatch& match :
       matches.first(std::min<std::size_t>(verified_candidates, matches.size()))) {
    auto there = features(match.match.view);
    if (!there) continue;
    const int verified = match.verified_features
                             ? *match.verified_features
                             : match_features(query, *there, found.verified).verified;
    if (verified > found.verified) best = candidates.size();
    found.verified = std::max(found.verified, verified);
    candidates.push_back(std::move(*there));
  }
  // A memory of one view has no neighbours.
  if (candidates.size() < 2) found.neighbour = found.verified;
  for (std::size_t i = 0; i < std::min(candidates.size(), feature_view_count + 1); ++i) {
    if (i == best) continue;
    const int shared = match_features(candidates[best], candidates[i], found.neighbour).verified;
    found.neighbour = std::max(found.neighbour, shared);
  }
  return found;
}

PlaceEvidence PlaceCriterion::evidence_for_first(
    const PackedSignature& query, std::span<const PackedSignature> candidates) const {
  PlaceEvidence found{.components = query.shape.components};
  if (candidates.empty()) return found;
  found.views = views_;
  const ColumnProfiles query_profiles(query);
  std::vector<double> differences;
  for (const PackedSignature& candidate : candidates) {
    const ColumnProfiles reference(candidate);
    const ColumnMatch turned = match_columns(query_profiles, reference);
    if (differences.empty()) found.difference_of_all_columns = std::min(1.0, turned.difference);
    differences.push_back(better_half_difference(query_profiles, reference, turned.heading_rad));
  }
  found.difference = differences.front();
  found.tenth_best_difference = tenth_smallest(std::move(differences));
  found.chance = max_chance_difference(query, query_profiles, {});
  return found;
}

}  // namespace panonav
