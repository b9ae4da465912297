#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/pipeline/memory_map.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Data of a view except its signature and its image.
struct ViewRecord {
  ViewId view;             ///< its id in the file
  ReferenceInfo info;      ///< name, pose and stamp
  std::size_t links = 0;   ///< number of links to other views of the file
  bool thumbnail = false;  ///< true: a thumbnail is stored with the view
  /// Number of the connected component in the map named "map", else in the file's first map;
  /// nullopt without a map, and for views that are not in the map.
  std::optional<std::size_t> component;
  friend bool operator==(const ViewRecord&, const ViewRecord&) = default;
};

/// Returns all views of the file, ascending. Throws FileError on damage. Cost: that of
/// `MemoryFile::load`, but only the returned records are held.
[[nodiscard]] std::vector<ViewRecord> list_views(const MemoryFile& file);

/// Returns the table of views as CSV (docs/formats.md, section "Tables of views"): a header and one
/// line for each view. `pictures`: empty, or the name of each view's image file (empty string: no
/// image). `unit`: of the positions (`read_length_unit`); in view steps the columns are "x_steps"
/// and "y_steps".
[[nodiscard]] std::string format_view_table(std::span<const ViewRecord> views, LengthUnit unit,
                                            std::span<const std::string> pictures = {});

/// Returns the view with this name, as it is printed or by the bytes for which escapes stand
/// (`escape_name`); nullopt if there is none.
[[nodiscard]] std::optional<ViewId> find_view_by_name(const MemoryFile& file,
                                                      const std::string& name);
/// Returns the view with this name (`find_view_by_name`), or else with this id. Throws FileError if
/// there is no such view.
[[nodiscard]] ViewId find_view_by_name_or_id(const MemoryFile& file, const std::string& name_or_id);

}  // namespace panonav
