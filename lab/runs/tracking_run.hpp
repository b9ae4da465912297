#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/localisation/column_ranking.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav_simulation/place_recording.hpp"
#include "panonav_simulation/scenes.hpp"
#include "panonav_simulation/sensor.hpp"

namespace panonav::lab {

/// A memory of posed views with its localisers, shared by any number of runs. Not copyable, because
/// the localisers refer to the memory.
class TrackingPlace {
 public:
  /// Learns the models of the memory. `spacing_m` is the spacing of the reference grid, > 0. Throws
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

/// Makes a memory of views with the defaults of the command line program. Throws ContractError if
/// there are no views, or not as many as poses.
[[nodiscard]] VisualMemory make_memory_of_views(std::span<const ReferencePose> poses,
                                                std::span<const Panorama* const> views,
                                                Executor& executor);
/// Makes a memory of the references of a recorded place whose positions fulfil `kept`; of all if
/// `kept` is empty.
[[nodiscard]] VisualMemory make_memory_of_references(
    const simulation::PlaceRecording& place, Executor& executor,
    const std::function<bool(Point2)>& kept = nullptr);

/// Extracts the local features of all references in `memory`.
[[nodiscard]] FeatureSource extract_reference_features(const simulation::PlaceRecording& place,
                                                       const VisualMemory& memory,
                                                       Executor& executor);
/// Returns a function that extracts the features of a query for `Localiser::localise`. The view
/// must outlive the function.
[[nodiscard]] QueryFeatures make_query_features(const Panorama& view);

/// Makes a tracking place from posed views. `spacing_m` as for the constructor of TrackingPlace.
[[nodiscard]] std::shared_ptr<const TrackingPlace> make_tracking_place(
    std::span<const ReferencePose> poses, std::span<const Panorama* const> views, double spacing_m,
    Executor& executor);

[[nodiscard]] std::shared_ptr<const TrackingPlace> make_tracking_place(
    const simulation::PlaceRecording& place, Executor& executor,
    const std::function<bool(Point2)>& kept = nullptr);

/// Computes the packed signature of a panorama for `memory`, with the defaults of the command line
/// program.
[[nodiscard]] PackedSignature compute_packed_signature(const Panorama& panorama,
                                                       const VisualMemory& memory);

/// One step of a run: true pose, motion and view.
struct TrackingStep {
  Pose2 truth;  ///< world_from_robot after the step
  /// True motion robot_old_from_robot_new; nullopt at the start, and where the robot was carried to
  /// `truth` without its knowledge (kidnapped).
  std::optional<Pose2> moved;
  std::optional<PackedSignature> view;  ///< nullopt if no picture was taken
};

/// True poses and views of a run. Odometry is simulated only when a filter tracks the run.
struct TrackingRun {
  std::vector<TrackingStep> steps;
};

/// Makes a run through `poses` with one view per pose.
[[nodiscard]] TrackingRun make_tracking_run(std::span<const Pose2> poses,
                                            std::vector<PackedSignature> views);

/// Appends to the first `images` steps of `before` the steps of `after`, beginning with its first
/// one at least `distance_m` away; the robot is kidnapped between the two. Returns nullopt if fewer
/// than `min_images` steps of `after` remain.
[[nodiscard]] std::optional<TrackingRun> make_kidnapped_run(const TrackingRun& before,
                                                            const TrackingRun& after,
                                                            std::size_t images, double distance_m,
                                                            std::size_t min_images);

/// Cuts a run into pieces of `piece` steps and puts them into another order; the robot is kidnapped
/// at the start of each piece whose former predecessor is not before it. Fewer steps at the end are
/// dropped. Throws ContractError unless the run has at least three pieces.
[[nodiscard]] TrackingRun shuffle_pieces(const TrackingRun& run, std::size_t piece, Random& random);

/// Returns the run without the images of steps first .. first + count - 1.
[[nodiscard]] TrackingRun drop_images(TrackingRun run, std::size_t first, std::size_t count);

/// Changes of light, objects and sensor between memorising and a run.
struct RunCondition {
  std::string id;
  std::string name;
  double light_change = 0.0;   ///< half width of the uniform light factor around 1
  double moved_objects = 0.0;  ///< fraction of the objects that are moved
  simulation::SensorOptions sensor;
};

/// Returns the condition without any change.
[[nodiscard]] RunCondition make_clean_condition();
/// Returns a condition with light of 0.7 .. 1.3, a tenth of the objects moved, and sensor noise at
/// which 60 to 80 % of single images are localised correctly.
[[nodiscard]] RunCondition make_hard_condition();

struct WalkOptions {
  int variants = 3;               ///< of the scene: light, moved objects; >= 1
  int runs_each = 4;              ///< in each variant, >= 1
  int images = 25;                ///< per run, >= 1; fewer if the robot cannot move on
  double step_m = 0.25;           ///< distance between images, > 0
  bool constant_heading = false;  ///< heading 0 in all poses (holonomic robot)
  std::uint64_t seed = 1;
};

/// Records random walks through the place under a condition, variant by variant. Variant v depends
/// on the condition and the seed, not on the number of runs. `place.scene.name` and `place.seed`
/// identify the scene, which must be a built-in one if the condition changes it. Cost: one renderer
/// per variant of a changed scene, and one rendered view per image.
[[nodiscard]] std::vector<TrackingRun> record_walks(const simulation::PlaceRecording& place,
                                                    const TrackingPlace& remembered,
                                                    const RunCondition& condition,
                                                    const WalkOptions& options, Executor& executor);

/// Records runs with one view per pose, all rendered by `renderer` (of the place's scene or of a
/// changed one). View i of pose list r uses the noise seed `seed` + 1000 r + i.
[[nodiscard]] std::vector<TrackingRun> record_runs(const std::vector<std::vector<Pose2>>& poses,
                                                   const simulation::PlaceRecording& place,
                                                   const simulation::Renderer& renderer,
                                                   const TrackingPlace& remembered,
                                                   const simulation::SensorOptions& sensor,
                                                   std::uint64_t seed, Executor& executor);

/// Counts of the localisation of single images, without filter.
struct SingleImages {
  std::size_t images = 0;
  std::size_t right = 0;  ///< the best match is the reference nearest to the truth
  std::size_t near = 0;   ///< the best match is within one spacing of the truth
  /// The reference of smallest dissimilarity is nearest to the truth; this ranking is the paper's
  /// method.
  std::size_t right_by_dissimilarity = 0;
  void add(const SingleImages& other);
};
[[nodiscard]] SingleImages localise_single_images(const TrackingPlace& place,
                                                  std::span<const TrackingRun> runs,
                                                  Executor& executor);

}  // namespace panonav::lab
