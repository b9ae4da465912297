#pragma once

#include <optional>

#include "panonav/localisation/feature_ranking.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/localisation/place_model.hpp"
#include "panonav/localisation/position_model.hpp"
#include "panonav/localisation/sector_localiser.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Models that localisation and tracking learn from a memory, with the default learning options and
/// all components.
struct LearntModels {
  PlaceModel place;        ///< decides whether a place is known
  PositionModel position;  ///< estimates positions between references
  double spacing_m = 0.0;  ///< spacing of references with headings (`NeighbourSupport`)
  /// nullopt if the memory has too few views with a position, or all of them are at the same
  /// position.
  std::optional<ObservationModel> observation;
  /// True if local features sort the best matches (`FeatureTrial::is_significantly_better`).
  bool by_features = false;
  /// nullopt if no view has features for narrow pictures.
  std::optional<SectorModel> sector;
  friend bool operator==(const LearntModels&, const LearntModels&) = default;
};
/// Learns the models of a memory from the views of `LearntViews`. `features`, `narrow_features`:
/// empty if the memory has none.
[[nodiscard]] LearntModels learn_models(const VisualMemory& memory,
                                        const FeatureSource& features = {},
                                        const GradientSource& narrow_features = {});

/// Learns all models except those of observations and of narrow pictures, with `components` Fourier
/// components (0: all). Throws ContractError if the memory has fewer components.
[[nodiscard]] LearntModels learn_place_models(const VisualMemory& memory,
                                              const FeatureSource& features, int components);

/// Learns the observation model from the same views. Throws as `learn_observation_model`.
[[nodiscard]] ObservationModel learn_tracking_model(const VisualMemory& memory,
                                                    const LearningOptions& options = {});

/// Returns a function that reads the local features of a view from the file at each call; empty if
/// the file has none. The file must outlive the function.
[[nodiscard]] FeatureSource make_feature_source(const MemoryFile& file);

/// Reads the models stored in the file, bit for bit as returned by `learn_models`; nullopt if there
/// are none or views from which they are learnt (`count_learnt_views`) have changed since.
/// `memory`: all views of the file. Does not change the file. Cost: a pass over the poses.
[[nodiscard]] std::optional<LearntModels> load_stored_models(const MemoryFile& file,
                                                             const VisualMemory& memory);
/// Reads the models stored last, even if the views have changed since.
[[nodiscard]] std::optional<LearntModels> load_stored_models(const MemoryFile& file);

}  // namespace panonav
