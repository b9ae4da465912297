#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "panonav/localisation/feature_ranking.hpp"
#include "panonav/localisation/localiser_options.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/localisation/place_model.hpp"
#include "panonav/localisation/position_model.hpp"
#include "panonav/memory/view_index.hpp"

namespace panonav {

/// Recognises places of a memory from single views, whatever the robot's heading. The memory is
/// held in RAM or searched in its storage, with the same results.
class Localiser {
 public:
  /// Learns the place model and the position model from the memory, which must outlive *this. Views
  /// appended later can be found, but the models do not include them. Throws OptionError;
  /// ContractError if the memory has fewer components than `options.components`. Cost: at most
  /// about 200 searches, and 0.2 s for comparing columns.
  explicit Localiser(const VisualMemory& memory, const LocaliserOptions& options = {});
  /// Uses models learnt before. `spacing_m`: spacing of the references
  /// (`NeighbourSupport::spacing_m`); computed if nullopt. Throws ContractError if the position
  /// model was learnt with another number of components.
  Localiser(const VisualMemory& memory, const PlaceModel& place_model,
            const PositionModel& position_model, const LocaliserOptions& options = {},
            std::optional<double> spacing_m = std::nullopt);
  /// Uses a memory that is not held in RAM, with models learnt before. `sampled`: the views that
  /// `sample_reference_views` returns for it. Throws like the constructor above.
  Localiser(std::shared_ptr<const VisualMemory> sampled, const PlaceModel& place_model,
            const PositionModel& position_model, const LocaliserOptions& options, double spacing_m);

  /// Uses local features as further evidence of whether a place is known if columns are
  /// inconclusive. `rank`: features also sort the best matches; set it if
  /// `FeatureTrial::is_significantly_better`.
  void use_features(FeatureSource features, bool rank) {
    features_ = std::move(features);
    rank_by_features_ = rank;
  }
  /// True if features sort the best matches.
  [[nodiscard]] bool should_rank_by_features() const noexcept {
    return features_ && rank_by_features_;
  }

  /// Learnt at construction, or as passed to the constructor.
  [[nodiscard]] const PlaceModel& place_model() const noexcept { return place_model_; }
  /// Learnt at construction, or as passed to the constructor.
  [[nodiscard]] const PositionModel& position_model() const noexcept { return position_model_; }

  /// Localises one query:
  /// 1. The search finds the views of smallest dissimilarity.
  /// 2. Columns order up to `reranked_views` of them.
  /// 3. Neighbours decide between similar places (`NeighbourSupport`).
  /// 4. The visual compass gives the heading relative to each match.
  /// 5. The models decide if the place is known, and give position [M04 footnote 1] and heading.
  /// 6. Where columns leave doubt, the query is tried without its tilt, and with blurred views.
  ///
  /// `features` computes local features of the query on demand; empty: none. Throws ContractError
  /// on a query of another shape, and if the memory is not held. Cost: a search and 0.2 ms; without
  /// near match 3 ms for 1000 views; in doubt 3 ms and 1 ms an attempt.
  [[nodiscard]] Place localise(const PackedSignature& query, const SearchMask& mask = {},
                               const QueryFeatures& features = {}) const;
  /// Localises by searching `index`. If the memory is not held in RAM, loads only the views found
  /// and the references around them. Passes on exceptions of `index`.
  [[nodiscard]] Place localise(ViewIndex& index, const PackedSignature& query,
                               const SearchMask& mask = {},
                               const QueryFeatures& features = {}) const;

 private:
  class Query;
  struct ComparedViews;

  LocaliserOptions options_;
  // Shared by copies of the localiser. Null if the memory is not held in RAM; each query then loads
  // its own views.
  std::shared_ptr<const ComparedViews> held_;
  std::shared_ptr<const VisualMemory> sampled_;  // null: the memory is held in RAM
  double spacing_m_ = 0.0;                       // spacing of the references; used if not held
  PlaceModel place_model_;
  PositionModel position_model_;
  FeatureSource features_;  // empty if features are not used
  bool rank_by_features_ = false;
};

}  // namespace panonav
