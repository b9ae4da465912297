#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/memory/visual_memory.hpp"
#include "panonav/signature/column_profiles.hpp"

namespace panonav {

/// A view that the search found, compared column by column.
struct RankedMatch {
  Match match;          ///< as the search found it, by dissimilarity
  ColumnMatch columns;  ///< at the rotation at which the columns differ least
  /// Shared local features (`rank_by_verified_features`); nullopt where none were compared.
  std::optional<int> verified_features = std::nullopt;

  /// The re-ranking score; the minimum is the best. It is mainly that of the columns. The
  /// dissimilarity, with exponent 1/8, adds the brightness, which columns are freed of. An
  /// occlusion raises the dissimilarity to all references, so that its influence falls by itself.
  [[nodiscard]] double score() const { return score_with(columns.difference); }
  /// The score with another difference of the columns.
  [[nodiscard]] double score_with(double difference) const;
};

/// Re-ranking: orders the matches of the search by a comparison column by column. The search
/// compares magnitudes only, all of which change when a part of the view is occluded; columns
/// separate occluded parts from others and use the phases too.
class ColumnRanking {
 public:
  /// Keeps the column profiles of all views of a memory of at most `max_kept` views, 2.5 kB each;
  /// those of other views are made again for each query. The memory must outlive *this.
  /// `components`: compared, 0 for all. Throws ContractError on more than the memory's.
  explicit ColumnRanking(const VisualMemory& memory, int components = 0, int max_kept = 1000);

  /// Returns the matches ascending (score, view). `allowed_rows` as in SearchMask. Cost: 1
  /// microsecond a match whose profiles are kept, about 10 for others.
  [[nodiscard]] std::vector<RankedMatch> rank(
      const PackedSignature& query, std::span<const Match> matches,
      std::span<const std::uint8_t> allowed_rows = {}) const;

  /// The profiles of one view of the memory, over all rows.
  [[nodiscard]] ColumnProfiles profiles(ViewId view) const;
  /// The memory of the compared views.
  [[nodiscard]] const VisualMemory& memory() const noexcept { return *memory_; }
  /// Number of components compared; 0: all.
  [[nodiscard]] int components() const noexcept { return components_; }

 private:
  /// Null for a view whose profiles are not kept.
  [[nodiscard]] const ColumnProfiles* find_kept(ViewId view) const;

  const VisualMemory* memory_;
  int components_;
  std::vector<ViewId> kept_views_;  // ascending, as `kept_`
  std::vector<ColumnProfiles> kept_;
};

}  // namespace panonav
