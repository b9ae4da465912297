#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav_simulation/place_recording.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/sensor.hpp"

namespace panonav::lab {

/// A memory of posed views with its localisers, shared by any number of runs. Neither copied nor
/// moved: its parts refer to the memory.
class TrackingPlace {
 public:
  /// Learns the models of the memory. `spacing_m`: of the grid of references, > 0. Throws
  /// ContractError as `learn_observation_model`.
  TrackingPlace(VisualMemory memory, double spacing_m);
  TrackingPlace(const TrackingPlace&) = delete;
  TrackingPlace& operator=(const TrackingPlace&) = delete;

  [[nodiscard]] const VisualMemory& memory() const noexcept { return memory_; }
  [[nodiscard]] double spacing_m() const noexcept { return spacing_m_; }
  [[nodiscard]] const std::shared_ptr<const ColumnRanking>& ranking() const noexcept {
    return ranking_;
  }
  [[nodiscard]] const ObservationModel& model() const noexcept { return model_; }
  [[nodiscard]] const Localiser& localiser() const noexcept { return localiser_; }
  /// Returns the positions of all posed views.
  [[nodiscard]] std::vector<Point2> reference_positions() const;

 private:
  VisualMemory memory_;
  double spacing_m_;
  std::shared_ptr<const ColumnRanking> ranking_;
  ObservationModel model_;
  Localiser localiser_;
};

/// Makes a memory of views by the command's defaults. Throws ContractError on different numbers of
/// poses and views, or no view.
[[nodiscard]] VisualMemory make_memory_of_views(std::span<const ReferencePose> poses,
                                                std::span<const Panorama* const> views,
                                                Executor& executor);
/// Makes a memory of the references of a recorded place; `kept` selects some; empty: all.
[[nodiscard]] VisualMemory make_memory_of_references(
    const simulation::PlaceRecording& place, Executor& executor,
    const std::function<bool(Point2)>& kept = nullptr);

/// Extracts the local features of the references in this memory.
[[nodiscard]] FeatureSource extract_reference_features(const simulation::PlaceRecording& place,
                                                       const VisualMemory& memory,
                                                       Executor& executor);
/// Returns the features of a query for `Localiser::localise`. The view must outlive them.
[[nodiscard]] QueryFeatures make_query_features(const Panorama& view);

/// Makes the place of views. `spacing_m` as TrackingPlace.
[[nodiscard]] std::shared_ptr<const TrackingPlace> make_tracking_place(
    std::span<const ReferencePose> poses, std::span<const Panorama* const> views, double spacing_m,
    Executor& executor);

[[nodiscard]] std::shared_ptr<const TrackingPlace> make_tracking_place(
    const simulation::PlaceRecording& place, Executor& executor,
    const std::function<bool(Point2)>& kept = nullptr);

/// Computes the signature of a panorama for this memory by the command's defaults.
[[nodiscard]] PackedSignature compute_packed_signature(const Panorama& panorama,
                                                       const VisualMemory& memory);

/// One step of a run.
struct TrackingStep {
  Pose2 truth;  ///< world_from_robot after the step
  /// True robot_old_from_robot_new; empty at the start, and where the robot was kidnapped to
  /// `truth` without noticing.
  std::optional<Pose2> moved;
  std::optional<PackedSignature> view;  ///< empty: no picture was taken
};

/// True poses and views of a run. Odometry is simulated when a filter runs.
struct TrackingRun {
  std::vector<TrackingStep> steps;
};

/// Makes a run through `poses` with one view at each.
[[nodiscard]] TrackingRun make_tracking_run(std::span<const Pose2> poses,
                                            std::vector<PackedSignature> views);

/// Joins the first `images` steps of `before` with those of `after` from the first step of `after`
/// that is at least `distance_m` away, and continues there. Nullopt if no such step leaves
/// `min_images`.
[[nodiscard]] std::optional<TrackingRun> make_kidnapped_run(const TrackingRun& before,
                                                            const TrackingRun& after,
                                                            std::size_t images, double distance_m,
                                                            std::size_t min_images);

/// Returns the run without the images of steps first .. first + count - 1.
[[nodiscard]] TrackingRun drop_images(TrackingRun run, std::size_t first, std::size_t count);

/// Differences of runs from memorising.
struct RunCondition {
  std::string id;
  std::string name;
  double light_change = 0.0;   ///< light is uniform in 1 +- this, drawn for each variant
  double moved_objects = 0.0;  ///< share of them
  simulation::SensorOptions sensor;
};

/// Returns the condition of memorising.
[[nodiscard]] RunCondition clean_condition();
/// Returns light of 0.7 .. 1.3, a tenth of the objects moved, and sensor noise at which 60 to 80 %
/// of single images are localised correctly.
[[nodiscard]] RunCondition hard_condition();

struct WalkOptions {
  int variants = 3;               ///< of the scene: other light, other objects moved; >= 1
  int runs_each = 4;              ///< in each variant, >= 1
  int images = 25;                ///< of a run, >= 1; fewer where the robot is boxed in
  double step_m = 0.25;           ///< between images, > 0
  bool constant_heading = false;  ///< heading 0 throughout, as a holonomic robot can
  std::uint64_t seed = 1;
};

/// Records random walks through the place under a condition, variant by variant; variant v of
/// condition and seed is the same whatever the number of runs. `place.scene.name` and `place.seed`
/// name the scene, which must be a built-in one where the condition changes it. Cost: one renderer
/// for each variant of a scene that changes, and one view for each image.
[[nodiscard]] std::vector<TrackingRun> record_walks(const simulation::PlaceRecording& place,
                                                    const TrackingPlace& remembered,
                                                    const RunCondition& condition,
                                                    const WalkOptions& options, Executor& executor);

/// Records views along poses, all through one renderer (of the place's own or a changed scene);
/// view i of pose list r has the noise seed `seed` + 1000 r + i.
[[nodiscard]] std::vector<TrackingRun> record_runs(const std::vector<std::vector<Pose2>>& poses,
                                                   const simulation::PlaceRecording& place,
                                                   const simulation::Renderer& renderer,
                                                   const TrackingPlace& remembered,
                                                   const simulation::SensorOptions& sensor,
                                                   std::uint64_t seed, Executor& executor);

/// Localisation of single images of runs.
struct SingleImages {
  std::size_t images = 0;
  std::size_t right = 0;  ///< the best match is the reference nearest to the truth
  std::size_t near = 0;   ///< the best match is within one spacing of the truth
  /// The reference of smallest dissimilarity is nearest to the truth: the paper's method.
  std::size_t right_by_dissimilarity = 0;
  void add(const SingleImages& other);
};
[[nodiscard]] SingleImages localise_single_images(const TrackingPlace& place,
                                                  std::span<const TrackingRun> runs,
                                                  Executor& executor);

}  // namespace panonav::lab
