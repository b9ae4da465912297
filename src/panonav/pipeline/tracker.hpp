#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

#include "panonav/localisation/monte_carlo.hpp"
#include "panonav/memory/view_index.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Options for tracking a robot.
struct TrackerOptions {
  MonteCarloOptions filter;  ///< how particles are sampled and weighted
  OdometryNoise odometry;    ///< errors of the wheel odometry
  /// Layout of the pictures; nullopt: that of the memory.
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
/// Uses the settings of the memory for signatures, and its stored observation model
/// (`learn_and_store_models`), or learns a new one if the views have changed since. Holds the whole
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

  /// Moves the particles by the odometry, if the observation has any, and updates the estimate by
  /// the image. Throws like `ViewEncoder::panorama`, after the motion was applied.
  MonteCarloEstimate observe(const Observation& observation);
  /// Updates the estimate by an image without odometry. Another thread may have encoded the image
  /// with `encoder()`.
  MonteCarloEstimate observe(const PackedSignature& view);
  /// Moves the particles by the difference from the last odometry; the first call only stores it.
  /// `odometry`: absolute, in its own frame. Throws ContractError beyond `max_position_m`.
  void move_to(const Pose2& odometry);

  /// Reads changes that other programs made to a memory that is not held; keeps the particles.
  /// Returns true if anything changed; always false if the memory is held. Throws FileError,
  /// without any change, if the server cannot be reached. Cost: a query to the server, and a pass
  /// over the positions if views were added or removed.
  bool refresh();

  /// True if all views are held in RAM.
  [[nodiscard]] bool is_memory_held() const noexcept;
  /// Returns the views. Throws ContractError if they are not held in RAM (`is_memory_held`).
  [[nodiscard]] const VisualMemory& memory() const;
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
