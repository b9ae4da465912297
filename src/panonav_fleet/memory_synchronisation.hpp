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
  /// Areas that the file keeps. Views outside of them are not downloaded, and are removed from the
  /// file once the server has them. Views without a position are not affected. nullopt: all areas.
  std::optional<std::vector<MemoryArea>> areas;
};

/// Counts of the changes that `synchronise_memory` made.
struct SynchronisationReport {
  std::size_t views = 0;              ///< number of views of the file afterwards
  std::size_t uploaded = 0;           ///< new views on the server
  std::size_t downloaded = 0;         ///< new views in the file
  std::size_t adopted = 0;            ///< views that both had, by name and signature
  std::size_t updated_on_server = 0;  ///< views with another name, pose or stamp there
  std::size_t updated_in_file = 0;    ///< the same in the file
  std::size_t removed_on_server = 0;  ///< views that the file had removed
  std::size_t removed_in_file = 0;    ///< views that others had removed
  std::size_t renamed = 0;            ///< views of the file whose names were used
  /// Number of changes of the file that were dropped because others had changed or removed the view
  /// first.
  std::size_t conflicts = 0;
  /// Number of changes that stay only in the file because the login may not make them on the
  /// server.
  std::size_t withheld = 0;
  std::size_t left = 0;              ///< views removed from the file: outside its areas
  std::size_t links_uploaded = 0;    ///< added, changed and removed on the server
  std::size_t links_downloaded = 0;  ///< added, changed and removed in the file
  /// True if the server had lost acknowledged changes, as after a restored backup; lost views were
  /// uploaded again.
  bool restored = false;
  double seconds = 0.0;  ///< duration of the synchronisation
  friend bool operator==(const SynchronisationReport&, const SynchronisationReport&) = default;
};

/// Returns the areas that touch the circle of this radius (>= 0) around a position, ascending.
/// Throws ContractError on numbers that are not finite, and on more than a million areas.
[[nodiscard]] std::vector<MemoryArea> areas_around(double x_m, double y_m, double radius_m);

/// Gives a memory file and a memory on a server the same views, links, names and poses; creates
/// either if it is missing. Not synchronised: maps, routes, parameters, `undo`. No clocks:
///
/// The change that the server acknowledged first stays; a removal has priority over a change; a
/// name in use becomes "ROBOT/NAME" (the address's `robot`, or the login). After any failure
/// nothing is lost or duplicated, and the next call continues.
///
/// Calls `advance` for each transferred view with their total number. Throws FileError if either is
/// damaged or cannot be read or written, or belongs to another memory; ContractError on views of
/// another shape or an address of the wrong kind. Cost: reading all checksums, a few messages, and
/// changes.
SynchronisationReport synchronise_memory(const std::filesystem::path& file,
                                         const std::filesystem::path& server,
                                         const SynchronisationOptions& options = {},
                                         const std::function<void(std::size_t)>& advance = {});

}  // namespace panonav::fleet
