#include "panonav/localisation/column_ranking.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/localisation/internal/profile_cache.hpp"

namespace panonav {

double RankedMatch::score_with(double difference) const {
  // Keeps both factors above 0 if two views have equal columns or equal brightness.
  constexpr double min_factor = 1e-6;
  constexpr double dissimilarity_exponent = 0.125;  // chosen on recordings (docs/decisions.md)
  return (difference + min_factor) *
         std::pow(match.dissimilarity + min_factor, dissimilarity_exponent);
}

ColumnRanking::ColumnRanking(const VisualMemory& memory, int components,
                             std::size_t max_cached_profiles)
    : memory_(&memory),
      components_(components),
      cache_(std::make_unique<ProfileCache>(max_cached_profiles)) {
  require(components >= 0 && components <= memory.shape().components, "components", components,
          "0 (all) or 1 .. " + to_text(memory.shape().components));
}

ColumnRanking::ColumnRanking(const VisualMemory& memory, double blur_rad,
                             std::size_t max_cached_profiles)
    : ColumnRanking(memory, 0, max_cached_profiles) {
  if (blur_rad > 0.0) blur_.emplace(memory.shape().rows, memory.elevations().value(), blur_rad);
}

ColumnRanking::~ColumnRanking() = default;

std::shared_ptr<const ColumnProfiles> ColumnRanking::profiles(ViewId view) const {
  if (auto found = cache_->find(view)) return found;
  auto made = blur_ ? std::make_shared<const ColumnProfiles>(memory_->packed(view), *blur_)
                    : std::make_shared<const ColumnProfiles>(memory_->packed(view), components_);
  cache_->insert(view, made);
  return made;
}

std::size_t ColumnRanking::cached_profiles() const {
  return cache_->size();
}

std::vector<RankedMatch> ColumnRanking::rank(const PackedSignature& query,
                                             std::span<const Match> matches,
                                             std::span<const std::uint8_t> allowed_rows) const {
  const ColumnProfiles query_profiles(query, components_, allowed_rows);
  std::vector<std::pair<double, RankedMatch>> scored;
  scored.reserve(matches.size());
  for (const Match& match : matches) {
    // Cached profiles cover all rows.
    const ColumnMatch columns =
        allowed_rows.empty()
            ? match_columns(query_profiles, *profiles(match.view))
            : match_columns(query_profiles,
                            ColumnProfiles(memory_->packed(match.view), components_, allowed_rows));
    const RankedMatch ranked{match, columns};
    scored.emplace_back(ranked.score(), ranked);
  }
  std::ranges::sort(scored, {}, [](const std::pair<double, RankedMatch>& scored_match) {
    return std::pair(scored_match.first, scored_match.second.match.view);
  });
  std::vector<RankedMatch> ranked;
  ranked.reserve(scored.size());
  for (const auto& [score, match] : scored) ranked.push_back(match);
  return ranked;
}

}  // namespace panonav
