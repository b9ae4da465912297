#include "panonav_fleet/internal/server_exchange.hpp"

#include <array>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/synchronised_tables.hpp"
#include "panonav_fleet/internal/postgresql_schema.hpp"

namespace panonav::fleet {

namespace {

using Numbers = std::span<const std::int64_t>;

// Returns SQL for the rows of a memory that a file keeps, as v; $1 is the memory, $2 and $3 are
// columns and rows of the areas. With row-level security PostgreSQL uses an index only for
// comparisons that cannot fail, so bare columns are compared with bare numbers.
std::string kept_views_sql(const KeptAreas& areas) {
  if (!areas) return "panonav.views v WHERE v.memory = $1";
  return "(SELECT (10 * c)::float8 left_m, (10 * c + 10)::float8 right_m, (10 * r)::float8 "
         "bottom_m, (10 * r + 10)::float8 top_m FROM unnest($2, $3) u(c, r) OFFSET 0) q JOIN "
         "panonav.views v ON v.memory = $1 AND v.x_m IS NOT NULL AND v.x_m >= q.left_m AND v.x_m < "
         "q.right_m AND v.y_m >= q.bottom_m AND v.y_m < q.top_m WHERE true";
}

std::string kept_links_sql(const KeptAreas& areas) {
  if (!areas) return "panonav.links l WHERE l.memory = $1";
  return "panonav.links l WHERE l.memory = $1 AND l.a IN (SELECT id FROM kept) AND l.b IN (SELECT "
         "id FROM kept)";
}

void add_areas(PostgresqlValues& values, const KeptAreas& areas) {
  if (!areas) return;
  std::vector<std::int64_t> columns, rows;
  for (const MemoryArea& area : *areas) {
    columns.push_back(static_cast<std::int64_t>(area.column));
    rows.push_back(static_cast<std::int64_t>(area.row));
  }
  values.add(Numbers(columns)).add(Numbers(rows));
}

Blocks to_blocks(const PostgresqlRows& rows) {
  Blocks blocks;
  for (int i = 0; i < rows.size(); ++i) {
    blocks[rows.integer(i, 0)] = {rows.integer(i, 1), rows.integer(i, 2)};
  }
  return blocks;
}

const std::string block_of_v = "v.id >> " + std::to_string(block_bits);
const std::string block_of_l = "l.a >> " + std::to_string(block_bits);

}  // namespace

std::unique_ptr<ServerExchange> ServerExchange::connect(const ServerAddress& address) {
  MemoriesConnection memories = connect_to_memories(address, true);
  const auto found = find_memory(memories, address);
  if (!found) return nullptr;
  return std::unique_ptr<ServerExchange>(
      new ServerExchange(address, std::move(memories.connection), *found));
}

ServerExchange::ServerExchange(const ServerAddress& address, PostgresqlConnection connection_,
                               const FoundMemory& found)
    : tables_(address, std::move(connection_), found.id, found.channel) {
  const PostgresqlRows rows = connection().run(
      "SELECT (has_table_privilege('panonav.views', 'INSERT') AND "
      "has_table_privilege('panonav.uploads', 'INSERT'))::int4::int8, "
      "(has_table_privilege('panonav.views', 'UPDATE') AND has_table_privilege('panonav.views', "
      "'DELETE') AND has_table_privilege('panonav.uploads', 'UPDATE'))::int4::int8, "
      "session_user::text");
  may_add_ = rows.integer(0, 0) != 0;
  may_change_ = may_add_ && rows.integer(0, 1) != 0;
  robot_ = address.robot.value_or(std::string(rows.text(0, 2)));
}

PostgresqlValues ServerExchange::values() const {
  PostgresqlValues values;
  values.add(tables_.memory_id());
  return values;
}

// Reads a row whose columns are those of `server_view_fields`.
ServerView ServerExchange::read_server_view(const PostgresqlRows& rows, int row) const {
  return {read_view_id(rows, row, 0), read_info(rows, row, 1), rows.integer(row, 6)};
}

std::vector<ServerView> ServerExchange::read_server_views(const PostgresqlRows& rows) const {
  std::vector<ServerView> views;
  for (int i = 0; i < rows.size(); ++i) views.push_back(read_server_view(rows, i));
  return views;
}

std::map<ViewId, std::int64_t> ServerExchange::to_checksums(const PostgresqlRows& rows) const {
  std::map<ViewId, std::int64_t> checksums;
  for (int i = 0; i < rows.size(); ++i)
    checksums.emplace(read_view_id(rows, i, 0), rows.integer(i, 1));
  return checksums;
}

void ServerExchange::throw_memory_removed() const {
  throw FileError(tables_.path().native(),
                  "was removed from its server, or belongs to another fleet now");
}

ServerExchange::State ServerExchange::read_state() {
  const PostgresqlRows rows =
      connection().run("SELECT identity, last_view FROM panonav.memories WHERE id = $1", values());
  if (rows.size() == 0) throw_memory_removed();
  return {std::string(rows.text(0, 0)), rows.integer(0, 1)};
}

constexpr const char* upload_fields =
    "SELECT u.view, u.signature, u.server_view, u.local_checksum, u.server_checksum, u.sent FROM ";

std::vector<Upload> ServerExchange::to_uploads(const PostgresqlRows& rows) const {
  std::vector<Upload> uploads;
  for (int i = 0; i < rows.size(); ++i) {
    uploads.push_back({read_view_id(rows, i, 0), rows.integer(i, 1), read_view_id(rows, i, 2),
                       rows.integer(i, 3), rows.integer(i, 4), rows.integer(i, 5)});
  }
  return uploads;
}

std::vector<Upload> ServerExchange::read_uploads(const std::string& file,
                                                 std::span<const ViewId> views) {
  if (views.empty()) return {};
  const auto numbers = to_numbers(views);
  return to_uploads(connection().run(
      upload_fields + std::string("panonav.uploads u WHERE u.memory = $1 AND u.file = $2 AND "
                                  "u.view = ANY($3) ORDER BY u.server_view"),
      values().add(std::string_view(file)).add(Numbers(numbers))));
}

std::vector<Upload> ServerExchange::read_settled_uploads(const std::string& file,
                                                         std::span<const ViewId> views) {
  const auto numbers = to_numbers(views);
  return to_uploads(
      connection().run(upload_fields + std::string("panonav.uploads_of($1, $2, $3) u"),
                       values().add(std::string_view(file)).add(Numbers(numbers))));
}

constexpr const char* server_view_fields =
    "SELECT v.id, v.name, v.x_m, v.y_m, v.heading_rad, v.stamp_s, v.checksum";

std::vector<ServerView> ServerExchange::find_views_by_name(std::span<const std::string> names) {
  if (names.empty()) return {};
  return read_server_views(
      connection().run(std::string(server_view_fields) +
                           " FROM panonav.views v WHERE v.memory = $1 AND v.name = ANY($2)",
                       values().add(names)));
}

std::vector<ServerView> ServerExchange::read_infos(std::span<const ViewId> ids) {
  if (ids.empty()) return {};
  const auto numbers = to_numbers(ids);
  return read_server_views(connection().run(
      std::string(server_view_fields) +
          " FROM panonav.views v WHERE v.memory = $1 AND v.id = ANY($2) ORDER BY v.id",
      values().add(Numbers(numbers))));
}

std::map<ViewId, std::int64_t> ServerExchange::read_checksums(std::span<const ViewId> views) {
  if (views.empty()) return {};
  const auto numbers = to_numbers(views);
  return to_checksums(
      connection().run("SELECT id, checksum FROM panonav.views WHERE memory = $1 AND id = ANY($2)",
                       values().add(Numbers(numbers))));
}

Blocks ServerExchange::compute_view_blocks(const KeptAreas& areas) {
  PostgresqlValues bound = values();
  add_areas(bound, areas);
  return to_blocks(connection().run("SELECT " + block_of_v +
                                        ", count(*), bit_xor(v.checksum) FROM " +
                                        kept_views_sql(areas) + " GROUP BY 1",
                                    bound));
}

std::map<ViewId, std::int64_t> ServerExchange::read_checksums_in_blocks(
    const KeptAreas& areas, std::span<const std::int64_t> blocks) {
  if (blocks.empty()) return {};
  PostgresqlValues bound = values();
  add_areas(bound, areas);
  return to_checksums(connection().run("SELECT v.id, v.checksum FROM " + kept_views_sql(areas) +
                                           " AND " + block_of_v + " = ANY(" +
                                           (areas ? "$4)" : "$2)"),
                                       bound.add(blocks)));
}

Blocks ServerExchange::compute_link_blocks(const KeptAreas& areas) {
  PostgresqlValues bound = values();
  add_areas(bound, areas);
  return to_blocks(connection().run(
      (areas ? "WITH kept AS MATERIALIZED (SELECT v.id FROM " + kept_views_sql(areas) + ") " : "") +
          "SELECT " + block_of_l + ", count(*), bit_xor(l.checksum) FROM " + kept_links_sql(areas) +
          " GROUP BY 1",
      bound));
}

ServerLinks ServerExchange::read_links_in_blocks(const KeptAreas& areas,
                                                 std::span<const std::int64_t> blocks) {
  ServerLinks links;
  if (blocks.empty()) return links;
  PostgresqlValues bound = values();
  add_areas(bound, areas);
  const PostgresqlRows rows = connection().run(
      (areas ? "WITH kept AS MATERIALIZED (SELECT v.id FROM " + kept_views_sql(areas) + ") " : "") +
          "SELECT l.a, l.b, l.kind, l.checksum FROM " + kept_links_sql(areas) + " AND " +
          block_of_l + " = ANY(" + (areas ? "$4)" : "$2)"),
      bound.add(blocks));
  for (int i = 0; i < rows.size(); ++i) {
    std::optional<std::pair<ViewId, ViewId>> ends;  // nullopt: ids that no view has
    const bool is_accepted = tables_.accept_row(std::nullopt, [&] {
      ends.emplace(read_view_id(rows, i, 0), read_view_id(rows, i, 1));
      links.accepted.push_back(tables_.check_row(
          LinkRow{ends->first, ends->second, rows.integer(i, 2), rows.integer(i, 3)}));
    });
    if (!is_accepted && ends) links.left_out.insert(*ends);
  }
  return links;
}

std::map<ViewId, std::int64_t> ServerExchange::read_signature_checksums(
    std::span<const ViewId> views) {
  std::map<ViewId, std::int64_t> signatures;
  if (views.empty()) return signatures;
  const auto numbers = to_numbers(views);
  connection().stream("SELECT id, signature FROM panonav.views WHERE memory = $1 AND id = ANY($2)",
                      values().add(Numbers(numbers)), [&](const PostgresqlRows& rows) {
                        signatures.emplace(read_view_id(rows, 0, 0),
                                           signature_checksum(rows.bytes(0, 1)));
                      });
  return signatures;
}

FullServerView ServerExchange::read_full_view(const PostgresqlRows& rows, SignatureShape shape,
                                              RecordBytes& scratch) {
  const ServerView found = read_server_view(rows, 0);
  ViewRow row{found.id, found.info, rows.bytes(0, 7), found.checksum};
  tables_.check_row(row, shape, scratch);
  FullServerView whole{row.id, {std::move(row.info), {}, {}, {}}, row.checksum};
  unpack_signature(row.signature, shape, whole.view.signature);
  const auto read_attachment = [&](int column, ViewAttachment table,
                                   std::vector<std::uint8_t>& bytes) {
    if (rows.is_null(0, column)) return;
    tables_.accept_row(std::nullopt, [&] {
      StoredBytes stored{rows.copy(0, column), rows.integer(0, column + 1)};
      tables_.check_attachment(table, whole.id, stored);
      bytes = std::move(stored.bytes);
    });
  };
  read_attachment(8, ViewAttachment::thumbnails, whole.view.thumbnail);
  read_attachment(10, ViewAttachment::features, whole.view.features);
  return whole;
}

std::vector<FullServerView> ServerExchange::read_full_views(std::span<const ViewId> ids,
                                                            SignatureShape shape) {
  std::vector<FullServerView> views;
  if (ids.empty()) return views;
  const auto numbers = to_numbers(ids);
  RecordBytes scratch;
  connection().stream(
      std::string(server_view_fields) +
          ", v.signature, t.bytes, t.checksum, f.bytes, f.checksum FROM panonav.views v "
          "LEFT JOIN panonav.thumbnails t ON t.memory = v.memory AND t.view = v.id "
          "LEFT JOIN panonav.features f ON f.memory = v.memory AND f.view = v.id "
          "WHERE v.memory = $1 AND v.id = ANY($2) ORDER BY v.id",
      values().add(Numbers(numbers)), [&](const PostgresqlRows& rows) {
        tables_.accept_row(read_view_id(rows, 0, 0),
                           [&] { views.push_back(read_full_view(rows, shape, scratch)); });
      });
  return views;
}

void ServerExchange::stage_views(std::span<const NewView> views) {
  connection().execute(
      "CREATE TEMPORARY TABLE IF NOT EXISTS panonav_staged(number bigint, name text COLLATE \"C\", "
      "x_m double precision, y_m double precision, heading_rad double precision, stamp_s double "
      "precision, signature bytea, thumbnail bytea, features bytea);"
      "ALTER TABLE pg_temp.panonav_staged ALTER signature SET STORAGE PLAIN, ALTER thumbnail SET "
      "STORAGE EXTERNAL, ALTER features SET STORAGE EXTERNAL; TRUNCATE pg_temp.panonav_staged");
  CopyRows rows;
  std::vector<std::uint8_t> signature;
  const auto add_attachment = [&](const std::vector<std::uint8_t>& bytes) {
    if (bytes.empty()) {
      rows.add_null();
    } else {
      rows.add(std::span<const std::uint8_t>(bytes));
    }
  };
  for (std::size_t i = 0; i < views.size(); ++i) {
    rows.begin_row(9).add(static_cast<std::int64_t>(i));
    add_info(rows, views[i].info);
    pack_signature(views[i].signature, signature);
    add_attachment(signature);
    add_attachment(views[i].thumbnail);
    add_attachment(views[i].features);
    tables_.record_changed_area(views[i].info.pose);
  }
  connection().copy_in("COPY pg_temp.panonav_staged FROM STDIN (FORMAT binary)", rows.finish());
}

namespace {

std::int64_t empty_recordings_checksum() {
  return setting_checksum("parameter." + std::string(recordings_parameter), std::string());
}

}  // namespace

std::uint32_t ServerExchange::reserve_ids(std::size_t count) {
  const PostgresqlRows rows = connection().run("SELECT panonav.reserve_ids($1, $2)",
                                               values().add(static_cast<std::int64_t>(count)));
  if (rows.is_null(0, 0)) throw_memory_removed();
  const std::int64_t last = rows.integer(0, 0);
  if (last < 0 || last + static_cast<std::int64_t>(count) >= std::int64_t{UINT32_MAX}) {
    tables_.fail_damaged("there is no id left for another view");
  }
  return static_cast<std::uint32_t>(last);
}

std::vector<Upload> ServerExchange::submit_views(const std::string& file, std::int64_t sent,
                                                 std::span<const Staged> staged) {
  std::vector<std::int64_t> views, signatures, ids, local_checksums, server_checksums, numbers,
      thumbnails, features;
  for (const Staged& view : staged) {
    views.push_back(view.upload.view.value);
    signatures.push_back(view.upload.signature);
    ids.push_back(view.upload.server_view.value);
    local_checksums.push_back(view.upload.local_checksum);
    server_checksums.push_back(view.upload.server_checksum);
    numbers.push_back(static_cast<std::int64_t>(view.number));
    thumbnails.push_back(view.thumbnail_checksum);
    features.push_back(view.features_checksum);
  }
  const std::int64_t session = tables_.get_or_create_session();
  const std::string areas = tables_.consume_changed_areas();
  return to_uploads(connection().run(
      upload_fields +
          std::string("panonav.take_views($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, "
                      "$13) u"),
      values()
          .add(std::string_view(file))
          .add(session)
          .add(sent)
          .add(std::string_view(areas))
          .add(Numbers(views))
          .add(Numbers(signatures))
          .add(Numbers(ids))
          .add(Numbers(local_checksums))
          .add(Numbers(server_checksums))
          .add(Numbers(numbers))
          .add(Numbers(thumbnails))
          .add(Numbers(features))));
}

std::vector<Upload> ServerExchange::submit_changes(const std::string& file, std::int64_t sent,
                                                   std::span<const ChangedView> changes) {
  std::vector<std::int64_t> views, signatures, ids, local_checksums, former, server_checksums;
  CopyRows rows;
  for (const ChangedView& view : changes) {
    views.push_back(view.upload.view.value);
    signatures.push_back(view.upload.signature);
    ids.push_back(view.upload.server_view.value);
    local_checksums.push_back(view.upload.local_checksum);
    former.push_back(view.former_checksum);
    server_checksums.push_back(view.upload.server_checksum);
    rows.begin_row(6).add(std::int64_t{view.upload.server_view.value});
    add_info(rows, view.info);
    tables_.record_changed_area(view.info.pose);
  }
  const PostgresqlRows before =
      connection().run("SELECT x_m, y_m FROM panonav.views WHERE memory = $1 AND id = ANY($2)",
                       values().add(Numbers(ids)));
  for (int i = 0; i < before.size(); ++i) {
    tables_.record_changed_area(before.real(i, 0), before.real(i, 1));
  }
  connection().execute(
      "CREATE TEMPORARY TABLE IF NOT EXISTS panonav_changed(id bigint, name text COLLATE \"C\", "
      "x_m double precision, y_m double precision, heading_rad double precision, stamp_s double "
      "precision); TRUNCATE pg_temp.panonav_changed");
  connection().copy_in("COPY pg_temp.panonav_changed FROM STDIN (FORMAT binary)", rows.finish());
  const std::string areas = tables_.consume_changed_areas();
  return to_uploads(connection().run(
      upload_fields +
          std::string("panonav.take_changes($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11) u"),
      values()
          .add(std::string_view(file))
          .add(sent)
          .add(std::string_view(areas))
          .add(empty_recordings_checksum())
          .add(Numbers(views))
          .add(Numbers(signatures))
          .add(Numbers(ids))
          .add(Numbers(local_checksums))
          .add(Numbers(former))
          .add(Numbers(server_checksums))));
}

std::vector<ViewId> ServerExchange::submit_removals(
    const std::map<ViewId, std::int64_t>& checksums) {
  std::vector<std::int64_t> ids, sums;
  for (const auto& [id, checksum] : checksums) {
    ids.push_back(id.value);
    sums.push_back(checksum);
  }
  const PostgresqlRows there =
      connection().run("SELECT x_m, y_m FROM panonav.views WHERE memory = $1 AND id = ANY($2)",
                       values().add(Numbers(ids)));
  for (int i = 0; i < there.size(); ++i)
    tables_.record_changed_area(there.real(i, 0), there.real(i, 1));
  const std::string areas = tables_.consume_changed_areas();
  const PostgresqlRows rows = connection().run("SELECT panonav.take_removals($1, $2, $3, $4, $5)",
                                               values()
                                                   .add(std::string_view(areas))
                                                   .add(empty_recordings_checksum())
                                                   .add(Numbers(ids))
                                                   .add(Numbers(sums)));
  std::vector<ViewId> removed;
  for (int i = 0; i < rows.size(); ++i) removed.push_back(read_view_id(rows, i, 0));
  return removed;
}

std::size_t ServerExchange::submit_links(std::span<const Link> added,
                                         std::span<const ChangedLink> changed) {
  // Added links: a, b, kind, checksum; changed links: a, b, former kind, kind, checksum; removed
  // links: a, b.
  std::array<std::vector<std::int64_t>, 11> columns;
  const auto kind_of = [](Link::Kind kind) { return std::int64_t{static_cast<int>(kind)}; };
  for (const Link& link : added) {
    columns[0].push_back(link.a.value);
    columns[1].push_back(link.b.value);
    columns[2].push_back(kind_of(link.kind));
    columns[3].push_back(link_checksum(link));
  }
  for (const ChangedLink& link : changed) {
    const Link& former = link.former;
    const std::size_t first = link.new_kind ? 4 : 9;
    columns[first].push_back(former.a.value);
    columns[first + 1].push_back(former.b.value);
    if (!link.new_kind) continue;
    columns[6].push_back(kind_of(former.kind));
    columns[7].push_back(kind_of(*link.new_kind));
    columns[8].push_back(link_checksum({former.a, former.b, *link.new_kind}));
  }
  PostgresqlValues bound = values();
  for (const auto& column : columns) bound.add(Numbers(column));
  const PostgresqlRows rows = connection().run(
      "SELECT panonav.take_links($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12)", bound);
  return static_cast<std::size_t>(rows.integer(0, 0));
}

}  // namespace panonav::fleet
