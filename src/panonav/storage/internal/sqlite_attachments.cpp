#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/sqlite_tables.hpp"

// Thumbnails and local features, each in parts of one size: whole ones would leave a third of the
// pages empty, as a page holds only one or two.

namespace panonav {

namespace {

/// Largest part, in bytes, unless there are more than `parts_per_view`. Rows take 12 bytes more
/// each, and a page stays empty by half a row on average: 6 % of both with 600 bytes, between 400
/// and 900 hardly more.
constexpr std::size_t max_part_bytes = 600;
/// Numbers of parts for each view: part n of view v has the number 256 v + n.
constexpr std::int64_t parts_per_view = 256;

const char* attachment_table_name(ViewAttachment table) {
  return table == ViewAttachment::thumbnails ? "thumbnails" : "features";
}

std::string make_attachment_sql(const char* before, ViewAttachment table, const char* after) {
  return before + std::string(attachment_table_name(table)) + after;
}

}  // namespace

void SqliteTables::insert_attachments(ViewAttachment table, std::span<const ViewId> ids,
                                      std::span<const NewView> views) {
  Statement insert(database_, make_attachment_sql("INSERT INTO ", table,
                                                  "(part, bytes, checksum) VALUES(?, ?, ?)")
                                  .c_str());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::span<const std::uint8_t> bytes =
        table == ViewAttachment::thumbnails ? views[i].thumbnail : views[i].features;
    const std::size_t parts =
        std::min<std::size_t>(parts_per_view, (bytes.size() + max_part_bytes - 1) / max_part_bytes);
    for (std::size_t part = 0; part < parts; ++part) {
      const std::size_t begin = part * bytes.size() / parts;
      const std::size_t end = (part + 1) * bytes.size() / parts;
      insert.bind(1, std::int64_t{ids[i].value} * parts_per_view + static_cast<std::int64_t>(part));
      insert.bind(2, bytes.subspan(begin, end - begin));
      if (part == 0) {
        insert.bind(3, attachment_checksum(ids[i], bytes));
      } else {
        insert.bind_null(3);
      }
      if (insert.run() != 0) {
        fail_damaged("an entry of " + std::string(attachment_table_name(table)) +
                     " without a view");
      }
    }
  }
}

bool SqliteTables::has_attachments(ViewAttachment table) {
  return database_.integer(
             make_attachment_sql("SELECT EXISTS (SELECT 1 FROM ", table, ")").c_str()) != 0;
}

std::vector<ViewId> SqliteTables::views_with_attachment(ViewAttachment table) {
  std::vector<ViewId> views;
  Statement rows(database_,
                 make_attachment_sql("SELECT part >> 8 FROM ", table, " ORDER BY part").c_str());
  while (rows.step()) {
    const ViewId view = read_view_id(rows, 0);
    if (!views.empty() && view == views.back()) continue;
    if (!views.empty() && view < views.back()) {
      fail_damaged(std::string(attachment_table_name(table)) + " are out of order");
    }
    views.push_back(view);
  }
  return views;
}

std::optional<StoredBytes> SqliteTables::bytes(ViewAttachment table, ViewId view) {
  Statement rows(database_,
                 make_attachment_sql("SELECT bytes, checksum FROM ", table,
                                     " WHERE part BETWEEN 256 * ?1 AND 256 * ?1 + 255 ORDER BY "
                                     "part")
                     .c_str(),
                 view);
  std::optional<StoredBytes> stored;
  while (rows.step()) {
    const auto part = rows.blob(0);
    if (!stored) {
      // The checksum of the whole is in its first part; without that part, none fits.
      stored.emplace(StoredBytes{{}, rows.is_null(1) ? 0 : rows.integer(1)});
    }
    stored->bytes.insert(stored->bytes.end(), part.begin(), part.end());
  }
  return stored;
}

std::uint64_t SqliteTables::count_attachments(ViewAttachment table) {
  return static_cast<std::uint64_t>(database_.integer(
      make_attachment_sql("SELECT count(*) FROM ", table, " WHERE part & 255 = 0 AND part > 0")
          .c_str()));
}

std::uint64_t SqliteTables::attachment_bytes(ViewAttachment table) {
  return static_cast<std::uint64_t>(database_.integer(
      make_attachment_sql("SELECT coalesce(sum(length(bytes)), 0) FROM ", table, " WHERE part > 0")
          .c_str()));
}

}  // namespace panonav
