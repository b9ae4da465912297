#include <cmath>
#include <type_traits>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav_fleet/internal/postgresql_memory.hpp"

namespace panonav::fleet {

namespace {

constexpr const char* view_fields =
    "v.id, v.name, v.x_m, v.y_m, v.heading_rad, v.stamp_s, v.signature, v.checksum";

std::string attachment_table_name(ViewAttachment table) {
  return table == ViewAttachment::thumbnails ? "panonav.thumbnails" : "panonav.features";
}

}  // namespace

class PostgresqlTables::ServerTransaction final : public MemoryTables::Transaction {
 public:
  ServerTransaction(PostgresqlTables& tables, Kind kind)
      : tables_(tables),
        within_another_(tables.connection_.is_in_transaction()),
        writes_(kind == Kind::writing) {
    PostgresqlConnection& connection = tables_.connection_;
    if (within_another_) {
      open_ = writes_;
      if (open_) connection.execute("SAVEPOINT part");
      return;
    }
    // Only one client writes at a time, so that ids have no gaps and ascend in the order in which
    // views become visible.
    constexpr std::int64_t locks = 5786634408840658944;  // lock number 0 is that of the schema
    try {
      connection.execute(writes_ ? "BEGIN; SELECT pg_advisory_xact_lock(" +
                                       std::to_string(locks + tables_.memory_) + ")"
                                 : "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY");
    } catch (...) {
      connection.try_execute("ROLLBACK");
      throw;
    }
  }
  ServerTransaction(const ServerTransaction&) = delete;
  ServerTransaction& operator=(const ServerTransaction&) = delete;
  ~ServerTransaction() override {
    if (!open_) return;
    tables_.connection_.try_execute(within_another_ ? "ROLLBACK TO part; RELEASE part"
                                                    : "ROLLBACK");
    if (writes_) {
      tables_.session_.reset();
      tables_.has_incoming_ = false;
    }
    if (within_another_) return;
    tables_.areas_.clear();
    tables_.changes_unplaced_views_ = false;
  }
  void commit() override {
    if (within_another_) {
      tables_.connection_.execute("RELEASE part");
    } else {
      tables_.notify();
      tables_.connection_.execute("COMMIT");
    }
    open_ = false;
  }

