#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/feature_ranking.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/memory/view_source.hpp"

namespace panonav {

/// How many views a model is learnt from.
struct PlaceModelOptions {
  int sampled_views = 40;     ///< that are compared with others; all of smaller memories
  int compared_views = 1000;  ///< with which each is compared; all of smaller memories
  int seed = 1;               ///< of the draws
};
void visit_options(PlaceModelOptions& options, OptionVisitor& visitor);

/// How views of one memory differ (`ColumnMatch`), learnt from it: from when on the nearest views
/// do not explain a query (`neighbouring`), and up to which difference a view counts as explained
/// when nothing else is known of it (`threshold`). Plain numbers, so that it can be kept beside the
/// memory.
struct PlaceModel {
  /// Places that have nothing to do with each other differ by at least this in scenes of all kinds
  /// (docs/decisions.md); what a place with views unlike each other might suggest beyond is not
  /// taken.
  static constexpr double unrelated_difference = 0.58;
  /// The threshold of a memory that is too small to learn from.
  static constexpr double unlearnt_threshold = 0.5;
  /// Share of the difference between arbitrary views of the memory at which two views begin to have
  /// something to do with each other.
  static constexpr double related_share = 0.88;
  /// Fewest views to learn from.
  static constexpr int min_views = 8;

  double threshold = unlearnt_threshold;  ///< differences up to it count as explained
  bool learnt = false;                    ///< false: fewer than `min_views` views
  int sampled_views = 0;                  ///< that it was learnt from
  double neighbouring = 0.0;  ///< median difference of a view to the most similar one of all others
  double arbitrary = 0.0;     ///< median difference between two views
  double mirrored = 0.0;      ///< median difference of a mirrored view to the most similar one
  /// Nine of ten views differ by no more from the one taken nearest to them; empty where fewer than
  /// `min_views` of the sampled views have a position.
  std::optional<double> beside;
  friend bool operator==(const PlaceModel&, const PlaceModel&) = default;
};

/// Learns from the memory itself; no other scene and no label is needed.
///
/// A view mirrored left to right shows a place that does not exist, with all the brightness, edges
/// and textures of this memory: what its best match reaches by chance, a place elsewhere reaches
/// too. A query between the references is nearer to one of them than they are to each other. So the
/// threshold lies in the middle between what a view of the memory reaches among all others and what
/// a mirrored one does (medians). In a place that is its own mirror image, a corridor, mirrored
/// views do find their match, and this says nothing; therefore the threshold is at least
/// `related_share` of the median difference between arbitrary views, as far as that stays below
/// `unrelated_difference` and, where positions are known, below `beside`.
///
/// Throws OptionError. Cost: two comparisons of columns for each pair of a sampled and a compared
/// view: 0.2 s for the defaults and a memory of 1000 views.
[[nodiscard]] PlaceModel learn_place_model(const ColumnRanking& ranking,
                                           const PlaceModelOptions& options = {});

/// What `place_probability` weighs: 1 and the logarithms of the difference's shares of chance and
/// of the tenth best, of the number of views, of how many times the difference exceeds 0.4 and of
/// the components' share of 15. A small difference tells nothing by itself, because scenes of
/// little contrast differ little; a large one does. Views and components count within what was
/// learnt from.
inline constexpr int column_term_count = 6;
/// The evidence as regression takes it: entry 0 is 1, the others as above.
[[nodiscard]] std::array<double, column_term_count> column_terms(
    const PlaceEvidence& evidence) noexcept;

/// Probability that a place with this evidence is one of the memory's, where the prior is a third:
/// as many queries are from the memory's place, from another that is built alike and from
/// elsewhere. Logistic regression with coefficients that `bench/place_probability` learns on
/// built-in scenes (docs/decisions.md). 0 where there is nothing to see.
///
/// A sequential test: local features count only where columns `is_inconclusive`. There the log odds
/// are a sum of those by columns and of the logarithms of the verified features' shares, so that
/// more of them never lower the probability. A query with too few features to raise it is judged by
/// columns alone.
[[nodiscard]] double place_probability(const PlaceEvidence& evidence) noexcept;
/// By the columns alone, the probability is between 0.02 and 0.98.
[[nodiscard]] bool is_inconclusive(const PlaceEvidence& evidence) noexcept;
/// What `place_probability` weighs where columns leave doubt and features were compared: 1, the log
/// odds by columns alone and the logarithms of the verified features' shares of chance and of what
/// neighbours share, all counts increased by 1.
inline constexpr int feature_term_count = 4;
/// The evidence as regression takes it: entry 0 is 1, the others as above. Without features their
/// counts are 0.
[[nodiscard]] std::array<double, feature_term_count> feature_terms(
    const PlaceEvidence& evidence) noexcept;

/// The views that a `PlaceCriterion` draws from a memory of these views: 80, each by its own
/// number, or all, in the order in which they were drawn.
[[nodiscard]] std::vector<ViewId> draw_views(std::span<const ViewId> views);

/// Tells a place of the memory from an unknown one, view by view. All components of the memory
/// count, however many the search compares.
class PlaceCriterion {
 public:
  /// Keeps the column profiles of 80 views drawn from the memory, each by its own number, so that a
  /// view more or less leaves the others in. The ranking must outlive *this. `views`: of the memory
  /// of which the ranking's is a part that has these 80 views; 0: it is the whole.
  explicit PlaceCriterion(const ColumnRanking& ranking, std::size_t views = 0);
  /// Of a memory that is not held whole: loads the drawn views, and no others later.
  explicit PlaceCriterion(const ViewSource& source);

  /// `matches`: what the search over the ranking's memory found with this mask; of these the 16
  /// that differ least are looked at. Chance is that of the first 64 drawn views that are not
  /// excluded. Cost: 0.15 ms.
  [[nodiscard]] PlaceEvidence evidence(const PackedSignature& query,
                                       std::span<const RankedMatch> matches,
                                       const SearchMask& mask = {}) const;
  /// What the query's features tell. `matches`: the best first, as above; the first
  /// `verified_candidates` are compared, but for those whose features were (`verified_features`).
  /// Chance is that of the first 12 drawn views that are not excluded and have features, and the
  /// match with most verified features is compared with the first 12 others. Empty where the query,
  /// the first match or all drawn views have none. Cost: 0.1 ms a view compared.
  [[nodiscard]] std::optional<PlaceEvidence::Features> feature_evidence(
      const LocalFeatures& query, const LocalFeatures& mirrored_query,
      const FeatureSource& features, std::span<const RankedMatch> matches,
      const SearchMask& mask = {}) const;
  /// What the query tells of one place, right or not, instead of the best match's: that of
  /// `candidates.front()`. The others are the views of the memory most like the query.
  [[nodiscard]] PlaceEvidence evidence_for_first(const PackedSignature& query,
                                                 std::span<const PackedSignature> candidates) const;

 private:
  [[nodiscard]] ColumnProfiles profiles(ViewId view,
                                        std::span<const std::uint8_t> allowed_rows) const;
  /// `PlaceEvidence::chance`; 0 where there is nothing to see.
  [[nodiscard]] double chance(const PackedSignature& query, const ColumnProfiles& asked,
                              const SearchMask& mask) const;

  const ColumnRanking* ranking_ = nullptr;  ///< null: the memory is not held
  int views_ = 0;  ///< of the memory when *this was made; 0: the ranking's is asked
  std::vector<ViewId> sample_;
  std::vector<ColumnProfiles> profiles_;  ///< of these, over all rows
};

}  // namespace panonav
