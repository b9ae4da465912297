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

/// Finds places of a memory from single views, in any heading of the robot. The memory is
/// in RAM or searched where it is stored; the answers are the same.
class Localiser {
 public:
  /// Learns both models from the memory, which must outlive *this. Views appended later can be
  /// found, but take part in the models only of a new Localiser. Throws OptionError, ContractError
  /// on more components than the memory's. Cost: about 200 searches, and 0.2 s for comparing
  /// columns, at most.
  explicit Localiser(const VisualMemory& memory, const LocaliserOptions& options = {});
  /// Takes models learnt before; `spacing_m`: that of the support (`NeighbourSupport`), where it is
  /// known. Throws ContractError when the position model was learnt over other components.
  Localiser(const VisualMemory& memory, const PlaceModel& place_model,
            const PositionModel& position_model, const LocaliserOptions& options = {},
            std::optional<double> spacing_m = std::nullopt);
  /// Uses a memory that is not held, with models learnt before. `drawn`: the views that
  /// `sample_reference_views` returns for it. Throws as above.
  Localiser(std::shared_ptr<const VisualMemory> drawn, const PlaceModel& place_model,
            const PositionModel& position_model, const LocaliserOptions& options, double spacing_m);

  /// From now on local features are evidence of whether the place is known, in queries that have
  /// them and where columns are inconclusive. `rank`: they also decide between the best matches,
  /// for memories in which `FeatureTrial::is_significantly_better`.
  void use_features(FeatureSource features, bool rank) {
    features_ = std::move(features);
    rank_by_features_ = rank;
  }
  /// True if features decide between the best matches.
  [[nodiscard]] bool ranks_by_features() const noexcept { return features_ && rank_by_features_; }

  /// Learnt at construction, or as passed to the constructor.
  [[nodiscard]] const PlaceModel& place_model() const noexcept { return place_model_; }
  /// Learnt at construction, or as passed to the constructor.
  [[nodiscard]] const PositionModel& position_model() const noexcept { return position_model_; }

  /// Localises one query:
  /// 1. The exact search finds the views of smallest dissimilarity.
  /// 2. Comparing columns orders them, up to `reranked_views` of them if a part may be hidden.
  /// 3. References around each decide between places that look alike (`NeighbourSupport`).
  /// 4. The visual compass gives the heading relative to each match.
  /// 5. The models decide whether the place is known, the position between references
  ///    [M04 footnote 1] and the absolute heading.
  /// `features` is called at most once to compute local features; if empty, none are used. Throws
  /// ContractError on another shape and if the memory is not in RAM. Cost: a search and 0.2 ms; 3
  /// ms and a second search for 1000 views; 2 to 4 ms with features.
  [[nodiscard]] Place localise(const PackedSignature& query, const SearchMask& mask = {},
                               const QueryFeatures& features = {}) const;
  /// Localises by an index of the memory. Of a memory that is not held, it loads the views that the
  /// answer needs: those that the search finds and references around them. Throws as `index`.
  [[nodiscard]] Place localise(ViewIndex& index, const PackedSignature& query,
                               const SearchMask& mask = {},
                               const QueryFeatures& features = {}) const;

 private:
  class Query;
  struct ComparedViews;

  LocaliserOptions options_;
  // Shared by copies. Null: the memory is not held; each query makes its own.
  std::shared_ptr<const ComparedViews> held_;
  std::shared_ptr<const VisualMemory> drawn_;  // null: the memory is held
  double spacing_m_ = 0.0;                     // where it is not held
  PlaceModel place_model_;
  PositionModel position_model_;
  FeatureSource features_;  // empty: features do not count
  bool rank_by_features_ = false;
};

}  // namespace panonav
