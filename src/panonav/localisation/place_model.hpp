#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/feature_ranking.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/localisation/sample.hpp"
#include "panonav/memory/view_source.hpp"

namespace panonav {

/// Distribution of the differences between views of one memory (`ColumnMatch`), learnt from the
/// memory and stored with it.
struct PlaceModel {
  /// Smallest difference measured between unrelated places over all kinds of scenes
  /// (docs/decisions.md); limits the lower bound of the threshold.
  static constexpr double unrelated_difference = 0.58;
  /// Threshold of a memory that is too small to learn from.
  static constexpr double unlearnt_threshold = 0.5;
  /// Two views are related if their difference is below this share of the median difference between
  /// arbitrary views.
  static constexpr double related_share = 0.88;
  /// Smallest number of views needed for learning.
  static constexpr int min_views = 8;

  double threshold =
      unlearnt_threshold;  ///< largest difference at which a reference explains a view
  bool learnt = false;     ///< false if there were fewer than `min_views` views
  int sampled_views = 0;   ///< number of views from which it was learnt
  double neighbouring_difference =
      0.0;  ///< median difference between a view and the most similar other view
  double arbitrary_difference = 0.0;  ///< median difference between two views
  double mirrored_difference = 0.0;   ///< median difference of a mirrored view to its best match
  /// 90 % quantile of the difference between a view and the one nearest in space; nullopt if fewer
  /// than `min_views` of the sampled views have a position.
  std::optional<double> nearest_view_difference;
  friend bool operator==(const PlaceModel&, const PlaceModel&) = default;
};

/// Learns the model from the memory itself; no other scene and no label is needed.
///
/// A view mirrored left to right shows a place that does not exist, so its best match has the
/// difference reached by chance. `threshold` is the mean of the median best difference of real
/// views and that of mirrored views. In a corridor, mirrored views do find a match, and this mean
/// is too small. `threshold` is therefore at least the smallest of three values: `related_share`
/// times the median difference between any views, `unrelated_difference`, and
/// `nearest_view_difference` if positions are known.
///
/// Throws OptionError. Cost: two comparisons of columns for each pair of views: 0.2 s for the
/// defaults and a memory of 1000 views.
[[nodiscard]] PlaceModel learn_place_model(const ColumnRanking& ranking,
                                           const LearningOptions& options = {.sampled_views = 40});

/// Number of terms by columns in `place_probability`.
inline constexpr int column_term_count = 6;
/// Returns the regression terms by columns: 1 and the logarithms of five numbers: the best
/// difference divided by that of chance, the best difference divided by the tenth best, the
/// number of views, the difference over all columns divided by 0.5 (at least 1), and the number of
/// components divided by 15. Views and components are clamped to the range of the training data.
/// The difference is divided by that of chance because scenes of little contrast always differ
/// little.
[[nodiscard]] std::array<double, column_term_count> column_terms(
    const PlaceEvidence& evidence) noexcept;

/// Returns the probability that the query's place is in the memory, by logistic regression; 0 for a
/// query without structure. The prior probability is one third: in training, a third of the queries
/// comes from the memory's place, a third from a place of similar structure and a third from
/// elsewhere. `bench/place_probability` learns the coefficients on built-in scenes
/// (docs/decisions.md).
///
/// Uses local features only if columns are inconclusive (a sequential test): adds the logarithms of
/// the verified features' ratios to the log odds by columns. More verified features never lower the
/// probability. If the query has too few features to raise the probability, columns alone decide.
[[nodiscard]] double place_probability(const PlaceEvidence& evidence) noexcept;
/// Probability from which on, or below its complement, columns alone leave no doubt.
inline constexpr double min_certain_probability = 0.98;
/// True if the probability by columns alone leaves a doubt (`min_certain_probability`).
[[nodiscard]] bool is_inconclusive(const PlaceEvidence& evidence) noexcept;
/// Number of terms in `place_probability` if columns are inconclusive and features were compared.
inline constexpr int feature_term_count = 4;
/// Returns the regression terms with features: 1, the log odds by columns, and the logarithms of
/// two ratios: verified features to those of chance, and verified features to those shared by
/// neighbours (all counts increased by 1). If no features were compared, all counts are 0.
[[nodiscard]] std::array<double, feature_term_count> feature_terms(
    const PlaceEvidence& evidence) noexcept;

/// Samples the views that a `PlaceCriterion` compares for chance: 80, or all of a smaller memory,
/// in the order of sampling. Each view gets a random number that depends only on its id, so adding
/// a view hardly changes the sample.
[[nodiscard]] std::vector<ViewId> sample_reference_views(std::span<const ViewId> views);

/// Collects the evidence that separates places of the memory from unknown ones. Always compares all
/// components of the memory.
class PlaceCriterion {
 public:
  /// Keeps the column profiles of the views that `sample_reference_views` returns. The ranking must
  /// outlive *this. `views`: number of views of the whole memory if the ranking's memory is a
  /// part of it that includes these views; 0 if the ranking's memory is the whole.
  explicit PlaceCriterion(const ColumnRanking& ranking, std::size_t views = 0);
  /// Compares the same views for chance as `sampled`, with the profiles of another ranking of the
  /// same memory.
  PlaceCriterion(const ColumnRanking& ranking, const PlaceCriterion& sampled);
  /// Loads the sampled views from a memory that is not held in RAM; loads no others later.
  explicit PlaceCriterion(const ViewSource& source);

  /// Collects evidence by columns: compares the query with the 16 of `matches` that differ least.
  /// `matches`: found in the ranking's memory with the same mask. The difference of chance is
  /// measured on the first 64 sampled views that are not excluded. Cost: 0.15 ms.
  [[nodiscard]] PlaceEvidence evidence(const PackedSignature& query,
                                       std::span<const RankedMatch> matches,
                                       const SearchMask& mask = {}) const;
  /// Collects evidence by local features: compares the query with the first
  /// `verified_candidates` of `matches`, best first, unless their `verified_features` are known.
  /// The number expected by chance is measured on the first 12 sampled views that have features and
  /// are not excluded, the number of neighbours on the best match and the first 12 others. nullopt
  /// if the query, the first match or all sampled views have no features. Cost: 0.1 ms for each
  /// compared view.
  [[nodiscard]] std::optional<PlaceEvidence::Features> feature_evidence(
      const LocalFeatures& query, const LocalFeatures& mirrored_query,
      const FeatureSource& features, std::span<const RankedMatch> matches,
      const SearchMask& mask = {}) const;
  /// Collects the evidence that the query was taken at the place of `candidates.front()`, even if
  /// another candidate matches better. The other candidates are the memory's views most similar to
  /// the query.
  [[nodiscard]] PlaceEvidence evidence_for_first(const PackedSignature& query,
                                                 std::span<const PackedSignature> candidates) const;

 private:
  [[nodiscard]] std::shared_ptr<const ColumnProfiles> profiles(
      ViewId view, std::span<const std::uint8_t> allowed_rows) const;
  /// Returns `PlaceEvidence::chance`; 0 for a query without structure.
  [[nodiscard]] double max_chance_difference(const PackedSignature& query,
                                             const ColumnProfiles& query_profiles,
                                             const SearchMask& mask) const;

  const ColumnRanking* ranking_ = nullptr;  // null: the memory is not held in RAM
  int views_ = 0;  // size of the memory at construction; 0: the ranking's memory
  std::vector<ViewId> sample_;
  std::vector<std::shared_ptr<const ColumnProfiles>> profiles_;  // of the sample, over all rows
};

}  // namespace panonav
