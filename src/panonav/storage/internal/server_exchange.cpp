#ifdef PANONAV_WITH_POSTGRESQL

#include "panonav/storage/internal/server_exchange.hpp"

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/postgresql_schema.hpp"
#include "panonav/storage/internal/synchronised_tables.hpp"

namespace panonav {

namespace {

using Numbers = std::span<const std::int64_t>;

// The rows of a memory that a file keeps, as v; $1 is the memory, $2 and $3 are the areas' columns
// and rows. By bare columns, so that the index of positions is used.
std::string kept_views(const KeptAreas& areas) {
  if (!areas) return "panonav.views v WHERE v.memory = $1";
  return "unnest($2, $3) q(c, r) JOIN panonav.views v ON v.memory = $1 AND v.x_m IS NOT NULL AND "
         "v.x_m >= (10 * q.c)::float8 AND v.x_m < (10 * q.c + 10)::float8 AND "
         "v.y_m >= (10 * q.r)::float8 AND v.y_m < (10 * q.r + 10)::float8 WHERE true";
}

std::string kept_links(const KeptAreas& areas) {
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

Blocks blocks_in(const PostgresqlRows& rows) {
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
  if (memories.schema_version < postgresql_schema_version) {
    throw FileError(address.shown.native(),
                    "cannot be synchronised: the schema's version is " +
                        std::to_string(memories.schema_version) +
                        "; allowed: " + std::to_string(postgresql_schema_version) +
                        ", to which the owner of the schema brings it with panonav memorise or "
                        "synchronise");
  }
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
  values.add(tables_.memory());
  return values;
}

ViewId ServerExchange::id_in(const PostgresqlRows& rows, int row, int column) const {
  const std::int64_t id = rows.integer(row, column);
  if (id < 1 || id > std::int64_t{UINT32_MAX}) tables_.fail_damaged("a view id is out of range");
  return {static_cast<std::uint32_t>(id)};
}

// id, name, x_m, y_m, heading_rad, stamp_s, checksum
ServerView ServerExchange::view_in(const PostgresqlRows& rows, int row) const {
  ServerView view;
  view.id = id_in(rows, row, 0);
  view.info.name = rows.text(row, 1);
  const auto x_m = rows.real(row, 2);
  const auto y_m = rows.real(row, 3);
  if (x_m && y_m) view.info.pose = ReferencePose{*x_m, *y_m, rows.real(row, 4)};
  view.info.stamp_s = rows.real(row, 5);
  view.checksum = rows.integer(row, 6);
  return view;
}

ServerExchange::State ServerExchange::state() {
  const PostgresqlRows rows =
      connection().run("SELECT identity, last_view FROM panonav.memories WHERE id = $1", values());
  if (rows.size() == 0) {
    throw FileError(tables_.path().native(),
                    "was removed from its server, or belongs to another fleet now");
  }
  return {std::string(rows.text(0, 0)), rows.integer(0, 1)};
}

std::vector<Upload> ServerExchange::uploads(const std::string& file,
                                            std::span<const ViewId> views) {
  std::vector<Upload> uploads;
  if (views.empty()) return uploads;
  const auto numbers = numbers_of(views);
  const PostgresqlRows rows = connection().run(
      "SELECT view, signature, server_view, local_checksum, server_checksum, sent FROM "
      "panonav.uploads WHERE memory = $1 AND file = $2 AND view = ANY($3) ORDER BY server_view",
      values().add(std::string_view(file)).add(Numbers(numbers)));
  for (int i = 0; i < rows.size(); ++i) {
    uploads.push_back({id_in(rows, i, 0), rows.integer(i, 1), id_in(rows, i, 2), rows.integer(i, 3),
                       rows.integer(i, 4), rows.integer(i, 5)});
  }
  return uploads;
}

std::vector<ServerView> ServerExchange::named(std::span<const std::string> names) {
  std::vector<ServerView> views;
  if (names.empty()) return views;
  const PostgresqlRows rows = connection().run(
      "SELECT id, name, x_m, y_m, heading_rad, stamp_s, checksum FROM panonav.views WHERE memory = "
      "$1 AND name = ANY($2)",
      values().add(names));
  for (int i = 0; i < rows.size(); ++i) views.push_back(view_in(rows, i));
  return views;
}

std::vector<ServerView> ServerExchange::infos(std::span<const ViewId> ids) {
  std::vector<ServerView> views;
  if (ids.empty()) return views;
  const auto numbers = numbers_of(ids);
  const PostgresqlRows rows = connection().run(
      "SELECT id, name, x_m, y_m, heading_rad, stamp_s, checksum FROM panonav.views WHERE memory = "
      "$1 AND id = ANY($2) ORDER BY id",
      values().add(Numbers(numbers)));
  for (int i = 0; i < rows.size(); ++i) views.push_back(view_in(rows, i));
  return views;
}

std::map<ViewId, std::int64_t> ServerExchange::checksums(std::span<const ViewId> views) {
  std::map<ViewId, std::int64_t> checksums;
  if (views.empty()) return checksums;
  const auto numbers = numbers_of(views);
  const PostgresqlRows rows =
      connection().run("SELECT id, checksum FROM panonav.views WHERE memory = $1 AND id = ANY($2)",
                       values().add(Numbers(numbers)));
  for (int i = 0; i < rows.size(); ++i) checksums.emplace(id_in(rows, i, 0), rows.integer(i, 1));
  return checksums;
}

Blocks ServerExchange::view_blocks(const KeptAreas& areas) {
  PostgresqlValues given = values();
  add_areas(given, areas);
  return blocks_in(connection().run("SELECT " + block_of_v +
                                        ", count(*), bit_xor(v.checksum) FROM " +
                                        kept_views(areas) + " GROUP BY 1",
                                    given));
}

std::map<ViewId, std::int64_t> ServerExchange::checksums_in(const KeptAreas& areas,
                                                            std::span<const std::int64_t> blocks) {
  std::map<ViewId, std::int64_t> checksums;
  if (blocks.empty()) return checksums;
  PostgresqlValues given = values();
  add_areas(given, areas);
  const PostgresqlRows rows =
      connection().run("SELECT v.id, v.checksum FROM " + kept_views(areas) + " AND " + block_of_v +
                           " = ANY(" + (areas ? "$4)" : "$2)"),
                       given.add(blocks));
  for (int i = 0; i < rows.size(); ++i) checksums.emplace(id_in(rows, i, 0), rows.integer(i, 1));
  return checksums;
}

Blocks ServerExchange::link_blocks(const KeptAreas& areas) {
  PostgresqlValues given = values();
  add_areas(given, areas);
  return blocks_in(connection().run(
      (areas ? "WITH kept AS MATERIALIZED (SELECT v.id FROM " + kept_views(areas) + ") " : "") +
          "SELECT " + block_of_l + ", count(*), bit_xor(l.checksum) FROM " + kept_links(areas) +
          " GROUP BY 1",
      given));
}

std::vector<Link> ServerExchange::links_in(const KeptAreas& areas,
                                           std::span<const std::int64_t> blocks) {
  std::vector<Link> links;
  if (blocks.empty()) return links;
  PostgresqlValues given = values();
  add_areas(given, areas);
  const PostgresqlRows rows = connection().run(
      (areas ? "WITH kept AS MATERIALIZED (SELECT v.id FROM " + kept_views(areas) + ") " : "") +
          "SELECT l.a, l.b, l.kind, l.checksum FROM " + kept_links(areas) + " AND " + block_of_l +
          " = ANY(" + (areas ? "$4)" : "$2)"),
      given.add(blocks));
  for (int i = 0; i < rows.size(); ++i) {
    Link link{id_in(rows, i, 0), id_in(rows, i, 1), LinkKind::sequence};
    const std::int64_t kind = rows.integer(i, 2);
    link.kind = static_cast<LinkKind>(kind);
    if (kind < 0 || kind > static_cast<int>(LinkKind::closure) || link.b <= link.a ||
        rows.integer(i, 3) != link_checksum(link)) {
      tables_.fail_damaged("the link of views " + std::to_string(link.a.value) + " and " +
                           std::to_string(link.b.value) + " does not match its checksum");
    }
    links.push_back(link);
  }
  return links;
}

std::map<ViewId, std::int64_t> ServerExchange::signatures(std::span<const ViewId> views) {
  std::map<ViewId, std::int64_t> signatures;
  if (views.empty()) return signatures;
  const auto numbers = numbers_of(views);
  connection().stream("SELECT id, signature FROM panonav.views WHERE memory = $1 AND id = ANY($2)",
                      values().add(Numbers(numbers)), [&](const PostgresqlRows& rows) {
                        signatures.emplace(id_in(rows, 0, 0), signature_checksum(rows.bytes(0, 1)));
                      });
  return signatures;
}

std::vector<WholeServerView> ServerExchange::whole(std::span<const ViewId> ids) {
  std::vector<WholeServerView> views;
  if (ids.empty()) return views;
  const auto numbers = numbers_of(ids);
  RecordBytes scratch;
  connection().stream(
      "SELECT v.id, v.name, v.x_m, v.y_m, v.heading_rad, v.stamp_s, v.checksum, v.signature, "
      "t.bytes, t.checksum, f.bytes, f.checksum FROM panonav.views v LEFT JOIN panonav.thumbnails "
      "t ON t.memory = v.memory AND t.view = v.id LEFT JOIN panonav.features f ON f.memory = "
      "v.memory AND f.view = v.id WHERE v.memory = $1 AND v.id = ANY($2) ORDER BY v.id",
      values().add(Numbers(numbers)), [&](const PostgresqlRows& rows) {
        ServerView found = view_in(rows, 0);
        const auto signature = rows.bytes(0, 7);
        const auto fail = [&](const char* what) {
          tables_.fail_damaged(what + std::to_string(found.id.value) +
                               " does not match its checksum");
        };
        if (signature.size() % 2 != 0 ||
            found.checksum != view_checksum(scratch, found.id, found.info, signature)) {
          fail("view ");
        }
        WholeServerView whole{found.id, {std::move(found.info), {}, {}, {}}, found.checksum};
        const std::size_t half = signature.size() / 2;
        whole.view.signature.magnitudes.assign(signature.begin(), signature.begin() + half);
        whole.view.signature.phases.assign(signature.begin() + half, signature.end());
        const auto beside = [&](int column, std::vector<std::uint8_t>& bytes, const char* what) {
          if (rows.is_null(0, column)) return;
          bytes = rows.copy(0, column);
          if (rows.integer(0, column + 1) != bytes_checksum(whole.id, bytes)) fail(what);
        };
        beside(8, whole.view.thumbnail, "the thumbnail of view ");
        beside(10, whole.view.features, "what local features view ");
        views.push_back(std::move(whole));
      });
  return views;
}

void ServerExchange::stage(std::span<const NewView> views) {
  connection().execute(
      "CREATE TEMPORARY TABLE IF NOT EXISTS panonav_staged(number bigint, name text COLLATE "
      "\"C\", x_m double precision, y_m double precision, heading_rad double precision, stamp_s "
      "double precision, signature bytea, thumbnail bytea, features bytea) ON COMMIT DELETE ROWS;"
      "ALTER TABLE pg_temp.panonav_staged ALTER signature SET STORAGE PLAIN, ALTER thumbnail SET "
      "STORAGE EXTERNAL, ALTER features SET STORAGE EXTERNAL");
  CopyRows rows;
  std::vector<std::uint8_t> signature;
  const auto add_beside = [&](const std::vector<std::uint8_t>& bytes) {
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
    add_beside(signature);
    add_beside(views[i].thumbnail);
    add_beside(views[i].features);
  }
  connection().copy_in("COPY pg_temp.panonav_staged FROM STDIN (FORMAT binary)", rows.finish());
}

namespace {

/// Uploads as one array for each column.
struct UploadColumns {
  explicit UploadColumns(std::span<const Upload> uploads) {
    for (const Upload& upload : uploads) {
      views.push_back(upload.view.value);
      signatures.push_back(upload.signature);
      server_views.push_back(upload.server_view.value);
      local_checksums.push_back(upload.local_checksum);
      server_checksums.push_back(upload.server_checksum);
      sent.push_back(upload.sent);
    }
  }
  void add_to(PostgresqlValues& values) const {
    values.add(Numbers(views))
        .add(Numbers(signatures))
        .add(Numbers(server_views))
        .add(Numbers(local_checksums))
        .add(Numbers(server_checksums))
        .add(Numbers(sent));
  }
  std::vector<std::int64_t> views, signatures, server_views, local_checksums, server_checksums,
      sent;
};

}  // namespace

void ServerExchange::insert(const std::string& file, std::span<const Staged> added) {
  if (added.empty()) return;
  const std::int64_t session = tables_.session();
  std::vector<Upload> uploads;
  std::vector<std::int64_t> numbers, thumbnails, features;
  for (const Staged& staged : added) {
    uploads.push_back(staged.upload);
    numbers.push_back(static_cast<std::int64_t>(staged.number));
    thumbnails.push_back(staged.thumbnail_checksum);
    features.push_back(staged.features_checksum);
  }
  PostgresqlValues given = values();
  given.add(session).add(std::string_view(file));
  UploadColumns(uploads).add_to(given);
  given.add(Numbers(numbers)).add(Numbers(thumbnails)).add(Numbers(features));
  connection().run(
      "WITH n AS (SELECT * FROM unnest($4, $5, $6, $7, $8, $9, $10, $11, $12) n(view, signature, "
      "id, local_checksum, checksum, sent, number, thumbnail_checksum, features_checksum)), "
      "added AS (INSERT INTO panonav.views(memory, id, name, x_m, y_m, heading_rad, stamp_s, "
      "session, signature, checksum) SELECT $1, n.id, s.name, s.x_m, s.y_m, s.heading_rad, "
      "s.stamp_s, $2, s.signature, n.checksum FROM pg_temp.panonav_staged s JOIN n USING "
      "(number)), "
      "thumbnails AS (INSERT INTO panonav.thumbnails(memory, view, bytes, checksum) SELECT $1, "
      "n.id, s.thumbnail, n.thumbnail_checksum FROM pg_temp.panonav_staged s JOIN n USING (number) "
      "WHERE s.thumbnail IS NOT NULL), "
      "features AS (INSERT INTO panonav.features(memory, view, bytes, checksum) SELECT $1, n.id, "
      "s.features, n.features_checksum FROM pg_temp.panonav_staged s JOIN n USING (number) WHERE "
      "s.features IS NOT NULL), "
      "taken AS (INSERT INTO panonav.uploads(memory, file, view, signature, server_view, "
      "local_checksum, server_checksum, sent) SELECT $1, $3, view, signature, id, local_checksum, "
      "checksum, sent FROM n) "
      "UPDATE panonav.memories SET last_view = (SELECT max(id) FROM n) WHERE id = $1",
      given);
}

void ServerExchange::update(const std::string& file, std::span<const ServerView> views,
                            std::span<const Upload> uploads) {
  if (views.empty()) return;
  std::vector<std::int64_t> ids;
  for (const ServerView& view : views) ids.push_back(view.id.value);
  const PostgresqlRows before =
      connection().run("SELECT x_m, y_m FROM panonav.views WHERE memory = $1 AND id = ANY($2)",
                       values().add(Numbers(ids)));
  for (int i = 0; i < before.size(); ++i) {
    tables_.changed_at(before.real(i, 0), before.real(i, 1));
  }
  connection().execute(
      "CREATE TEMPORARY TABLE IF NOT EXISTS panonav_changed(id bigint, name text COLLATE \"C\", "
      "x_m double precision, y_m double precision, heading_rad double precision, stamp_s double "
      "precision, checksum bigint) ON COMMIT DELETE ROWS");
  CopyRows rows;
  for (const ServerView& view : views) {
    rows.begin_row(7).add(std::int64_t{view.id.value});
    add_info(rows, view.info);
    rows.add(view.checksum);
    if (view.info.pose) tables_.changed_at(view.info.pose->x_m, view.info.pose->y_m);
  }
  connection().copy_in("COPY pg_temp.panonav_changed FROM STDIN (FORMAT binary)", rows.finish());
  PostgresqlValues given = values();
  given.add(std::string_view(file));
  UploadColumns(uploads).add_to(given);
  connection().run(
      "WITH changed AS (UPDATE panonav.views v SET name = c.name, x_m = c.x_m, y_m = c.y_m, "
      "heading_rad = c.heading_rad, stamp_s = c.stamp_s, checksum = c.checksum FROM "
      "pg_temp.panonav_changed c WHERE v.memory = $1 AND v.id = c.id) "
      "INSERT INTO panonav.uploads(memory, file, view, signature, server_view, local_checksum, "
      "server_checksum, sent) SELECT $1, $2, * FROM unnest($3, $4, $5, $6, $7, $8) ON CONFLICT "
      "(memory, file, view, signature, server_view) DO UPDATE SET "
      "local_checksum = excluded.local_checksum, server_checksum = excluded.server_checksum, sent "
      "= "
      "excluded.sent",
      given);
}

void ServerExchange::clear_recordings() {
  const std::string key = "parameter." + std::string(recordings_parameter);
  connection().run(
      "UPDATE panonav.settings SET text_value = '', checksum = $3 WHERE memory = $1 AND key = $2 "
      "AND "
      "text_value <> ''",
      values().add(std::string_view(key)).add(setting_checksum(key, std::string())));
}

std::size_t ServerExchange::add_links(std::span<const Link> links) {
  if (links.empty()) return 0;
  std::vector<std::int64_t> a, b, kinds, checksums;
  for (const Link& link : links) {
    a.push_back(link.a.value);
    b.push_back(link.b.value);
    kinds.push_back(static_cast<int>(link.kind));
    checksums.push_back(link_checksum(link));
  }
  const PostgresqlRows rows = connection().run(
      "WITH added AS (INSERT INTO panonav.links(memory, a, b, kind, checksum) SELECT $1, n.* FROM "
      "unnest($2, $3, $4, $5) n(a, b, kind, checksum) WHERE EXISTS (SELECT FROM panonav.views v "
      "WHERE v.memory = $1 AND v.id = n.a) AND EXISTS (SELECT FROM panonav.views v WHERE v.memory "
      "= $1 AND v.id = n.b) ON CONFLICT DO NOTHING RETURNING 1) SELECT count(*) FROM added",
      values().add(Numbers(a)).add(Numbers(b)).add(Numbers(kinds)).add(Numbers(checksums)));
  return static_cast<std::size_t>(rows.integer(0, 0));
}

std::size_t ServerExchange::change_links(std::span<const ChangedLink> links) {
  std::vector<std::int64_t> a, b, former, wanted, checksums;
  std::vector<std::int64_t> removed_a, removed_b;
  for (const ChangedLink& link : links) {
    const auto kind = static_cast<int>(link.former.kind);
    if (link.wanted) {
      a.push_back(link.former.a.value);
      b.push_back(link.former.b.value);
      former.push_back(kind);
      wanted.push_back(static_cast<int>(*link.wanted));
      checksums.push_back(link_checksum({link.former.a, link.former.b, *link.wanted}));
    } else {
      removed_a.push_back(link.former.a.value);
      removed_b.push_back(link.former.b.value);
    }
  }
  std::int64_t changed = 0;
  if (!a.empty()) {
    changed += connection()
                   .run(
                       "WITH changed AS (UPDATE panonav.links l SET kind = n.wanted, checksum = "
                       "n.checksum FROM unnest($2, $3, $4, $5, $6) n(a, b, former, wanted, "
                       "checksum) WHERE l.memory = $1 AND l.a = n.a AND l.b = n.b AND l.kind = "
                       "n.former RETURNING 1) SELECT count(*) FROM changed",
                       values()
                           .add(Numbers(a))
                           .add(Numbers(b))
                           .add(Numbers(former))
                           .add(Numbers(wanted))
                           .add(Numbers(checksums)))
                   .integer(0, 0);
  }
  if (!removed_a.empty()) {
    changed += connection()
                   .run(
                       "WITH removed AS (DELETE FROM panonav.links l USING unnest($2, $3) n(a, b) "
                       "WHERE l.memory = $1 AND l.a = n.a AND l.b = n.b RETURNING 1) SELECT "
                       "count(*) FROM removed",
                       values().add(Numbers(removed_a)).add(Numbers(removed_b)))
                   .integer(0, 0);
  }
  return static_cast<std::size_t>(changed);
}

}  // namespace panonav

#endif
