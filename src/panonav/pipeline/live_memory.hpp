#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/memory_updater.hpp"
#include "panonav/pipeline/place_recogniser.hpp"

namespace panonav {

/// Options for the answers and changes of a live memory. Without `add` and `update` the file is
/// only read.
struct LiveMemoryOptions {
  bool add = false;  ///< Add the views of places that the memory does not know.
  /// Keep the views of known places up to date (`MemoryUpdater`) by observations with odometry.
  /// Where views are added, too, a memory with few positions and headings only grows.
  bool update = false;
  MemoryUpdateOptions update_options;  ///< of views at known places
  /// Minimum time between two added views. Until the memory has learnt from a view, the following
  /// images look as new as that one did. Applies to observations with stamps.
  double min_interval_s = 0.5;
  /// Store views, and learn models from them, before the next observation is answered, so that the
  /// same observations give the same bits. Otherwise both happen concurrently on threads of lower
  /// priority.
  bool in_step = false;
  MemoriserOptions memoriser;  ///< of views that are added; its source is that of all pictures
  LocaliserOptions localiser;  ///< of the answers
  /// Compute also the area where the robot may be (`PlaceRecogniserOptions::areas`); not with
  /// `add`.
  std::optional<LocalisationAccuracy> areas;
  /// Hold a large memory on a server, too (`PlaceRecogniserOptions::max_held_views`). A memory that
  /// is added to or updated is always held.
  bool hold = false;
};

/// Memorises and localises at the same time, for robots that explore new places:
///   panonav::LiveMemory memory("walk.panonav", {.add = true, .memoriser = {.source = source}});
///   while (auto observation = source.next()) use(memory.answer(*observation));
///   memory.finish();
/// A view that was added is found from the next observation on. What is learnt of all views (models
/// of places and positions) is learnt again whenever a quarter of them is new.
class LiveMemory {
 public:
  /// Throws as `Memoriser`, `MemoryUpdater` and `PlaceRecogniser`; FileError when there is no file
  /// and nothing is to be added; ContractError on areas of a memory that is added to.
  explicit LiveMemory(std::filesystem::path memory, const LiveMemoryOptions& options = {});
  ~LiveMemory();
  /// A moved-from object may only be destroyed or assigned to.
  LiveMemory(LiveMemory&&) noexcept;
  LiveMemory& operator=(LiveMemory&&) noexcept;

  /// Holds the answer to an observation.
  struct Answer {
    /// Place; empty while there is no memory: a new one begins with `Memoriser::scale_views` views.
    std::optional<Place> place;
    /// True if the place was new; then `add` adds the observation as a view.
    bool is_new = false;
    std::chrono::steady_clock::duration unwrapping{};  ///< how long it took
  };
  /// Localises an observation. Does not write: `add` does. Throws as `PlaceRecogniser::localise`.
  [[nodiscard]] Answer answer(const Observation& observation);
  /// Adds the observation that was answered last if its place was new. Its name must be unique.
  /// With `in_step` the view is on the disk on return, but for the first ones of a new file; else
  /// soon after: while `max_waiting` views wait for a slow disk, no observation is new. Throws as
  /// `Memoriser::add`, also about views of earlier calls.
  void add(Observation observation);
  static constexpr std::size_t max_waiting = 8;  ///< Views that wait for the disk at most.
  /// Returns the panorama of the last answered observation, until it is added; empty while there is
  /// no memory.
  [[nodiscard]] const std::optional<Panorama>& panorama() const noexcept;

  /// Returns the present recogniser; null while there is no memory. Valid until the next `answer`.
  [[nodiscard]] const PlaceRecogniser* recogniser() const noexcept;
  /// Returns the number of views that can be found now.
  [[nodiscard]] std::size_t views() const noexcept;
  /// Returns the number of views added since the start, waiting ones included.
  [[nodiscard]] std::size_t added() const noexcept;
  /// Writes waiting views, updates the views that the run has shown to have changed, and stores the
  /// models; does nothing if nothing was added and no place was certain. `what`: name of the run in
  /// the history. Returns the changes of the update; empty without one. Throws as `add`.
  std::optional<MemoryUpdater::Changes> finish(const std::string& what = "update");

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
