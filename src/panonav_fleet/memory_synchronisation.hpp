#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "panonav_fleet/memory_changes.hpp"

namespace panonav::fleet {

/// Options for synchronising a memory.
struct SynchronisationOptions {
  /// Areas of the file: views outside of them are not downloaded, and are removed from the file
  /// once the server has them. Views without a position stay where they are. Empty: all areas.
  std::optional<std::vector<MemoryArea>> areas;
};

/// Counts of the changes that `synchronise_memory` made.
struct SynchronisationReport {
  std::size_t views = 0;              ///< number of views of the file afterwards
  std::size_t uploaded = 0;           ///< number of views that the server got
  std::size_t downloaded = 0;         ///< views that the file got
  std::size_t adopted = 0;            ///< views that both had already, by name and signature
  std::size_t updated_on_server = 0;  ///< views with another name, pose or stamp there
  std::size_t updated_in_file = 0;    ///< the same of the file
  std::size_t removed_on_server = 0;  ///< views that the file had removed
  std::size_t removed_in_file = 0;    ///< views that others had removed
  std::size_t renamed = 0;            ///< views of the file whose names were used
  /// Number of changes of the file that were dropped, as others had changed or removed the view
  /// first.
  std::size_t conflicts = 0;
  /// Number of changes that stay in the file alone, as the login may not make them on the server.
  std::size_t withheld = 0;
  std::size_t left = 0;            ///< views removed from the file as they are outside of its areas
  std::size_t links_uploaded = 0;  ///< added, changed and removed on the server
  std::size_t links_downloaded = 0;  ///< added, changed and removed in the file
  /// True if the server was older than its acknowledgements, as after a restored backup; the lost
  /// views were uploaded again.
  bool restored = false;
  double seconds = 0.0;  ///< from the beginning to the end
  friend bool operator==(const SynchronisationReport&, const SynchronisationReport&) = default;
};

/// Returns the areas that touch the circle of this radius (>= 0) around a position, ascending.
/// Throws ContractError on numbers that are not finite, and on more than a million areas.
[[nodiscard]] std::vector<MemoryArea> areas_around(double x_m, double y_m, double radius_m);

/// Brings a memory file and one on a server to the same views, links, names and poses, and makes
/// the missing one. Not synchronised: maps, routes, parameters, `undo`. Uses no clock.
///
/// The change that the server acknowledged first holds; a removal wins over a change; a used name
/// becomes "ROBOT/NAME" (the address's `robot`, or the login). After any failure nothing is lost or
/// doubled; the next call continues. What the login may not change stays local.
///
/// `advance` gets the number of all views, for each transferred one. Throws FileError: unreadable
/// or unwritable, damaged, a file of another memory; ContractError: views of different shape,
/// addresses of the wrong kind. Cost: all checksums, a few messages, the changed bytes.
SynchronisationReport synchronise_memory(const std::filesystem::path& file,
                                         const std::filesystem::path& server,
                                         const SynchronisationOptions& options = {},
                                         const std::function<void(std::size_t)>& advance = {});

}  // namespace panonav::fleet
