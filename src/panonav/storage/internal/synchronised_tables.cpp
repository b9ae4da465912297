#include "panonav/storage/internal/synchronised_tables.hpp"

#include <variant>

#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/internal/memory_rows.hpp"

namespace panonav {

namespace {

constexpr const char* file_key = "synchronised.file";
constexpr const char* memory_key = "synchronised.memory";
constexpr const char* last_view_key = "synchronised.last_view";
constexpr const char* number_key = "synchronised.number";

std::int64_t row_checksum(ViewId view, const SynchronisedView& row) {
  RecordBytes record;
  record.add(std::int64_t{view.value});
  if (row.server_view) {
    record.add(std::int64_t{row.server_view->value});
  } else {
    record.add_null();
  }
  record.add(row.local_checksum);
  record.add(row.server_checksum);
  record.add(row.signature);
  record.add(std::int64_t{row.uploaded ? 1 : 0});
  record.add(row.sent);
  return static_cast<std::int64_t>(checksum(record.bytes()));
}

}  // namespace

std::int64_t signature_checksum(std::span<const std::uint8_t> signature) {
  return static_cast<std::int64_t>(checksum(signature));
}

SynchronisedViews read_synchronised_views(SqliteTables& file) {
  SynchronisedViews views;
  Statement rows(file.database(),
                 "SELECT view, server_view, local_checksum, server_checksum, signature, uploaded, "
                 "sent, checksum FROM synchronised ORDER BY view");
  while (rows.step()) {
    const ViewId view = file.to_view_id(rows.integer(0));
    SynchronisedView row;
    if (!rows.is_null(1)) row.server_view = file.to_view_id(rows.integer(1));
    row.local_checksum = rows.integer(2);
    row.server_checksum = rows.integer(3);
    row.signature = rows.integer(4);
    row.uploaded = rows.integer(5) != 0;
    if (!rows.is_null(6)) row.sent = rows.integer(6);
    if (rows.integer(7) != row_checksum(view, row)) {
      file.fail_damaged("what is synchronised of view " + std::to_string(view.value) +
                        " does not match its checksum");
    }
    views.emplace(view, row);
  }
  return views;
}

void write_synchronised_view(SqliteTables& file, ViewId view, const SynchronisedView& row) {
  run_statement(
      file.database(),
      "INSERT OR REPLACE INTO synchronised(view, server_view, local_checksum, server_checksum, "
      "signature, uploaded, sent, checksum) VALUES(?, ?, ?, ?, ?, ?, ?, ?)",
      view, row.server_view, row.local_checksum, row.server_checksum, row.signature,
      std::int64_t{row.uploaded ? 1 : 0}, row.sent, row_checksum(view, row));
}

void erase_synchronised_view(SqliteTables& file, ViewId view) {
  run_statement(file.database(), "DELETE FROM synchronised WHERE view = ?", view);
}

SynchronisedLinks read_synchronised_links(SqliteTables& file) {
  SynchronisedLinks links;
  Statement rows(file.database(), "SELECT a, b, kind, checksum FROM synchronised_links");
  while (rows.step()) {
    Link link{file.to_view_id(rows.integer(0)), file.to_view_id(rows.integer(1)),
              Link::Kind::sequence};
    const std::int64_t kind = rows.integer(2);
    link.kind = static_cast<Link::Kind>(kind);
    if (kind < 0 || kind > static_cast<int>(Link::Kind::closure) ||
        rows.integer(3) != link_checksum(link)) {
      file.fail_damaged("what is synchronised of a link does not match its checksum");
    }
    links.emplace(std::pair(link.a, link.b), link.kind);
  }
  return links;
}

void write_synchronised_link(SqliteTables& file, const Link& link) {
  run_statement(
      file.database(),
      "INSERT OR REPLACE INTO synchronised_links(a, b, kind, checksum) VALUES(?, ?, ?, ?)", link.a,
      link.b, static_cast<std::int64_t>(link.kind), link_checksum(link));
}

void erase_synchronised_link(SqliteTables& file, ViewId a, ViewId b) {
  run_statement(file.database(), "DELETE FROM synchronised_links WHERE a = ? AND b = ?", a, b);
}

std::map<ViewId, std::int64_t> read_view_checksums(SqliteTables& file) {
  std::map<ViewId, std::int64_t> checksums;
  Statement rows(file.database(), "SELECT id, checksum FROM views ORDER BY id");
  while (rows.step()) checksums.emplace(file.to_view_id(rows.integer(0)), rows.integer(1));
  return checksums;
}

std::int64_t make_random_number(SqliteTables& file) {
  return file.database().integer("SELECT random() & 9223372036854775807");
}

std::string make_random_identity(SqliteTables& file) {
  Statement row(file.database(), "SELECT lower(hex(randomblob(16)))");
  return row.step() ? std::string(row.text(0)) : "";
}

std::map<ViewId, std::pair<double, double>> read_positions(SqliteTables& file) {
  std::map<ViewId, std::pair<double, double>> positions;
  Statement rows(file.database(),
                 "SELECT id, x_m, y_m FROM views WHERE x_m IS NOT NULL AND y_m IS NOT NULL");
  while (rows.step()) positions[file.to_view_id(rows.integer(0))] = {rows.real(1), rows.real(2)};
  return positions;
}

SynchronisedState read_synchronised_state(SqliteTables& file) {
  SynchronisedState state;
  const Settings settings = file.settings();
  const auto read = [&](const char* key, auto& value) {
    const auto found = settings.find(key);
    if (found == settings.end()) return;
    const auto* known = std::get_if<std::remove_cvref_t<decltype(value)>>(&found->second);
    if (known == nullptr) file.fail_damaged("setting " + std::string(key));
    value = *known;
  };
  read(file_key, state.file);
  read(memory_key, state.memory);
  read(last_view_key, state.last_view);
  read(number_key, state.number);
  return state;
}

void write_synchronised_state(SqliteTables& file, const SynchronisedState& state) {
  file.write_setting(file_key, state.file);
  file.write_setting(memory_key, state.memory);
  file.write_setting(last_view_key, state.last_view);
  file.write_setting(number_key, state.number);
}

}  // namespace panonav
