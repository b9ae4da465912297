#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/feature_ranking.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/localisation/sample.hpp"
#include "panonav/memory/view_source.hpp"

namespace panonav {

/// Distribution of the differences of views of one memory (`ColumnMatch`), learnt from it: above
/// which difference the nearest views do not explain a query (`neighbouring`), and up to which a
/// view counts as explained when nothing else is known of it (`threshold`). Plain numbers, to be
/// stored with the memory.
struct PlaceModel {
  /// Places that have nothing in common differ by at least this in scenes of all kinds
  /// (docs/decisions.md): the threshold is never above it.
  static constexpr double unrelated_difference = 0.58;
  /// The threshold of a memory that is too small to learn from.
  static constexpr double unlearnt_threshold = 0.5;
  /// Share of the difference between arbitrary views of the memory below which two views begin to
  /// have something in common.
  static constexpr double related_share = 0.88;
  /// Smallest number of views to learn from.
  static constexpr int min_views = 8;

  double threshold = unlearnt_threshold;  ///< largest difference that counts as explained
  bool learnt = false;                    ///< false: fewer than `min_views` views
  int sampled_views = 0;                  ///< from which it was learnt
  double neighbouring = 0.0;  ///< median difference of a view to the most similar one of all others
  double arbitrary = 0.0;     ///< median difference between two views
  double mirrored = 0.0;      ///< median difference of a mirrored view to the most similar one
  /// Difference that nine of ten views have at most to the nearest one; nullopt if fewer than
  /// `min_views` of the sampled views have a position.
  std::optional<double> beside;
  friend bool operator==(const PlaceModel&, const PlaceModel&) = default;
};

/// Learns the model from the memory itself; no other scene and no label is needed.
///
/// A view mirrored left to right shows a place that does not exist: the difference that its best
/// match reaches by chance, a place elsewhere reaches too. The threshold is the middle between the
/// medians of views among all others and of mirrored ones. In a corridor mirrored views do find
/// their match; therefore it is at least `related_share` of the median difference between any
/// views, as far as that stays below `unrelated_difference` and, where positions are known,
/// `beside`.
///
/// Throws OptionError. Cost: two comparisons of columns for each pair of views: 0.2 s for the
/// defaults and a memory of 1000 views.
[[nodiscard]] PlaceModel learn_place_model(const ColumnRanking& ranking,
                                           const LearningOptions& options = {.sampled_views = 40});

/// Terms that `place_probability` weighs by columns.
inline constexpr int column_term_count = 6;
/// Returns 1 and the logarithms of: the difference over chance and over the tenth best, the number
/// of views, the factor by which the difference over all columns exceeds 0.5, and the share of 15
/// components. A small difference shows nothing by itself, because scenes of little contrast differ
/// little; a large one does. Views and components count within the range that was learnt from.
[[nodiscard]] std::array<double, column_term_count> column_terms(
    const PlaceEvidence& evidence) noexcept;

/// Probability that a place with this evidence is one of the memory's, with a prior of a third: as
/// many queries are from the memory's place, from another that is built alike and from elsewhere.
/// Logistic regression with coefficients that `bench/place_probability` learns on built-in scenes
/// (docs/decisions.md). 0 for a query without structure.
///
/// A sequential test: local features count only where columns are inconclusive. There the log odds
/// are a sum of those by columns and of the logarithms of the verified features' shares, so that
/// more features never lower the probability. A query with too few features to raise it is judged
/// by columns alone.
[[nodiscard]] double place_probability(const PlaceEvidence& evidence) noexcept;
/// True if the probability by the columns alone is between 0.02 and 0.98.
[[nodiscard]] bool is_inconclusive(const PlaceEvidence& evidence) noexcept;
/// Terms that `place_probability` weighs where columns are inconclusive and features were compared.
inline constexpr int feature_term_count = 4;
/// Returns 1, the log odds by columns alone and the logarithms of the verified features over chance
/// and over those of neighbours, all counts increased by 1; 0 features where none were compared.
[[nodiscard]] std::array<double, feature_term_count> feature_terms(
    const PlaceEvidence& evidence) noexcept;

/// Draws the views that a `PlaceCriterion` takes from a memory of these views: 80, each by its own
/// number, or all, in the order in which they were drawn.
[[nodiscard]] std::vector<ViewId> sample_reference_views(std::span<const ViewId> views);

/// Collects the evidence that separates places of the memory from unknown ones. All components of
/// the memory count, however many the search compares.
class PlaceCriterion {
 public:
  /// Keeps the column profiles of 80 views sampled from the memory, each by its own number, so that
  /// adding or removing a view keeps the others. The ranking must outlive *this. `views`: size of
  /// the whole memory if the ranking's is a part with these 80 views; 0: it is the whole.
  explicit PlaceCriterion(const ColumnRanking& ranking, std::size_t views = 0);
  /// Uses a memory that is not held: loads the sampled views, and no others later.
  explicit PlaceCriterion(const ViewSource& source);

  /// Compares the query with the 16 of `matches` that differ least, which the search over the
  /// ranking's memory found with this mask. Chance is that of the first 64 drawn views that are not
  /// excluded. Cost: 0.15 ms.
  [[nodiscard]] PlaceEvidence evidence(const PackedSignature& query,
                                       std::span<const RankedMatch> matches,
                                       const SearchMask& mask = {}) const;
  /// Compares the query's features with those of the first `verified_candidates` of `matches`, the
  /// best first, except where `verified_features` is known. Chance is that of the first 12 drawn
  /// views that are not excluded and have features, and the match with most verified features is
  /// compared with the first 12 others. nullopt where the query, the first match or all drawn views
  /// have none. Cost: 0.1 ms a view compared.
  [[nodiscard]] std::optional<PlaceEvidence::Features> feature_evidence(
      const LocalFeatures& query, const LocalFeatures& mirrored_query,
      const FeatureSource& features, std::span<const RankedMatch> matches,
      const SearchMask& mask = {}) const;
  /// Evidence for the place of `candidates.front()`, right or wrong, instead of the best match's.
  /// The other candidates are the views of the memory most similar to the query.
  [[nodiscard]] PlaceEvidence evidence_for_first(const PackedSignature& query,
                                                 std::span<const PackedSignature> candidates) const;

 private:
  [[nodiscard]] ColumnProfiles profiles(ViewId view,
                                        std::span<const std::uint8_t> allowed_rows) const;
  /// `PlaceEvidence::chance`; 0 for a query without structure.
  [[nodiscard]] double chance_difference(const PackedSignature& query,
                                         const ColumnProfiles& query_profiles,
                                         const SearchMask& mask) const;

  const ColumnRanking* ranking_ = nullptr;  // null: the memory is not held
  int views_ = 0;                           // of the memory at construction; 0: of the ranking's
  std::vector<ViewId> sample_;
  std::vector<ColumnProfiles> profiles_;  // of the sample, over all rows
};

}  // namespace panonav
