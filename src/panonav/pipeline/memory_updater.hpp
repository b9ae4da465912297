#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include "panonav/localisation/memory_update.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/pipeline/observation.hpp"

namespace panonav {

/// Keeps a memory file up to date while its places change: receives the observations of a run and
/// the answers of the memory, and at the end changes the file (`MemoryUpdate`):
///   panonav::MemoryUpdater updater("office.panonav");
///   updater.observe(observation, panorama, recogniser.localise(observation));
///   updater.finish("update from monday");
/// All changes of a run are one transaction, which `MemoryFile::undo` takes back. A run in which
/// the robot's place was never certain leaves the file as it was. Holds the memory as
/// localisation does, and 10 kB a picture of at most 128 pictures and of those that are added.
class MemoryUpdater {
 public:
  /// Throws FileError if the file cannot be written or has too few views with positions and
  /// headings to learn an `ObservationModel`; OptionError.
  explicit MemoryUpdater(const std::filesystem::path& memory,
                         const MemoryUpdateOptions& options = {});
  ~MemoryUpdater();
  /// A moved-from object may only be destroyed or assigned to.
  MemoryUpdater(MemoryUpdater&&) noexcept;
  MemoryUpdater& operator=(MemoryUpdater&&) noexcept;

  /// Adds the next observation with its panorama, which has the memory's shape, and the memory's
  /// answer. Observations without odometry are ignored. Throws ContractError on another shape and
  /// after `finish`.
  void observe(const Observation& observation, const Panorama& panorama, const Place& place);
  /// True if the last observation is near enough to one with a certain place that the update will
  /// place it by odometry.
  [[nodiscard]] bool is_near_known_place() const;

  /// Changes that a run made to its memory.
  struct Changes {
    std::size_t observations = 0;  ///< observations with odometry
    std::size_t certain =
        0;  ///< of these, those whose place was certain and differed from the last certain one
    std::size_t reinforced = 0;  ///< views of the memory that matched what the robot observed
    std::size_t added = 0;       ///< views added from this run
    std::size_t replaced = 0;    ///< views removed in exchange for added ones
    std::size_t forgotten = 0;   ///< views removed because they had not matched for long
    std::size_t views = 0;       ///< views of the memory afterwards
  };
  /// Changes the file and learns its models again, in one transaction. `what`: name of the run in
  /// the history. Throws FileError and then leaves the file unchanged; ContractError on a second
  /// call.
  Changes finish(const std::string& what);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Returns "12 views added, 3 replaced, 1 forgotten, 40 reinforced".
[[nodiscard]] std::string summarise(const MemoryUpdater::Changes& changes);

}  // namespace panonav
