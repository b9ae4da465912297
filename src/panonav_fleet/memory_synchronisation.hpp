#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "panonav_fleet/memory_changes.hpp"

namespace panonav::fleet {

/// Which part of a server's memory a robot's file holds.
struct SynchronisationOptions {
  /// Views that lie in none of these areas are not taken from the server, and leave the file once
  /// the server has them. Views without a position stay where they are. Empty: all areas.
  std::optional<std::vector<MemoryArea>> areas;
};

/// Counts of what `synchronise_memory` did.
struct SynchronisationReport {
  std::size_t views = 0;              ///< of the file, afterwards
  std::size_t uploaded = 0;           ///< views that the server got
  std::size_t downloaded = 0;         ///< views that the file got
  std::size_t adopted = 0;            ///< views that both had already, by name and signature
  std::size_t updated_on_server = 0;  ///< views with another name, pose or stamp there
  std::size_t updated_in_file = 0;    ///< the same of the file
  std::size_t removed_on_server = 0;  ///< views that the file had removed
  std::size_t removed_in_file = 0;    ///< views that others had removed
  std::size_t renamed = 0;            ///< views of the file whose names others had
  /// Changes of the file that were dropped, because others had changed or removed the view first.
  std::size_t conflicts = 0;
  /// Changes of the file that stay in it alone, because the login may not make them there.
  std::size_t withheld = 0;
  std::size_t left = 0;              ///< views that left the file, as they lie outside of its areas
  std::size_t links_uploaded = 0;    ///< added, changed and removed on the server
  std::size_t links_downloaded = 0;  ///< added, changed and removed in the file
  /// The server was found to be older than what it had acknowledged, as after a restored backup:
  /// what it had lost was uploaded again.
  bool restored = false;
  double seconds = 0.0;  ///< from the beginning to the end
  friend bool operator==(const SynchronisationReport&, const SynchronisationReport&) = default;
};

/// The areas that touch the circle of this radius (>= 0) around a position, ascending. Throws
/// ContractError on numbers that are not finite, and on more than a million areas.
[[nodiscard]] std::vector<MemoryArea> areas_around(double x_m, double y_m, double radius_m);

/// Brings a robot's memory file and a memory on a server to the same views, links, names and poses.
/// Where one of the two is missing, it is made like the other. The file may be used without the
/// server for any time before, also by other programs. Maps, routes, parameters and `undo` are not
/// synchronised; no clock is used.
///
/// The change that the server acknowledged first holds, a removal wins over a change, and a name
/// that another view has becomes "ROBOT/NAME" (the address's `robot`, or the login). Each step is
/// one transaction on its side: after any failure nothing is lost or doubled, and the next call
/// continues. What the login may not change stays in the file.
///
/// `advance` is called for each transferred view, with the number of all. Throws FileError: a file
/// or memory that cannot be read or written, a damaged row, a file that belongs to another memory;
/// ContractError when views cannot be compared, or `file` is an address or `server` a path. Cost: a
/// comparison of all checksums on both sides, a few messages, and the bytes of what changed.
SynchronisationReport synchronise_memory(const std::filesystem::path& file,
                                         const std::filesystem::path& server,
                                         const SynchronisationOptions& options = {},
                                         const std::function<void(std::size_t)>& advance = {});

}  // namespace panonav::fleet
