#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "panonav/signature/column_profiles.hpp"

namespace panonav {

class ProfileCache;

/// A view that the search found, compared column by column.
struct RankedMatch {
  Match match;          ///< found by the search, with its dissimilarity
  ColumnMatch columns;  ///< comparison at the rotation that fits best
  /// Number of shared local features (`rank_by_verified_features`); nullopt if none were compared.
  std::optional<int> verified_features = std::nullopt;

  /// Returns the re-ranking score; the lowest is the best. It is the difference of the columns
  /// times the dissimilarity to the power of 1/8. The dissimilarity accounts for brightness, which
  /// the columns ignore. An occlusion raises the dissimilarities to all references by similar
  /// amounts, so it hardly changes their order.
  [[nodiscard]] double score() const { return score_with(columns.difference); }
  /// Returns the score for another difference of the columns than the stored one.
  [[nodiscard]] double score_with(double difference) const;
};

/// Re-ranks the matches of a search by comparing views column by column. The search compares
/// magnitudes only, and an occlusion changes all of them. Columns separate occluded parts from
/// visible ones, and they also depend on the phases.
class ColumnRanking {
 public:
  /// Largest number of column profiles that are cached by default: 34 MB.
  static constexpr std::size_t default_max_cached_profiles = 12'500;

  /// Caches the column profiles of the views that were compared last, at most
  /// `max_cached_profiles` (2.7 kB each); the results do not depend on it. `components`: number of
  /// Fourier components compared; 0: all. The memory must outlive *this. Throws ContractError if
  /// the memory has fewer components.
  explicit ColumnRanking(const VisualMemory& memory, int components = 0,
                         std::size_t max_cached_profiles = default_max_cached_profiles);
  /// Compares queries with the views as a camera out of focus sees them. `blur_rad`: deviation of
  /// the Gaussian; 0: sharp views. The elevations of a memory that is blurred must be known.
  ColumnRanking(const VisualMemory& memory, double blur_rad, std::size_t max_cached_profiles);
  ~ColumnRanking();
  ColumnRanking(const ColumnRanking&) = delete;
  ColumnRanking& operator=(const ColumnRanking&) = delete;

  /// Returns the matches, ascending by score, then by view. `allowed_rows`: see SearchMask. Several
  /// threads may rank concurrently. Cost: 1 microsecond for a match with cached profiles, about 4
  /// microseconds for others.
  [[nodiscard]] std::vector<RankedMatch> rank(
      const PackedSignature& query, std::span<const Match> matches,
      std::span<const std::uint8_t> allowed_rows = {}) const;

  /// Returns the column profiles of a view of the memory, over all rows.
  [[nodiscard]] std::shared_ptr<const ColumnProfiles> profiles(ViewId view) const;
  /// Returns the number of cached column profiles.
  [[nodiscard]] std::size_t cached_profiles() const;
  /// Returns the memory whose views are compared.
  [[nodiscard]] const VisualMemory& memory() const noexcept { return *memory_; }
  /// Number of components compared; 0: all.
  [[nodiscard]] int components() const noexcept { return components_; }

 private:
  const VisualMemory* memory_;
  int components_;
  std::optional<ProfileBlur> blur_;  // nullopt: sharp views
  std::unique_ptr<ProfileCache> cache_;
};

}  // namespace panonav
