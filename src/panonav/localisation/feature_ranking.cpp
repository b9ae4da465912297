#include "panonav/localisation/feature_ranking.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "panonav/localisation/place_model.hpp"
#include "panonav/localisation/sample.hpp"
#include "panonav/memory/floors.hpp"

namespace panonav {

namespace {

// Returns the index of the match that `rank_by_verified_features` puts first. Ends each comparison
// as soon as it cannot change the result.
std::size_t find_most_verified(const LocalFeatures& query, const FeatureSource& features,
                               std::span<const RankedMatch> ranked) {
  std::size_t found = 0;
  int max_verified = 0;
  for (std::size_t i = 0; i < std::min<std::size_t>(verified_candidates, ranked.size()); ++i) {
    const auto there = features(ranked[i].match.view);
    if (!there) continue;
    const int verified = match_features(query, *there, max_verified).verified;
    if (verified <= max_verified) continue;
    max_verified = verified;
    found = i;
  }
  return found;
}

}  // namespace

void rank_by_verified_features(const LocalFeatures& query, const FeatureSource& features,
                               std::vector<RankedMatch>& ranked) {
  const auto end = ranked.begin() + static_cast<std::ptrdiff_t>(
                                        std::min<std::size_t>(verified_candidates, ranked.size()));
  for (auto match = ranked.begin(); match != end; ++match) {
    const auto there = features(match->match.view);
    const LocalFeatures::Match found =
        there ? match_features(query, *there) : LocalFeatures::Match{};
    match->verified_features = found.verified;
    if (found.verified > 0) match->columns.heading_rad = found.heading_rad;
  }
  std::stable_sort(ranked.begin(), end, [](const RankedMatch& a, const RankedMatch& b) {
    return *a.verified_features > *b.verified_features;
  });
}

bool FeatureTrial::is_significantly_better() const {
  const int changed = gained + lost;
  // Computes the probability of at least `gained` successes in `changed` trials of probability 1/2.
  double coefficient = 1.0;  // of `changed` over i
  double sum = 0.0;
  for (int i = 0; i <= changed; ++i) {
    if (i >= gained) sum += coefficient;
    coefficient *= static_cast<double>(changed - i) / (i + 1);
  }
  return changed > 0 && sum * std::pow(0.5, changed) <= 0.05;
}

namespace {

/// The best match of each view of a memory by columns, and by local features, when it is left out.
class LeftOutMatches {
 public:
  LeftOutMatches(const ColumnRanking& ranking, const NeighbourSupport& support,
                 const FeatureSource& features)
      : ranking_(&ranking), support_(&support), features_(&features) {
    for (const ViewId view : ranking.memory().views())
      positions_.push_back(find_position(ranking.memory().info(view)));
  }

  struct Best {
    ViewId by_columns;
    ViewId by_features;
  };

  /// Returns the best matches without views at the same position, because a standing robot takes
  /// the same view repeatedly; nullopt for a view without features or without other views.
  [[nodiscard]] std::optional<Best> find(ViewId view) const {
    const auto own = (*features_)(view);
    if (!own) return std::nullopt;
    const VisualMemory& memory = ranking_->memory();
    const auto views = memory.views();
    const auto position = find_position(memory.info(view));
    std::vector<ViewId> excluded;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (views[i] == view || (position && positions_[i] == position)) excluded.push_back(views[i]);
    }
    const PackedSignature query = memory.packed(view);
    const auto found = memory.search(
        query, {.top = verified_candidates, .components = ranking_->components()}, {excluded, {}});
    std::vector<RankedMatch> ranked = ranking_->rank(query, found.matches);
    if (ranked.empty()) return std::nullopt;
    support_->rank_by_support(ColumnProfiles(query, ranking_->components()), ranked, excluded);
    return Best{ranked.front().match.view,
                ranked[find_most_verified(*own, *features_, ranked)].match.view};
  }

  /// Returns the distance from a view to the nearest one at another position. All views must have
  /// positions.
  [[nodiscard]] double distance_to_nearest(ViewId view) const {
    const FloorPosition here = *find_position(ranking_->memory().info(view));
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& other : positions_) {
      if (std::abs(other->point.x_m - here.point.x_m) > nearest) continue;  // quick
      const double distance_m = distance(*other, here);
      if (distance_m > 0.0) nearest = std::min(nearest, distance_m);
    }
    return nearest;
  }

 private:
  const ColumnRanking* ranking_;
  const NeighbourSupport* support_;
  const FeatureSource* features_;
  std::vector<std::optional<FloorPosition>> positions_;  // positions of all views
};

}  // namespace

FeatureTrial evaluate_features(const ColumnRanking& ranking, const NeighbourSupport& support,
                               const FeatureSource& features) {
  constexpr int max_sampled = 100;  // takes 0.3 s; five gains without a loss are significant
  // Largest ratio of a right match's distance to that of the nearest view: a grid's diagonal.
  constexpr double right_ratio = 1.5;
  const VisualMemory& memory = ranking.memory();
  const std::span<const ViewId> views = memory.views();
  FeatureTrial trial;
  if (views.size() < static_cast<std::size_t>(PlaceModel::min_views)) return trial;
  const bool posed =
      std::ranges::all_of(views, [&](ViewId view) { return memory.info(view).pose.has_value(); });
  const LeftOutMatches matches(ranking, support, features);
  for (const ViewId view : sample_views(views, max_sampled, 1)) {
    const auto best = matches.find(view);
    if (!best) continue;
    const double nearest = posed ? matches.distance_to_nearest(view) : 0.0;
    const auto is_right = [&](ViewId match, ViewId LeftOutMatches::Best::*kind) {
      if (posed) {
        return distance(*find_position(memory.info(match)), *find_position(memory.info(view))) <=
               right_ratio * nearest;
      }
      const auto back = matches.find(match);
      return back && (*back).*kind == view;
    };
    const bool by_columns = is_right(best->by_columns, &LeftOutMatches::Best::by_columns);
    const bool by_features = is_right(best->by_features, &LeftOutMatches::Best::by_features);
    ++trial.sampled_views;
    trial.columns_right += by_columns ? 1 : 0;
    trial.features_right += by_features ? 1 : 0;
    trial.gained += by_features && !by_columns ? 1 : 0;
    trial.lost += by_columns && !by_features ? 1 : 0;
  }
  return trial;
}

}  // namespace panonav
