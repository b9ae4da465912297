#include "panonav/localisation/column_ranking.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

double RankedMatch::score_with(double difference) const {
  // Keeps both factors above 0 if two views have equal columns or equal brightness.
  constexpr double min_factor = 1e-6;
  constexpr double dissimilarity_exponent = 0.125;  // chosen on recordings (docs/decisions.md)
  return (difference + min_factor) *
         std::pow(match.dissimilarity + min_factor, dissimilarity_exponent);
}

ColumnRanking::ColumnRanking(const VisualMemory& memory, int components, int max_cached_views)
    : memory_(&memory), components_(components) {
  require(components >= 0 && components <= memory.shape().components, "components", components,
          "0 (all) or 1 .. " + to_text(memory.shape().components));
  if (memory.size() > static_cast<std::size_t>(max_cached_views)) return;
  cached_views_.assign(memory.views().begin(), memory.views().end());
  cached_profiles_.reserve(cached_views_.size());
  for (const ViewId view : cached_views_)
    cached_profiles_.emplace_back(memory.packed(view), components);
}

const ColumnProfiles* ColumnRanking::find_cached(ViewId view) const {
  const auto at = std::ranges::lower_bound(cached_views_, view);
  if (at == cached_views_.end() || *at != view) return nullptr;
  return &cached_profiles_[static_cast<std::size_t>(at - cached_views_.begin())];
}

ColumnProfiles ColumnRanking::profiles(ViewId view) const {
  if (const ColumnProfiles* const found = find_cached(view)) return *found;
  return ColumnProfiles(memory_->packed(view), components_);
}

std::vector<RankedMatch> ColumnRanking::rank(const PackedSignature& query,
                                             std::span<const Match> matches,
                                             std::span<const std::uint8_t> allowed_rows) const {
  const ColumnProfiles query_profiles(query, components_, allowed_rows);
  std::vector<RankedMatch> ranked;
  ranked.reserve(matches.size());
  for (const Match& match : matches) {
    // Cached profiles cover all rows.
    const ColumnProfiles* const found = allowed_rows.empty() ? find_cached(match.view) : nullptr;
    const ColumnMatch columns =
        found != nullptr ? match_columns(query_profiles, *found)
                         : match_columns(query_profiles, ColumnProfiles(memory_->packed(match.view),
                                                                        components_, allowed_rows));
    ranked.push_back({match, columns});
  }
  std::ranges::sort(ranked, {},
                    [](const RankedMatch& r) { return std::pair(r.score(), r.match.view); });
  return ranked;
}

}  // namespace panonav
