#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/feature_ranking.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/localisation/place_model.hpp"
#include "panonav/localisation/position_model.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/signature/compass.hpp"

namespace panonav {

/// A reference view that the query resembles.
struct LocalisedMatch {
  ViewId view;                      ///< an id of the memory
  std::uint32_t dissimilarity = 0;  ///< integer L1 over packed magnitudes, as the search gives it
  double column_difference = 0.0;   ///< column by column, after turning (`ColumnMatch`)
  /// Local features that agree with one turn and one direction of motion; empty where none were
  /// compared.
  std::optional<int> verified_features;
  /// Heading of the query relative to this view; empty when one of them has no structure.
  std::optional<CompassReading> compass;
};

/// Where the robot is, as far as it can be told from one view.
struct Localisation {
  PlaceEvidence evidence;  ///< what `known_probability` was computed of
  /// That the place is one of the memory's (`place_probability`).
  double known_probability = 0.0;
  /// The probability is at least 0.5. The matches are listed all the same.
  bool known = false;
  /// Those of the chosen place and its neighbours first, then all others, each ascending in their
  /// score (`RankedMatch`); of the first four the one nearest to `position` is put first. Where
  /// local features decide, those with most verified features come first instead.
  std::vector<LocalisedMatch> matches;
  /// Interpolated between references; empty when the place is unknown or the nearest view has no
  /// pose. Where local features alone know the place, the radius is at least the neighbourhood of
  /// the interpolation (`PositionModel`).
  std::optional<PositionEstimate> position;
  /// Absolute, in [-pi, pi); empty when the place is unknown or none of the four nearest views has
  /// a heading.
  std::optional<double> heading_rad;
  int components = 0;                ///< compared
  std::uint64_t bytes_read = 0;      ///< by the search
  std::uint64_t bytes_in_full = 0;   ///< what a scan over all views would read
  std::uint64_t views_compared = 0;  ///< column by column
};

/// How much a localisation compares and lists.
struct LocaliserOptions {
  int top = 10;        ///< matches listed
  int components = 0;  ///< Fourier components compared, 0 for all
  /// Views compared column by column when those of least dissimilarity do not explain the query,
  /// because people stand in view or the light has changed. 0: the order of dissimilarity stands,
  /// and columns decide only whether the place is known.
  int reranked_views = 1000;
};
void visit_options(LocaliserOptions& options, OptionVisitor& visitor);

/// How many views a search finds for `Localiser::localise` at first. `by_features`: whether local
/// features of the query decide between matches.
[[nodiscard]] int first_matches(const LocaliserOptions& options, bool by_features);
/// Whether none of these matches explains the query, so that `reranked_views` are searched for
/// where these are more than the first ones.
[[nodiscard]] bool looks_further(const PlaceModel& model, std::span<const RankedMatch> first);

/// Finds places of a memory from single views, in any heading of the robot.
class Localiser {
 public:
  /// Learns both models from the memory, which must outlive *this. What is appended later can be
  /// found, but takes part in the models only when a new Localiser is made. Throws OptionError,
  /// ContractError on more components than the memory's. Cost: about 200 searches, and 0.2 s for
  /// comparing columns, at most.
  explicit Localiser(const VisualMemory& memory, const LocaliserOptions& options = {});
  /// With models learnt before; `spacing_m`: that of the support, where it is known. `views`: the
  /// memory is a part of one of so many views, with all that the answer to a query looks at
  /// (`SearchedRecogniser`); 0: it is the whole. Throws ContractError when the position model was
  /// learnt over other components.
  Localiser(const VisualMemory& memory, const PlaceModel& place_model,
            const PositionModel& position_model, const LocaliserOptions& options = {},
            std::optional<double> spacing_m = std::nullopt, std::size_t views = 0);

  /// From now on, in queries that come with theirs, local features are evidence of whether the
  /// place is known, where columns leave doubt. `rank`: they also decide between the best matches,
  /// for memories in which `FeatureTrial::tell_more`.
  void use_features(FeatureSource features, bool rank) {
    features_ = std::move(features);
    rank_by_features_ = rank;
  }
  /// Whether features decide between the best matches.
  [[nodiscard]] bool ranks_by_features() const noexcept { return features_ && rank_by_features_; }

  /// Learnt at construction, or as given.
  [[nodiscard]] const PlaceModel& place_model() const noexcept { return place_model_; }
  /// Learnt at construction, or as given.
  [[nodiscard]] const PositionModel& position_model() const noexcept { return position_model_; }

  /// Topological localisation. The exact search finds the views of least dissimilarity; comparing
  /// columns puts them in order. When the best of them differs more than neighbouring views of the
  /// memory do, a part of the view may be hidden, which the dissimilarity cannot know: then up to
  /// `reranked_views` views are compared. Between places that look alike the references around each
  /// decide (`NeighbourSupport`). By the visual compass, near the turn at which the columns
  /// fit, follows the heading relative to each match; then whether the place is known, the position
  /// between the references [M04 footnote 1] and the absolute heading: the weighted mean over the
  /// four nearest references, so that the opposite parallaxes of references on opposite sides
  /// cancel. Throws ContractError on a query of another shape. Cost: one exact search and about 0.2
  /// ms; 3 ms and a second search when 1000 views are compared; 2 ms more where features decide
  /// between matches, 3 ms where columns leave doubt whether the place is known, 4 ms for both.
  /// `features`: makes those of the query where they are needed, each at most once; empty: they do
  /// not count.
  [[nodiscard]] Localisation localise(const PackedSignature& query, const SearchMask& mask = {},
                                      const QueryFeatures& features = {}) const;

 private:
  Localiser(const VisualMemory& memory, std::shared_ptr<const ColumnRanking> ranking,
            const LocaliserOptions& options);

  const VisualMemory* memory_;
  LocaliserOptions options_;
  /// Shared by copies; `support_` and `criterion_` look at it.
  std::shared_ptr<const ColumnRanking> ranking_;
  NeighbourSupport support_;
  PlaceCriterion criterion_;
  PlaceModel place_model_;
  PositionModel position_model_;
  FeatureSource features_;  ///< empty: features do not count
  bool rank_by_features_ = false;
};

}  // namespace panonav
