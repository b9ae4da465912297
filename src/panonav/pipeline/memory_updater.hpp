#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include "panonav/localisation/memory_update.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/pipeline/observation.hpp"

namespace panonav {

/// Keeps a memory file true while its places change: hears what a robot saw on a run and what the
/// memory answered, and at the end changes the file (`MemoryUpdate`):
///   panonav::MemoryUpdater updater("office.panonav");
///   updater.see(observation, panorama, recogniser.localise(observation));
///   updater.finish("update from monday");
/// All changes of a run are one transaction, which `MemoryFile::undo` takes back. A run in which
/// the robot's place was never certain leaves the file as it was. Holds what localisation holds of
/// the memory, once more, and 10 kB a picture of at most 128 pictures and of those that are added.
class MemoryUpdater {
 public:
  /// The file can be written and has views enough with positions and headings to learn an
  /// `ObservationModel`. Throws FileError when not; OptionError.
  explicit MemoryUpdater(const std::filesystem::path& memory,
                         const MemoryUpdateOptions& options = {});
  ~MemoryUpdater();
  /// A moved-from object may only be destroyed or assigned to.
  MemoryUpdater(MemoryUpdater&&) noexcept;
  MemoryUpdater& operator=(MemoryUpdater&&) noexcept;

  /// The next observation, which needs its odometry (another says nothing and is left out), with
  /// its panorama of the memory's shape and the answer of the memory. Throws ContractError on
  /// another shape and after `finish`.
  void see(const Observation& observation, const Panorama& panorama, const Place& place);
  /// The observation seen last is so near to one whose place was surely known that the update will
  /// place it by odometry.
  [[nodiscard]] bool is_near_known_place() const;

  /// Changes that a run made to its memory.
  struct Changes {
    std::size_t seen = 0;        ///< observations with odometry
    std::size_t certain = 0;     ///< of these, whose place was certain and new
    std::size_t reinforced = 0;  ///< views of the memory that explained what the robot saw
    std::size_t added = 0;       ///< views of this run
    std::size_t replaced = 0;    ///< views that were dropped for added ones
    std::size_t forgotten = 0;   ///< views that were dropped because they had failed for long
    std::size_t views = 0;       ///< of the memory now
  };
  /// Changes the file and learns its models again, in one transaction. `what`: the run, for the
  /// history. Once. Throws FileError; the file is as it was then. Throws ContractError the second
  /// time.
  Changes finish(const std::string& what);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// "12 views added, 3 replaced, 1 forgotten, 40 reinforced".
[[nodiscard]] std::string as_text(const MemoryUpdater::Changes& changes);

}  // namespace panonav
