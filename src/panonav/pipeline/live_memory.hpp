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

/// Options for the answers and changes of a live memory. Without `add` and `update`, the file is
/// not changed.
struct LiveMemoryOptions {
  bool add = false;  ///< Add the views of places that the memory does not know.
  /// Update the views of known places (`MemoryUpdater`) by observations with odometry. Together
  /// with `add`, a memory of too few views with headings is not updated.
  bool update = false;
  MemoryUpdateOptions update_options;  ///< options for updating known places
  /// Minimum time between two added views, because the images directly after an added view still
  /// seem new until the memory has learnt from it. Applies to observations with stamps.
  double min_interval_s = 0.5;
  /// Store views and learn models before the next observation is answered, so that the same
  /// observations give the same bits. Otherwise storing and learning run concurrently on threads of
  /// lower priority.
  bool in_step = false;
  MemoriserOptions memoriser;  ///< options for added views; its source applies to all pictures
  LocaliserOptions localiser;  ///< options for localising
  /// Also compute areas in which the robot may be (`PlaceRecogniserOptions::areas`); not together
  /// with `add`.
  std::optional<LocalisationAccuracy> areas;
  /// Hold the whole memory in RAM even if it is large and on a server
  /// (`PlaceRecogniserOptions::max_held_views`). Always true with `add` or `update`.
  bool hold = false;
};

/// Memorises and localises at the same time, for robots that explore new places:
///   panonav::LiveMemory memory("walk.panonav", {.add = true, .memoriser = {.source = source}});
///   while (auto observation = source.next()) use(memory.answer(*observation));
///   memory.finish();
/// An added view can be found from the next observation on. The models of places and positions are
/// learnt again when at least a fifth of the views is new.
class LiveMemory {
 public:
  /// Throws like `Memoriser`, `MemoryUpdater` and `PlaceRecogniser`; FileError if there is no file
  /// and `add` is false; ContractError on `areas` together with `add`.
  explicit LiveMemory(std::filesystem::path memory, const LiveMemoryOptions& options = {});
  ~LiveMemory();
  /// A moved-from object may only be destroyed or assigned to.
  LiveMemory(LiveMemory&&) noexcept;
  LiveMemory& operator=(LiveMemory&&) noexcept;

  /// Holds the answer to an observation.
  struct Answer {
    /// Place; nullopt while there is no memory. A new memory exists from `Memoriser::scale_views`
    /// views on.
    std::optional<Place> place;
    /// True if the place is new, so that the caller should `add` the observation.
    bool is_new = false;
    std::chrono::steady_clock::duration unwrapping{};  ///< how long it took
  };
  /// Localises an observation; only `add` writes to the memory. Throws as
  /// `PlaceRecogniser::localise`.
  [[nodiscard]] Answer answer(const Observation& observation);
  /// Adds an observation as a view; call it after `answer` if `Answer::is_new`. The name must be
  /// unique. With `in_step`, the view is on the disk on return, except the first views of a new
  /// file; otherwise soon afterwards. While `max_waiting` views wait for a slow disk, no
  /// observation is new. Throws like `Memoriser::add`, also for views of earlier calls.
  void add(Observation observation);
  static constexpr std::size_t max_waiting = 8;  ///< Largest number of waiting views.
  /// Returns the panorama of the last answered observation; nullopt after it was added, and while
  /// there is no memory.
  [[nodiscard]] const std::optional<Panorama>& panorama() const noexcept;

  /// Returns the present recogniser; null while there is no memory. Valid until the next `answer`.
  [[nodiscard]] const PlaceRecogniser* recogniser() const noexcept;
  /// Returns the number of views that can be found now.
  [[nodiscard]] std::size_t views() const noexcept;
  /// Returns the number of views added since the start, waiting ones included.
  [[nodiscard]] std::size_t added() const noexcept;
  /// Writes waiting views, updates views of places whose appearance has changed during the run, and
  /// stores the models. Does nothing if no view was added and no place was certain. `what`: name of
  /// the run in the history. Returns the changes of the update; nullopt without an update. Throws
  /// like `add`.
  std::optional<MemoryUpdater::Changes> finish(const std::string& what = "update");

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
