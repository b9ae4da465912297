#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Data of a view besides its signature.
struct ViewRecord {
  ViewId view;             ///< its id in the file
  ReferenceInfo info;      ///< name, pose and stamp
  std::size_t links = 0;   ///< to other views of the file
  bool thumbnail = false;  ///< a picture is stored with it
  /// Connected component in the map called `map`, else in the file's first map; empty without a
  /// map, and for views that are not in it.
  std::optional<std::size_t> component;
  friend bool operator==(const ViewRecord&, const ViewRecord&) = default;
};

/// Returns all views of the file, ascending. Throws FileError on damage. Cost: that of
/// `MemoryFile::load`.
[[nodiscard]] std::vector<ViewRecord> list_views(const MemoryFile& file);

/// Returns the table of views (docs/formats.md, section "Tables of views"): a header and one line
/// for each view. `pictures`: empty, or for each view the file that holds its image; empty if none
/// does.
[[nodiscard]] std::string format_view_table(std::span<const ViewRecord> views,
                                            std::span<const std::string> pictures = {});

/// Returns the view that a user names: by name first, else by id. Throws FileError that names the
/// file if there is no such view.
[[nodiscard]] ViewId find_view_by_name_or_id(const MemoryFile& file, const std::string& name_or_id);

}  // namespace panonav