 private:
  PostgresqlTables& tables_;
  bool within_another_;
  bool writes_;
  bool open_ = true;
};

PostgresqlTables::PostgresqlTables(const ServerAddress& address, PostgresqlConnection connection,
                                   std::int64_t memory, std::string channel)
    : robot_(address.robot),
      connection_(std::move(connection)),
      memory_(memory),
      channel_(std::move(channel)) {}

std::unique_ptr<MemoryTables::Transaction> PostgresqlTables::transaction(Kind kind) {
  return std::make_unique<ServerTransaction>(*this, kind);
}

std::string PostgresqlTables::consume_changed_areas() {
  constexpr std::size_t max_bytes = 4000;  // PostgreSQL takes up to 8000
  std::string areas;
  const std::set<MemoryArea> changed = std::exchange(areas_, {});
  if (std::exchange(changes_unplaced_views_, false)) return {};
  for (const MemoryArea& area : changed) {
    if (!areas.empty()) areas += ' ';
    areas += to_text(area.column) + "," + to_text(area.row);
    if (areas.size() > max_bytes) return {};
  }
  return areas;
}

void PostgresqlTables::notify() {
  const std::string areas = consume_changed_areas();
  connection_.run("SELECT pg_notify($1, $2)",
                  Values().add(std::string_view(channel_)).add(std::string_view(areas)));
}

ViewRow PostgresqlTables::read_view_row(const Rows& rows) const {
  return {read_view_id(rows, 0, 0), read_info(rows, 0, 1), rows.bytes(0, 6), rows.integer(0, 7)};
}

std::vector<std::string> PostgresqlTables::query_texts(const std::string& sql) {
  std::vector<std::string> texts;
  const Rows rows = run(sql);
  for (int i = 0; i < rows.size(); ++i) texts.emplace_back(rows.text(i, 0));
  return texts;
}

Settings PostgresqlTables::settings() {
  Settings settings;
  const Rows rows =
      run("SELECT key, integer_value, real_value, text_value, bytes_value, checksum "
          "FROM panonav.settings WHERE memory = $1 ORDER BY key");
  for (int i = 0; i < rows.size(); ++i) {
    std::string key(rows.text(i, 0));
    SettingValue value;
    if (!rows.is_null(i, 1)) {
      value = rows.integer(i, 1);
    } else if (const auto real = rows.real(i, 2)) {
      value = *real;
    } else if (!rows.is_null(i, 3)) {
      value = std::string(rows.text(i, 3));
    } else {
      value = rows.copy(i, 4);
    }
    accept_row(std::nullopt, [&] {
      if (rows.integer(i, 5) != setting_checksum(key, value)) {
        fail_damaged("checksum of setting " + key);
      }
      settings.emplace(std::move(key), std::move(value));
    });
  }
  return settings;
}

void PostgresqlTables::write_setting(const std::string& key, const SettingValue& value) {
  Values values;
  values.add(memory_).add(std::string_view(key));
  const char* column = "";
  std::visit(
      [&](const auto& v) {
        using Value = std::remove_cvref_t<decltype(v)>;
        if constexpr (std::is_same_v<Value, std::int64_t>) {
          column = "integer_value";
          values.add(v);
        } else if constexpr (std::is_same_v<Value, double>) {
          if (!std::isfinite(v)) {
            throw ContractError("setting " + key, "not a number", "finite numbers");
          }
          column = "real_value";
          values.add(std::optional(v));
        } else if constexpr (std::is_same_v<Value, std::string>) {
          column = "text_value";
          values.add(std::string_view(v));
        } else {
          column = "bytes_value";
          values.add(std::span<const std::uint8_t>(v));
        }
      },
      value);
  values.add(setting_checksum(key, value));
  connection_.run("INSERT INTO panonav.settings(memory, key, " + std::string(column) +
                      ", checksum) VALUES ($1, $2, $3, $4) ON CONFLICT (memory, key) DO UPDATE SET "
                      "integer_value = excluded.integer_value, real_value = excluded.real_value, "
                      "text_value = excluded.text_value, bytes_value = excluded.bytes_value, "
                      "checksum = excluded.checksum",
                  values);
}

void PostgresqlTables::erase_setting(const std::string& key) {
  run("DELETE FROM panonav.settings WHERE memory = $1 AND key = $2", key);
}

std::uint32_t PostgresqlTables::last_id() {
  const Rows rows =
      run("SELECT last_view, coalesce((SELECT max(id) FROM panonav.views WHERE memory = $1), 0) "
          "FROM panonav.memories WHERE id = $1");
  if (rows.size() == 0) {
    throw FileError(path().native(),
                    "was removed from its server, or belongs to another fleet now");
  }
  const std::int64_t last = rows.integer(0, 0);
  const std::int64_t id = rows.integer(0, 1);
  if (last < 0 || last >= std::int64_t{UINT32_MAX} || id > last) {
    fail_damaged("the last view id is " + std::to_string(last) + ", the largest " +
                 std::to_string(id) + "; allowed: 0 .. 2^32 - 2, not below the largest");
  }
  return static_cast<std::uint32_t>(last);
}

// Each view refers to the session of the connection that added it.
std::int64_t PostgresqlTables::get_or_create_session() {
  if (session_) return *session_;
  const std::string insert_robot = "INSERT INTO panonav.robots(fleet, name) SELECT fleet, " +
                                   std::string(robot_ ? "$2" : "session_user::text") +
                                   " FROM panonav.memories WHERE id = $1 ON CONFLICT DO NOTHING";
  const std::string insert_session =
      "INSERT INTO panonav.sessions(memory, robot) SELECT m.id, r.id FROM panonav.memories m "
      "JOIN panonav.robots r ON r.fleet = m.fleet AND r.name = " +
      std::string(robot_ ? "$2" : "session_user::text") + " WHERE m.id = $1 RETURNING id";
  Values values;
  values.add(memory_);
  if (robot_) values.add(std::string_view(*robot_));
  connection_.run(insert_robot, values);
  const Rows rows = connection_.run(insert_session, values);
  if (rows.size() == 0) fail_damaged("no session");
  session_ = rows.integer(0, 0);
  return *session_;
}

// COPY cannot insert into tables with row-level security, so new views go to a temporary table
// first.
void PostgresqlTables::make_incoming_table_if_needed() {
  if (has_incoming_) return;
  connection_.execute(
      "CREATE TEMPORARY TABLE IF NOT EXISTS panonav_incoming(id bigint, name text COLLATE \"C\", "
      "x_m double precision, y_m double precision, heading_rad double precision, stamp_s double "
      "precision, signature bytea, checksum bigint, thumbnail bytea, thumbnail_checksum bigint, "
      "features bytea, features_checksum bigint) ON COMMIT DELETE ROWS;"
      "ALTER TABLE pg_temp.panonav_incoming ALTER signature SET STORAGE PLAIN, ALTER thumbnail "
      "SET STORAGE EXTERNAL, ALTER features SET STORAGE EXTERNAL");
  has_incoming_ = true;
}

void PostgresqlTables::insert(std::span<const ViewId> ids, std::span<const NewView> views) {
  if (views.empty()) return;
  get_or_create_session();
  make_incoming_table_if_needed();
  const std::string memory = std::to_string(memory_);
  std::vector<std::uint8_t> signature;
  RecordBytes scratch;
  bool thumbnails = false;
  bool features = false;
  CopyRows rows;
  const auto add_attachment = [&](ViewId view, const std::vector<std::uint8_t>& bytes) {
    if (bytes.empty()) {
      rows.add_null().add_null();
    } else {
      rows.add(std::span<const std::uint8_t>(bytes)).add(attachment_checksum(view, bytes));
    }
  };
  for (std::size_t i = 0; i < views.size(); ++i) {
    const NewView& view = views[i];
    pack_signature(view.signature, signature);
    rows.begin_row(12).add(std::int64_t{ids[i].value});
    add_info(rows, view.info);
    rows.add(std::span<const std::uint8_t>(signature));
    rows.add(view_checksum(scratch, ids[i], view.info, signature));
    add_attachment(ids[i], view.thumbnail);
    add_attachment(ids[i], view.features);
    thumbnails = thumbnails || !view.thumbnail.empty();
    features = features || !view.features.empty();
    record_changed_area(view.info.pose);
  }
  connection_.copy_in("COPY pg_temp.panonav_incoming FROM STDIN (FORMAT binary)", rows.finish());
  std::string sql =
      "SAVEPOINT rows; INSERT INTO panonav.views(memory, id, name, x_m, y_m, "
      "heading_rad, stamp_s, session, signature, checksum) SELECT " +
      memory + ", id, name, x_m, y_m, heading_rad, stamp_s, " + std::to_string(*session_) +
      ", signature, checksum FROM pg_temp.panonav_incoming;";
  const auto add_attachment_insert = [&](const std::string& table, const std::string& column) {
    sql += "INSERT INTO panonav." + table + "(memory, view, bytes, checksum) SELECT " + memory +
           ", id, " + column + ", " + column + "_checksum FROM pg_temp.panonav_incoming WHERE " +
           column + " IS NOT NULL;";
  };
  if (thumbnails) add_attachment_insert("thumbnails", "thumbnail");
  if (features) add_attachment_insert("features", "features");
  sql += "UPDATE panonav.memories SET last_view = " + std::to_string(ids.back().value) +
         " WHERE id = " + memory + "; RELEASE rows; TRUNCATE pg_temp.panonav_incoming";
  if (connection_.execute_unless_duplicate(sql)) return;
  connection_.execute("ROLLBACK TO rows");
  const Rows duplicate = run(
      "SELECT i.name FROM pg_temp.panonav_incoming i WHERE EXISTS (SELECT FROM panonav.views v "
      "WHERE v.memory = $1 AND v.name = i.name) OR EXISTS (SELECT FROM pg_temp.panonav_incoming j "
      "WHERE j.name = i.name AND j.id < i.id) ORDER BY i.id LIMIT 1");
  if (duplicate.size() == 0) fail_damaged("the id of a new view is taken");
  throw_used_name("view", duplicate.text(0, 0), path());
}

void PostgresqlTables::require_views(std::span<const ViewId> views) {
  if (views.empty()) return;
  const auto numbers = to_numbers(views);
  const Rows missing = connection_.run(
      "SELECT w.id FROM unnest($2) WITH ORDINALITY w(id, place) WHERE NOT EXISTS (SELECT FROM "
      "panonav.views v WHERE v.memory = $1 AND v.id = w.id) ORDER BY place LIMIT 1",
      Values().add(memory_).add(std::span<const std::int64_t>(numbers)));
  if (missing.size() > 0) throw_unknown_view({static_cast<std::uint32_t>(missing.integer(0, 0))});
}

void PostgresqlTables::record_changed_rows(const Rows& rows) {
  for (int i = 0; i < rows.size(); ++i) record_changed_area(rows.real(i, 0), rows.real(i, 1));
}

void PostgresqlTables::remove(std::span<const ViewId> views) {
  const auto numbers = to_numbers(views);
  const Values values = Values().add(memory_).add(std::span<const std::int64_t>(numbers));
  for (const char* sql :
       {"DELETE FROM panonav.links WHERE memory = $1 AND (a = ANY($2) OR b = ANY($2))",
        "DELETE FROM panonav.thumbnails WHERE memory = $1 AND view = ANY($2)",
        "DELETE FROM panonav.features WHERE memory = $1 AND view = ANY($2)"}) {
    connection_.run(sql, values);
  }
  record_changed_rows(connection_.run(
      "DELETE FROM panonav.views WHERE memory = $1 AND id = ANY($2) RETURNING x_m, y_m", values));
}

void PostgresqlTables::write_info(ViewId view, const ReferenceInfo& info, std::int64_t checksum) {
  const Rows before =
      connection_.run("SELECT x_m, y_m FROM panonav.views WHERE memory = $1 AND id = $2",
                      Values().add(memory_).add(std::int64_t{view.value}));
  Values values;
  values.add(memory_).add(std::int64_t{view.value}).add(checksum);
  add_info(values, info);
  if (!connection_.execute_unless_duplicate(
          "UPDATE panonav.views SET checksum = $3, name = $4, x_m = $5, y_m = $6, "
          "heading_rad = $7, stamp_s = $8 WHERE memory = $1 AND id = $2",
          &values)) {
    throw_used_name("view", info.name, path());
  }
  record_changed_rows(before);
  record_changed_area(info.pose);
}

void PostgresqlTables::read_views(const RowCallback<ViewRow>& consume) {
  connection_.stream("SELECT " + std::string(view_fields) +
                         " FROM panonav.views v WHERE v.memory = $1 ORDER BY v.id",
                     Values().add(memory_),
                     [&](const Rows& rows) { consume(read_view_row(rows)); });
}

void PostgresqlTables::read_views(std::span<const ViewId> views,
                                  const RowCallback<ViewRow>& consume) {
  const auto numbers = to_numbers(views);
  connection_.stream("SELECT " + std::string(view_fields) +
                         ", w.id FROM unnest($2) WITH ORDINALITY w(id, place) LEFT JOIN "
                         "panonav.views v ON v.memory = $1 AND v.id = w.id ORDER BY w.place",
                     Values().add(memory_).add(std::span<const std::int64_t>(numbers)),
                     [&](const Rows& rows) {
                       if (rows.is_null(0, 0)) {
                         throw_unknown_view({static_cast<std::uint32_t>(rows.integer(0, 8))});
                       }
                       consume(read_view_row(rows));
                     });
}

void PostgresqlTables::read_available_views(std::span<const ViewId> views,
                                            const RowCallback<ViewRow>& consume) {
  const auto numbers = to_numbers(views);
  connection_.stream("SELECT " + std::string(view_fields) +
                         " FROM panonav.views v WHERE v.memory = $1 AND v.id = ANY($2)",
                     Values().add(memory_).add(std::span<const std::int64_t>(numbers)),
                     [&](const Rows& rows) { consume(read_view_row(rows)); });
}

// Reads by COPY, which is faster than a statement that returns rows.
void PostgresqlTables::read_magnitudes(ViewId first, ViewId last, std::size_t bytes,
                                       const RowCallback<MagnitudesRow>& consume) {
  const std::string sql = "COPY (SELECT id, x_m, y_m, substr(signature, 1, " +
                          std::to_string(bytes) +
                          ") FROM panonav.views WHERE memory = " + std::to_string(memory_) +
                          " AND id BETWEEN " + std::to_string(first.value) + " AND " +
                          std::to_string(last.value) + " ORDER BY id) TO STDOUT (FORMAT binary)";
  connection_.copy_out(sql, 4, [&](std::span<const std::optional<std::string_view>> fields) {
    const auto number = [&](std::size_t field) {
      if (!fields[field] || fields[field]->size() != 8) fail_damaged("a view of a wrong type");
      return read_big_endian(*fields[field]);
    };
    MagnitudesRow row{to_view_id(static_cast<std::int64_t>(number(0))), std::nullopt, {}};
    if (fields[1] && fields[2]) {
      const Point2 position{std::bit_cast<double>(number(1)), std::bit_cast<double>(number(2))};
      if (is_position(position.x_m) && is_position(position.y_m)) row.position = position;
    }
    if (fields[3]) {
      row.magnitudes = {reinterpret_cast<const std::uint8_t*>(fields[3]->data()),
                        fields[3]->size()};
    }
    consume(row);
  });
}

std::optional<ViewId> PostgresqlTables::find(std::string_view name) {
  // The server refuses such texts as parameters, and no view there can have such a name.
  if (!is_utf8(name) || name.find('\0') != std::string_view::npos) return std::nullopt;
  const Rows rows = run("SELECT id FROM panonav.views WHERE memory = $1 AND name = $2", name);
  return rows.size() == 0 ? std::nullopt : std::optional(read_view_id(rows, 0, 0));
}

std::vector<std::string> PostgresqlTables::names() {
  return query_texts("SELECT name FROM panonav.views WHERE memory = $1 ORDER BY id");
}

std::vector<ViewId> PostgresqlTables::views() {
  std::vector<ViewId> views;  // read by COPY: there may be many
  connection_.copy_out("COPY (SELECT id FROM panonav.views WHERE memory = " +
                           std::to_string(memory_) + " ORDER BY id) TO STDOUT (FORMAT binary)",
                       1, [&](std::span<const std::optional<std::string_view>> fields) {
                         const std::uint64_t id = fields[0] ? read_big_endian(*fields[0]) : 0;
                         views.push_back(to_view_id(static_cast<std::int64_t>(id)));
                       });
  return views;
}

std::vector<PosedView> PostgresqlTables::views_within(const PositionBounds& bounds) {
  std::vector<PosedView> views;
  const Rows rows = connection_.run(
      "SELECT id, x_m, y_m, heading_rad FROM panonav.views WHERE memory = $1 AND x_m IS NOT NULL "
      "AND "
      "x_m BETWEEN $2 AND $3 AND y_m BETWEEN $4 AND $5 ORDER BY id",
      Values()
          .add(memory_)
          .add(std::optional(bounds.min_x_m))
          .add(std::optional(bounds.max_x_m))
          .add(std::optional(bounds.min_y_m))
          .add(std::optional(bounds.max_y_m)));
  for (int i = 0; i < rows.size(); ++i) {
    views.push_back(
        {read_view_id(rows, i, 0),
         {rows.real(i, 1).value_or(0.0), rows.real(i, 2).value_or(0.0), rows.real(i, 3)}});
  }
  return views;
}

bool PostgresqlTables::has_attachments(ViewAttachment table) {
  return run("SELECT (EXISTS (SELECT FROM " + attachment_table_name(table) +
             " WHERE memory = $1))::int4::int8")
             .integer(0, 0) != 0;
}

std::vector<ViewId> PostgresqlTables::views_with_attachment(ViewAttachment table) {
  std::vector<ViewId> views;
  const Rows rows =
      run("SELECT view FROM " + attachment_table_name(table) + " WHERE memory = $1 ORDER BY view");
  for (int i = 0; i < rows.size(); ++i) views.push_back(read_view_id(rows, i, 0));
  return views;
}

std::optional<StoredBytes> PostgresqlTables::bytes(ViewAttachment table, ViewId view) {
  const Rows rows = connection_.run("SELECT bytes, checksum FROM " + attachment_table_name(table) +
                                        " WHERE memory = $1 AND view = $2",
                                    Values().add(memory_).add(std::int64_t{view.value}));
  if (rows.size() == 0) return std::nullopt;
  return StoredBytes{rows.copy(0, 0), rows.integer(0, 1)};
}

void PostgresqlTables::write_links(std::span<const Link> links) {
  std::vector<std::int64_t> a, b, kinds, checksums;
  std::set<std::pair<ViewId, ViewId>> written;
  // Only the last of several links between the same two views is written, because one statement may
  // change a row only once.
  for (std::size_t i = links.size(); i-- > 0;) {
    const Link& link = links[i];
    if (!written.emplace(link.a, link.b).second) continue;
    a.push_back(link.a.value);
    b.push_back(link.b.value);
    kinds.push_back(static_cast<int>(link.kind));
    checksums.push_back(link_checksum(link));
  }
  using Numbers = std::span<const std::int64_t>;
  connection_.run(
      "INSERT INTO panonav.links(memory, a, b, kind, checksum) SELECT $1, * FROM unnest($2, $3, "
      "$4, $5) ON CONFLICT (memory, a, b) DO UPDATE SET kind = excluded.kind, checksum = "
      "excluded.checksum",
      Values()
          .add(memory_)
          .add(Numbers(a))
          .add(Numbers(b))
          .add(Numbers(kinds))
          .add(Numbers(checksums)));
}

void PostgresqlTables::erase_link(ViewId a, ViewId b) {
  connection_.run("DELETE FROM panonav.links WHERE memory = $1 AND a = $2 AND b = $3",
                  Values().add(memory_).add(std::int64_t{a.value}).add(std::int64_t{b.value}));
}

void PostgresqlTables::read_links(const RowCallback<LinkRow>& consume) {
  connection_.stream(
      "SELECT a, b, kind, checksum FROM panonav.links WHERE memory = $1 ORDER BY a, b",
      Values().add(memory_), [&](const Rows& rows) {
        consume({read_view_id(rows, 0, 0), read_view_id(rows, 0, 1), rows.integer(0, 2),
                 rows.integer(0, 3)});
      });
}

}  // namespace panonav::fleet
