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
/// All changes of a run are one transaction, which `MemoryFile::undo` reverts. If the robot's place
/// was never certain, the file stays unchanged. Holds the whole memory in RAM, and 10 kB for
/// each of at most 128 pictures and each added one.
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

  /// Adds the next observation with its panorama, which must have the memory's shape, and its place
  /// by the recogniser. Ignores observations without odometry. Throws ContractError on another
  /// shape and after `finish`.
  void observe(const Observation& observation, const Panorama& panorama, const Place& place);
  /// True if the last observation is so near to an earlier one with a certain place that the update
  /// will locate it by odometry.
  [[nodiscard]] bool is_near_known_place() const;

  /// Changes that a run made to its memory.
  struct Changes {
    std::size_t observations = 0;  ///< observations with odometry
    std::size_t sure = 0;          ///< observations localised with a probability of 0.9 or more
    std::size_t certain =
        0;  ///< observations whose place was certain, without repeated ones at one place
    std::size_t reinforced = 0;  ///< views of the memory that matched an observation at their place
    std::size_t added = 0;       ///< views added from this run
    std::size_t replaced = 0;    ///< views removed in exchange for added ones
    std::size_t forgotten = 0;   ///< views removed because they failed to match in many runs
    std::size_t views = 0;       ///< number of views of the memory afterwards
  };
  /// Changes the file and learns its models again, in one transaction. `what`: name of the run in
  /// the history. Throws FileError, with the file unchanged; ContractError on a second call.
  Changes finish(const std::string& what);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Explains for people why no place was certain, so that the memory is unchanged; empty if one was.
[[nodiscard]] std::string explain_uncertainty(const MemoryUpdater::Changes& changes);
/// Returns "12 views added, 3 replaced, 1 forgotten, 40 reinforced".
[[nodiscard]] std::string summarise(const MemoryUpdater::Changes& changes);

}  // namespace panonav
