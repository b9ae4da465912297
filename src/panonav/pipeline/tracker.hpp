#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>

#include "panonav/io/dataset.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/memory/view_index.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Options for tracking a robot.
struct TrackerOptions {
  MonteCarloOptions filter;  ///< how particles are sampled and weighted
  /// Errors of the motion; nullopt: `OdometryNoise{}` for odometry of wheels, and
  /// `visual_odometry_noise()` for motion that is read from the pictures.
  std::optional<OdometryNoise> odometry;
  /// Layout of the pictures; nullopt: that of the memory. Narrow ones (`PictureKind::pinhole`) need
  /// a memory that is held and stores features for them.
  std::optional<PictureSource> source;
  /// Largest number of views of a memory on a server that is held in RAM; a larger one is searched
  /// on the server for each image. Files are always held.
  std::size_t max_held_views = 200'000;
  /// Largest number of views from which the model of a memory that is not held is learnt if none is
  /// stored; they are taken from whole areas.
  std::size_t max_learnt_views = 20'000;
};

/// Tracks a moving robot by its pictures and odometry in a memory (`MonteCarloLocaliser`):
///   panonav::Tracker tracker("office.panonav");
///   const auto estimate = tracker.observe(observation);
///   if (estimate.state == panonav::LocalisationState::localised) use(*estimate.pose);
/// The motion to an observation without odometry is read from the pictures (`VisualOdometry`); the
/// next odometry, which is a cumulative pose, corrects it. Narrow pictures show no motion: without
/// odometry each is one spacing of the views from the last.
/// Uses the settings of the memory for signatures, and its stored observation model
/// (`learn_and_store_models`), or learns a new one if the views have changed since. Holds the
/// memory in RAM, unless it is on a server and larger than `max_held_views`; a file is not read
/// after construction. Same views, options and observations: same bits.
class Tracker {
 public:
  /// Starts with an unknown pose in the memorised area. Throws FileError if the file is missing or
  /// damaged, or if too few of its views have a position; OptionError.
  explicit Tracker(const std::filesystem::path& memory, const TrackerOptions& options = {});
  /// Uses an open file.
  explicit Tracker(const MemoryFile& file, const TrackerOptions& options = {});
  /// Uses a memory that is not held. `memory`: its address or file. Throws as above.
  Tracker(std::unique_ptr<IndexedMemory> index, const std::filesystem::path& memory,
          const TrackerOptions& options = {});
  ~Tracker();
  /// A moved-from object may only be destroyed or assigned to.
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  /// Restarts with an unknown pose (`MonteCarloLocaliser::start_globally`).
  void start_globally(std::optional<double> heading_rad = std::nullopt);
  /// Starts around a known pose, in the frame of the memory's positions.
  void start_at(const Pose2& pose, double deviation_m, double heading_deviation_rad);

  /// Moves the particles (`move`) and updates the estimate by the image. An observation without
  /// odometry causes no motion if they were moved since the last image. Throws like `move` and
  /// `ViewEncoder::panorama`.
  MonteCarloEstimate observe(const Observation& observation);
  /// Updates the estimate by an image, without motion. Another thread may have encoded the image
  /// with `encoder()`.
  MonteCarloEstimate observe(const PackedSignature& view);
  /// True if the pictures are narrow ones (`TrackerOptions::source`).
  [[nodiscard]] bool takes_narrow_pictures() const noexcept;
  /// Localises a narrow picture by itself. Several threads may call at a time. Throws as
  /// `PlaceRecogniser::localise`; ContractError unless pictures are narrow.
  [[nodiscard]] Place localise(const Observation& observation) const;
  /// Updates the estimate by the answer to a narrow picture (`localise`), without motion.
  MonteCarloEstimate observe(const Place& place);
  /// Moves the particles to the next image: by its odometry (`move_to`), or, without it or if
  /// positions are in view steps, by its view (`move_by_image`). Throws like these, and
  /// ContractError if the view is needed (`needs_view`) but null.
  void move(const std::optional<Pose2>& odometry, const FourierSignature* view);
  /// Fills pauses of odometry in a recorded run by its images (`bridge_odometry_pauses`), before it
  /// is tracked: then both ends of a pause are known. Nothing is filled if positions are in view
  /// steps. Throws as `ViewEncoder::signature`.
  void bridge_pauses(Dataset& run, Executor& executor) const;
  /// True if `move` to an entry needs its view.
  [[nodiscard]] bool needs_view(std::span<const DatasetEntry> entries, std::size_t index) const;
  /// Moves the particles by the difference from the last odometry, and from the motion read from
  /// images since then. The first call stores it, and moves them by the view if there is one and
  /// images came before. `odometry`: absolute, in its own frame. `view`: of the same image, from
  /// which `move_by_image` may then continue; null: unknown. Throws ContractError beyond
  /// `max_position_m`, and if the memory's positions are in view steps.
  void move_to(const Pose2& odometry, const FourierSignature* view = nullptr);
  /// Moves the particles by the motion from the last image to this one, read from both; spreads
  /// them by the mean length of the other steps if it cannot be read; only stores the view if the
  /// last one is not known. Call it before `observe` for images that were encoded with
  /// `encoder()`. The first call computes the metric scale from views with known positions; from a
  /// memory that is not held, it loads at most `max_learnt_views` for this. Throws ContractError
  /// unless the signature has three components or more; FileError if the server cannot be reached.
  /// Cost: that of `visual_step`; of the first call, linear in the views.
  void move_by_image(const FourierSignature& view);
  /// Returns the pose of the last image in the frame of the odometry, measured or continued by the
  /// images; nullopt before the first odometry.
  [[nodiscard]] const std::optional<Pose2>& odometry() const noexcept;
  /// Returns the unit of all positions, of the memory and of the estimates.
  [[nodiscard]] LengthUnit length_unit() const noexcept;
  /// Returns the motion that was read from the images; null if none was.
  [[nodiscard]] const VisualOdometry* visual_odometry() const noexcept;

  /// Reads changes that other programs made to a memory that is not held; keeps the particles.
  /// Returns true if anything changed; always false if the memory is held. Throws FileError,
  /// without any change, if the server cannot be reached. Cost: a query to the server, and a pass
  /// over the positions if views were added or removed.
  bool refresh();

  /// True if all views are held in RAM.
  [[nodiscard]] bool is_memory_held() const noexcept;
  /// Returns the views. Throws ContractError if they are not held in RAM (`is_memory_held`).
  [[nodiscard]] const VisualMemory& memory() const;
  /// Returns the floor of the last estimated position; before the first, that of the memory's first
  /// view with a position. The functions below use it and its frame, as does `start_at`.
  [[nodiscard]] const std::string& floor() const noexcept;
  /// Returns the particles on the floor.
  [[nodiscard]] Particles particles() const;
  /// Returns the view on the floor that is nearest to the position.
  [[nodiscard]] ViewId find_nearest_view(Point2 position) const;
  /// Returns the views with positions on the floor, ascending. Throws FileError like `index`.
  [[nodiscard]] std::vector<PosedView> posed_views() const;
  /// Opens an index of the views for one query. Throws FileError if the server cannot be reached.
  [[nodiscard]] std::unique_ptr<ViewIndex> index() const;
  [[nodiscard]] const ViewEncoder& encoder() const noexcept;  ///< Returns the encoder.
  /// Returns the filter, with its particles and its observation model.
  [[nodiscard]] const MonteCarloLocaliser& localiser() const noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
