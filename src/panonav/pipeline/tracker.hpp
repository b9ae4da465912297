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

/// Options for following a robot.
struct TrackerOptions {
  MonteCarloOptions filter;  ///< how particles are sampled and weighted
  OdometryNoise odometry;    ///< errors of the wheel odometry
  /// Layout of the pictures; empty: that of the memory's own.
  std::optional<PictureSource> source;
  /// A memory on a server with more views is not held: the server is searched for each image. Files
  /// are held.
  std::size_t max_held_views = 200'000;
  /// Largest number of views from which the model of a memory that is not held is learnt, if it
  /// stores none; as many whole areas as fit.
  std::size_t max_learnt_views = 20'000;
};

/// Follows a moving robot through its pictures and odometry by a memory file
/// (`MonteCarloLocaliser`):
///   panonav::Tracker tracker("office.panonav");
///   const auto estimate = tracker.observe(observation);
///   if (estimate.state == panonav::LocalisationState::localised) use(*estimate.pose);
/// Pictures become signatures as the file says, and the observation model is that of the file
/// (`learn_and_store_models`); one that does not fit the views any more is learnt again. Holds the
/// whole memory, unless it lies on a server and is larger than `max_held_views`; a file is not
/// needed afterwards. Same views, options and observations: same bits.
class Tracker {
 public:
  /// Starts with the robot anywhere in the memorised area. Throws FileError if the file is missing
  /// or damaged, or if too few of its views have a position; OptionError.
  explicit Tracker(const std::filesystem::path& memory, const TrackerOptions& options = {});
  /// Uses an open file.
  explicit Tracker(const MemoryFile& file, const TrackerOptions& options = {});
  /// Tracks in a memory that is not held; `memory` is its address or file. Throws as above.
  Tracker(std::unique_ptr<IndexedMemory> index, const std::filesystem::path& memory,
          const TrackerOptions& options = {});
  ~Tracker();
  /// A moved-from object may only be destroyed or assigned to.
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  /// Forgets the robot's pose (`MonteCarloLocaliser::start_globally`).
  void start_globally(std::optional<double> heading_rad = std::nullopt);
  /// Starts around a known pose, in the frame of the memory's positions.
  void start_at(const Pose2& pose, double deviation_m, double heading_deviation_rad);

  /// Moves by the odometry, if the observation has one, and updates the estimate from the image.
  /// Throws as `ViewEncoder::panorama`, after the motion was applied.
  MonteCarloEstimate observe(const Observation& observation);
  /// Updates the estimate from an image alone, encoded by `encoder()` on another thread.
  MonteCarloEstimate observe(const PackedSignature& view);
  /// Moves the robot by the difference from the previous odometry; the first call only sets it.
  /// `odometry`: absolute, in its own frame. Throws ContractError beyond `max_position_m`.
  void move_to(const Pose2& odometry);

  /// Takes over what others changed in a memory that is not held; the particles stay. Returns
  /// whether anything changed; never for one that is held. Throws FileError if the server cannot be
  /// reached; then all stays as it was. Cost: a question to the server, and a pass over the
  /// positions if views came or went.
  bool refresh();

  /// True if all views are held.
  [[nodiscard]] bool is_held() const noexcept;
  /// Returns the held views. Throws ContractError if they are not held.
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
