#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/memory/floors.hpp"
#include "panonav/storage/internal/memory_schema.hpp"
#include "panonav/storage/internal/sqlite_tables.hpp"

// Lists and numbers of the views. The indexes of names and poses also have the ids, and take far
// fewer pages than the table.

namespace panonav {

namespace {

std::optional<ReferencePose> read_pose(const Statement& row, int first) {
  if (row.is_null(first) || row.is_null(first + 1)) return std::nullopt;
  ReferencePose pose{row.real(first), row.real(first + 1), std::nullopt};
  if (!row.is_null(first + 2)) pose.heading_rad = row.real(first + 2);
  return pose;
}

}  // namespace

std::vector<std::string> SqliteTables::names() {
  std::vector<std::string> names;
  Statement rows(database_, "SELECT name, id FROM views ORDER BY id");
  std::int64_t before = 0;
  while (rows.step()) {
    if (rows.integer(1) <= before) fail_damaged("views are out of order");
    before = rows.integer(1);
    names.emplace_back(rows.text(0));
  }
  return names;
}

std::vector<ViewId> SqliteTables::views() {
  std::vector<ViewId> views;
  // The index of the names also has the ids, and on far fewer pages than the table.
  Statement ids(database_, "SELECT id FROM views INDEXED BY sqlite_autoindex_views_1");
  while (ids.step()) views.push_back(read_view_id(ids, 0));
  std::ranges::sort(views);
  return views;
}

std::vector<PosedView> SqliteTables::views_within(const PositionBounds& bounds) {
  std::vector<PosedView> views;
  Statement rows(database_,
                 "SELECT id, x_m, y_m, heading_rad FROM views WHERE x_m BETWEEN ? AND ? AND y_m "
                 "BETWEEN ? AND ? ORDER BY id",
                 bounds.min_x_m, bounds.max_x_m, bounds.min_y_m, bounds.max_y_m);
  while (rows.step()) {
    views.push_back({read_view_id(rows, 0), read_pose(rows, 1).value_or(ReferencePose{})});
  }
  return views;
}

std::vector<MemoryFile::ViewPlace> SqliteTables::places() {
  std::vector<MemoryFile::ViewPlace> places;
  Statement poses(database_, "SELECT id, x_m, y_m, heading_rad FROM views INDEXED BY views_pose");
  while (poses.step()) places.push_back({read_view_id(poses, 0), {}, read_pose(poses, 1)});
  std::ranges::sort(places, {}, &MemoryFile::ViewPlace::view);
  // Names of views on a floor begin with "floor=" (`floor_of`); '>' follows '='.
  Statement names(database_,
                  "SELECT id, name FROM views INDEXED BY sqlite_autoindex_views_1 WHERE name >= "
                  "'floor=' AND name < 'floor>'");
  while (names.step()) {
    const auto place =
        std::ranges::lower_bound(places, read_view_id(names, 0), {}, &MemoryFile::ViewPlace::view);
    if (place != places.end() && place->view == read_view_id(names, 0)) {
      place->floor = floor_of(names.text(1));
    }
  }
  return places;
}

MemoryFile::Counts SqliteTables::counts() {
  // The condition makes SQLite step through the rows, which the step limit bounds, instead of
  // counting the entries of pages, which has no limit.
  Statement row(database_,
                "SELECT count(*), count(x_m), count(heading_rad) FROM views INDEXED BY views_pose "
                "WHERE id > 0");
  if (!row.step()) database_.fail_damaged("table views");
  const auto count = [&](int column) { return static_cast<std::uint64_t>(row.integer(column)); };
  return {count(0), count(1), count(2), static_cast<std::uint64_t>(database_.file_bytes())};
}

MemoryFile::Info SqliteTables::info() {
  const auto count = [&](const char* sql) {
    return static_cast<std::uint64_t>(database_.integer(sql));
  };
  MemoryFile::Info info;
  const MemoryFile::Counts views = counts();
  info.views = views.views;
  info.views_with_position = views.views_with_position;
  info.views_with_heading = views.views_with_heading;
  info.links = count("SELECT count(*) FROM links WHERE a > 0");
  info.thumbnails = count_attachments(ViewAttachment::thumbnails);
  info.views_with_features = count_attachments(ViewAttachment::features);
  info.feature_bytes = attachment_bytes(ViewAttachment::features);
  info.maps = count("SELECT count(*) FROM maps WHERE name > ''");
  info.routes = count("SELECT count(*) FROM routes WHERE name > ''");
  info.format_version = memory_format_version;
  info.file_bytes = views.file_bytes;
  return info;
}

}  // namespace panonav
