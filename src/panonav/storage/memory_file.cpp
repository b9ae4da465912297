#include "panonav/storage/memory_file.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_file_access.hpp"
#include "panonav/storage/internal/memory_file_implementation.hpp"
#include "panonav/storage/internal/memory_schema.hpp"
#include "panonav/storage/internal/route_tables.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

namespace {

constexpr const char* view_columns =
    "id, name, x_m, y_m, heading_rad, stamp_s, signature, checksum";

void add_optional(RecordBytes& record, const std::optional<double>& value) {
  if (value) {
    record.add(*value);
  } else {
    record.add_null();
  }
}

// Over all fields of a view. The signature is hashed where it lies; the short fields are its seed.
std::int64_t view_checksum(RecordBytes& scratch, ViewId id, const ReferenceInfo& info,
                           std::span<const std::uint8_t> signature) {
  scratch.clear();
  scratch.add(std::int64_t{id.value});
  scratch.add(std::string_view(info.name));
  if (info.pose) {
    scratch.add(info.pose->x_m);
    scratch.add(info.pose->y_m);
    add_optional(scratch, info.pose->heading_rad);
  } else {
    for (int i = 0; i < 3; ++i) scratch.add_null();
  }
  add_optional(scratch, info.stamp_s);
  return static_cast<std::int64_t>(checksum(signature, checksum(scratch.bytes())));
}

// Of a thumbnail or of local features.
std::int64_t bytes_checksum(ViewId view, std::span<const std::uint8_t> bytes) {
  RecordBytes record;
  record.add(std::int64_t{view.value});
  return static_cast<std::int64_t>(checksum(bytes, checksum(record.bytes())));
}

std::int64_t link_checksum(const Link& link) {
  RecordBytes record;
  record.add(std::int64_t{link.a.value});
  record.add(std::int64_t{link.b.value});
  record.add(std::int64_t{static_cast<int>(link.kind)});
  return static_cast<std::int64_t>(checksum(record.bytes()));
}

// Links have no direction; a < b makes a pair unique.
Link ordered(Link link) {
  if (link.b < link.a) std::swap(link.a, link.b);
  return link;
}

void require_finite(const std::optional<ReferencePose>& pose) {
  if (!pose) return;
  require(std::isfinite(pose->x_m), "pose x_m", pose->x_m, "finite");
  require(std::isfinite(pose->y_m), "pose y_m", pose->y_m, "finite");
  if (pose->heading_rad) {
    require(std::isfinite(*pose->heading_rad), "pose heading_rad", *pose->heading_rad, "finite");
  }
}

void require_view(const NewView& view, SignatureShape shape) {
  if (view.signature.shape != shape || view.signature.magnitudes.size() != shape.size() ||
      view.signature.phases.size() != shape.size()) {
    throw ContractError(
        "signature shape",
        std::to_string(view.signature.shape.rows) + " rows x " +
            std::to_string(view.signature.shape.components) + " components",
        std::to_string(shape.rows) + " rows x " + std::to_string(shape.components) + " components");
  }
  if (view.info.name.empty()) throw ContractError("view name", "empty", "at least one character");
  require_finite(view.info.pose);
  if (view.info.stamp_s) {
    require(std::isfinite(*view.info.stamp_s), "stamp_s", *view.info.stamp_s, "finite");
  }
}

std::optional<double> optional_real(const Statement& row, int column) {
  if (row.is_null(column)) return std::nullopt;
  return row.real(column);
}

void bind_optional(Statement& statement, int parameter, const std::optional<double>& value) {
  if (value) {
    statement.bind(parameter, *value);
  } else {
    statement.bind_null(parameter);
  }
}

// x_m, y_m, heading_rad from parameter `first` on.
void bind_pose(Statement& statement, int first, const std::optional<ReferencePose>& pose) {
  bind_optional(statement, first, pose ? std::optional(pose->x_m) : std::nullopt);
  bind_optional(statement, first + 1, pose ? std::optional(pose->y_m) : std::nullopt);
  bind_optional(statement, first + 2, pose ? pose->heading_rad : std::nullopt);
}

}  // namespace

void refuse_view(ViewId view) {
  throw ContractError("view", std::to_string(view.value), "a view of the memory file");
}

void refuse_taken_name(std::string_view what, std::string_view name,
                       const std::filesystem::path& file) {
  throw ContractError(std::string(what) + " name",
                      "\"" + std::string(name) + "\", which " + file.string() + " already holds",
                      "a name that is unique");
}

void require_name(std::string_view what, std::string_view name) {
  constexpr std::size_t max_bytes = 4096;
  const bool control = std::ranges::any_of(
      name, [](char c) { return static_cast<unsigned char>(c) < 0x20U || c == 0x7F; });
  if (!name.empty() && !control && name.size() <= max_bytes) return;
  throw ContractError(std::string(what) + " name",
                      name.empty() ? "empty"
                      : control    ? "a text with control characters"
                                   : std::to_string(name.size()) + " bytes long",
                      "1 to " + std::to_string(max_bytes) + " bytes, no control characters");
}

MemoryFile::Implementation::Implementation(std::filesystem::path path_, Database database_,
                                           MemoryHeader header_)
    : path(std::move(path_)),
      database(std::move(database_)),
      header(std::move(header_)),
      insert_view(database,
                  "INSERT INTO views(id, name, x_m, y_m, heading_rad, stamp_s, signature, "
                  "checksum) VALUES(?, ?, ?, ?, ?, ?, ?, ?)"),
      insert_thumbnail(database, "INSERT INTO thumbnails(view, picture, checksum) VALUES(?, ?, ?)"),
      find_name(database, "SELECT id FROM views WHERE name = ?") {}

ViewId MemoryFile::Implementation::id_in(const Statement& row, int column) {
  const std::int64_t id = row.integer(column);
  if (id < 1 || id > std::int64_t{UINT32_MAX}) database.fail_damaged("a view id is out of range");
  return {static_cast<std::uint32_t>(id)};
}

StoredView MemoryFile::Implementation::view_in(const Statement& row) {
  StoredView view;
  view.id = id_in(row, 0);
  view.info.name = row.text(1);
  const auto x_m = optional_real(row, 2);
  const auto y_m = optional_real(row, 3);
  if (x_m && y_m) view.info.pose = ReferencePose{*x_m, *y_m, optional_real(row, 4)};
  view.info.stamp_s = optional_real(row, 5);
  view.signature = row.blob(6);
  if (view.signature.size() != 2 * header.shape.size() ||
      row.integer(7) != view_checksum(scratch, view.id, view.info, view.signature)) {
    database.fail_damaged("view " + std::to_string(view.id.value) + " does not match its checksum");
  }
  return view;
}

void MemoryFile::Implementation::append_row(const Statement& row, VisualMemory& memory) {
  StoredView view = view_in(row);
  const auto half = static_cast<std::ptrdiff_t>(header.shape.size());
  packed.shape = header.shape;
  packed.magnitudes.assign(view.signature.begin(), view.signature.begin() + half);
  packed.phases.assign(view.signature.begin() + half, view.signature.end());
  memory.append_as(view.id, packed, std::move(view.info));
}

std::uint32_t MemoryFile::Implementation::last_id() {
  // SQLite keeps it in a table without types, in which anything can stand.
  Statement rows(database, "SELECT name, seq FROM sqlite_sequence");
  std::int64_t last = 0;
  for (int count = 0; rows.step(); ++count) {
    if (rows.text(0) != "views" || count > 0) {
      database.fail_damaged("table sqlite_sequence holds more than the last view id");
    }
    last = rows.integer(1);
  }
  Statement largest(database, "SELECT id FROM views ORDER BY id DESC LIMIT 1");
  const std::int64_t id = largest.step() ? largest.integer(0) : 0;
  largest.reset();
  if (last < 0 || last >= std::int64_t{UINT32_MAX} || id > last) {
    database.fail_damaged("the last view id is " + std::to_string(last) + ", the largest " +
                          std::to_string(id) + "; allowed: 0 .. 2^32 - 2, not below the largest");
  }
  return static_cast<std::uint32_t>(last);
}

void MemoryFile::Implementation::insert(ViewId id, const NewView& view) {
  if (id.value == UINT32_MAX) database.fail_damaged("there is no id left for another view");
  signature.assign(view.signature.magnitudes.begin(), view.signature.magnitudes.end());
  signature.insert(signature.end(), view.signature.phases.begin(), view.signature.phases.end());
  insert_view.bind(1, std::int64_t{id.value}).bind(2, std::string_view(view.info.name));
  bind_pose(insert_view, 3, view.info.pose);
  bind_optional(insert_view, 6, view.info.stamp_s);
  insert_view.bind(7, std::span<const std::uint8_t>(signature))
      .bind(8, view_checksum(scratch, id, view.info, signature));
  const int constraint = insert_view.run();
  if (constraint == SQLITE_CONSTRAINT_UNIQUE) {
    refuse_taken_name("view", view.info.name, path);
  }
  if (constraint != 0) database.fail_damaged("the id of a new view is taken");
  if (!view.thumbnail.empty()) {
    insert_thumbnail.bind(1, std::int64_t{id.value})
        .bind(2, std::span<const std::uint8_t>(view.thumbnail))
        .bind(3, bytes_checksum(id, view.thumbnail));
    if (insert_thumbnail.run() != 0) database.fail_damaged("a thumbnail without a view");
  }
  if (!view.features.empty()) {
    // Older files that are only read have no such table.
    Statement insert(database, "INSERT INTO features(view, features, checksum) VALUES(?, ?, ?)");
    insert.bind(1, std::int64_t{id.value})
        .bind(2, std::span<const std::uint8_t>(view.features))
        .bind(3, bytes_checksum(id, view.features));
    if (insert.run() != 0) database.fail_damaged("local features without a view");
  }
}

bool MemoryFile::Implementation::contains(ViewId view) {
  Statement statement(database, "SELECT 1 FROM views WHERE id = ?");
  return statement.bind(1, std::int64_t{view.value}).step();
}

std::int64_t MemoryFile::Implementation::checksum_with(
    ViewId view, const std::function<void(ReferenceInfo&)>& change) {
  const std::string sql = std::string("SELECT ") + view_columns + " FROM views WHERE id = ?";
  Statement read(database, sql.c_str());
  if (!read.bind(1, std::int64_t{view.value}).step()) refuse_view(view);
  StoredView stored = view_in(read);
  change(stored.info);
  return view_checksum(scratch, view, stored.info, stored.signature);
}

Link MemoryFile::Implementation::link_in(const Statement& row) {
  Link link{id_in(row, 0), id_in(row, 1), LinkKind::sequence};
  const std::int64_t kind = row.integer(2);
  if (kind < 0 || kind > static_cast<int>(LinkKind::closure)) {
    database.fail_damaged("a link of unknown kind");
  }
  if (link.b <= link.a) {
    database.fail_damaged("a link of views " + std::to_string(link.a.value) + " and " +
                          std::to_string(link.b.value) + "; allowed: the smaller id first");
  }
  link.kind = static_cast<LinkKind>(kind);
  if (row.integer(3) != link_checksum(link)) {
    database.fail_damaged("the link of views " + std::to_string(link.a.value) + " and " +
                          std::to_string(link.b.value) + " does not match its checksum");
  }
  return link;
}

MemoryFile::MemoryFile(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
MemoryFile::~MemoryFile() = default;
MemoryFile::MemoryFile(MemoryFile&&) noexcept = default;
MemoryFile& MemoryFile::operator=(MemoryFile&&) noexcept = default;

MemoryFile MemoryFile::create(const std::filesystem::path& path, const MemoryHeader& header) {
  make_memory_file(path, header);
  return open(path, Access::read_write);
}

MemoryFile MemoryFile::open(const std::filesystem::path& path, Access access) {
  Database database = open_memory_database(path, access);
  std::optional<MemoryHeader> header;
  try {
    const Transaction reading(database, Transaction::Kind::reading);
    require_schema(database);
    header = header_from(read_settings(database));
  } catch (const FileError&) {
    database.leave_log_on_close();
    throw;
  } catch (const Error& error) {
    database.leave_log_on_close();
    database.fail_damaged(error.what());
  }
  if (access == Access::read_write) prepare_for_changes(database);
  // Members hold the database's address, so it must have its last one before they are made.
  return MemoryFile(
      std::make_unique<Implementation>(path, std::move(database), std::move(*header)));
}

const MemoryHeader& MemoryFile::header() const noexcept {
  return implementation_->header;
}
const std::filesystem::path& MemoryFile::path() const noexcept {
  return implementation_->path;
}

ViewId MemoryFile::append(const NewView& view) {
  return append(std::span(&view, 1)).front();
}

std::vector<ViewId> MemoryFile::append(std::span<const NewView> views) {
  for (const NewView& view : views) require_view(view, implementation_->header.shape);
  std::vector<ViewId> ids;
  ids.reserve(views.size());
  Transaction transaction(implementation_->database, Transaction::Kind::writing);
  std::uint32_t last = implementation_->last_id();
  for (const NewView& view : views) {
    implementation_->insert(ids.emplace_back(ViewId{++last}), view);
  }
  transaction.commit();
  return ids;
}

void MemoryFile::remove(std::span<const ViewId> views) {
  Database& database = implementation_->database;
  Statement links(database, "DELETE FROM links WHERE a = ?1 OR b = ?1");
  Statement thumbnail(database, "DELETE FROM thumbnails WHERE view = ?");
  Statement row(database, "DELETE FROM views WHERE id = ?");
  Transaction transaction(database, Transaction::Kind::writing);
  for (const ViewId view : views) {
    if (!implementation_->contains(view)) refuse_view(view);
    for (Statement* statement : {&links, &thumbnail, &row}) {
      static_cast<void>(statement->bind(1, std::int64_t{view.value}).run());
    }
  }
  if (has_map_table(database)) forget_in_maps(database, views);
  if (has_feature_table(database)) {
    Statement features(database, "DELETE FROM features WHERE view = ?");
    for (const ViewId view : views) {
      static_cast<void>(features.bind(1, std::int64_t{view.value}).run());
    }
  }
  transaction.commit();
}

void MemoryFile::set_pose(ViewId view, const std::optional<ReferencePose>& pose) {
  require_finite(pose);
  Database& database = implementation_->database;
  Transaction transaction(database, Transaction::Kind::writing);
  const std::int64_t new_checksum =
      implementation_->checksum_with(view, [&](ReferenceInfo& info) { info.pose = pose; });
  Statement write(database,
                  "UPDATE views SET x_m = ?, y_m = ?, heading_rad = ?, checksum = ? WHERE id = ?");
  bind_pose(write, 1, pose);
  static_cast<void>(write.bind(4, new_checksum).bind(5, std::int64_t{view.value}).run());
  transaction.commit();
}

void MemoryFile::rename(ViewId view, std::string_view name) {
  require_name("view", name);
  Database& database = implementation_->database;
  Transaction transaction(database, Transaction::Kind::writing);
  const std::int64_t new_checksum =
      implementation_->checksum_with(view, [&](ReferenceInfo& info) { info.name = name; });
  Statement write(database, "UPDATE views SET name = ?, checksum = ? WHERE id = ?");
  write.bind(1, name).bind(2, new_checksum).bind(3, std::int64_t{view.value});
  if (write.run() != 0) refuse_taken_name("view", name, path());
  transaction.commit();
}

void MemoryFile::link(std::span<const Link> links) {
  Database& database = implementation_->database;
  Statement insert(
      database,
      "INSERT INTO links(a, b, kind, checksum) VALUES(?, ?, ?, ?) ON CONFLICT(a, b) DO "
      "UPDATE SET kind = excluded.kind, checksum = excluded.checksum");
  Transaction transaction(database, Transaction::Kind::writing);
  for (const Link& given : links) {
    const Link link = ordered(given);
    if (link.a == link.b) {
      throw ContractError("link", "of view " + std::to_string(link.a.value) + " to itself",
                          "two different views");
    }
    for (const ViewId view : {link.a, link.b}) {
      if (!implementation_->contains(view)) refuse_view(view);
    }
    insert.bind(1, std::int64_t{link.a.value})
        .bind(2, std::int64_t{link.b.value})
        .bind(3, std::int64_t{static_cast<int>(link.kind)})
        .bind(4, link_checksum(link));
    static_cast<void>(insert.run());
  }
  transaction.commit();
}

void MemoryFile::unlink(ViewId a, ViewId b) {
  const Link pair = ordered({a, b, LinkKind::sequence});
  Transaction transaction(implementation_->database, Transaction::Kind::writing);
  Statement erase(implementation_->database, "DELETE FROM links WHERE a = ? AND b = ?");
  static_cast<void>(
      erase.bind(1, std::int64_t{pair.a.value}).bind(2, std::int64_t{pair.b.value}).run());
  transaction.commit();
}

std::optional<ViewId> MemoryFile::find(std::string_view name) const {
  Statement& statement = implementation_->find_name;
  std::optional<ViewId> found;
  if (statement.bind(1, name).step()) found = implementation_->id_in(statement, 0);
  statement.reset();
  return found;
}

std::vector<std::string> MemoryFile::names() const {
  std::vector<std::string> names;
  Statement rows(implementation_->database, "SELECT name, id FROM views ORDER BY id");
  std::int64_t before = 0;
  while (rows.step()) {
    if (rows.integer(1) <= before) implementation_->database.fail_damaged("views are out of order");
    before = rows.integer(1);
    names.emplace_back(rows.text(0));
  }
  return names;
}

std::vector<ViewId> MemoryFile::views_with_thumbnail() const {
  std::vector<ViewId> views;
  Statement rows(implementation_->database, "SELECT view FROM thumbnails ORDER BY view");
  while (rows.step()) {
    const ViewId view = implementation_->id_in(rows, 0);
    if (!views.empty() && view <= views.back()) {
      implementation_->database.fail_damaged("thumbnails are out of order");
    }
    views.push_back(view);
  }
  return views;
}

std::optional<std::vector<std::uint8_t>> MemoryFile::thumbnail(ViewId view) const {
  Database& database = implementation_->database;
  if (!implementation_->contains(view)) refuse_view(view);
  Statement row(database, "SELECT picture, checksum FROM thumbnails WHERE view = ?");
  if (!row.bind(1, std::int64_t{view.value}).step()) return std::nullopt;
  const auto picture = row.blob(0);
  if (row.integer(1) != bytes_checksum(view, picture)) {
    database.fail_damaged("the thumbnail of view " + std::to_string(view.value) +
                          " does not match its checksum");
  }
  return std::vector<std::uint8_t>(picture.begin(), picture.end());
}

std::optional<std::vector<std::uint8_t>> MemoryFile::features(ViewId view) const {
  Database& database = implementation_->database;
  if (!implementation_->contains(view)) refuse_view(view);
  if (!has_feature_table(database)) return std::nullopt;
  Statement row(database, "SELECT features, checksum FROM features WHERE view = ?");
  if (!row.bind(1, std::int64_t{view.value}).step()) return std::nullopt;
  const auto features = row.blob(0);
  if (row.integer(1) != bytes_checksum(view, features)) {
    database.fail_damaged("the local features of view " + std::to_string(view.value) +
                          " do not match their checksum");
  }
  return std::vector<std::uint8_t>(features.begin(), features.end());
}

void MemoryFile::set_parameter(std::string_view name, std::string_view value) {
  Transaction transaction(implementation_->database, Transaction::Kind::writing);
  write_setting(implementation_->database, "parameter." + std::string(name), std::string(value));
  transaction.commit();
}

std::optional<std::string> MemoryFile::parameter(std::string_view name) const {
  const Settings settings = read_settings(implementation_->database);
  const auto found = settings.find("parameter." + std::string(name));
  if (found == settings.end()) return std::nullopt;
  const auto* text = std::get_if<std::string>(&found->second);
  if (text == nullptr) implementation_->database.fail_damaged("parameter " + std::string(name));
  return *text;
}

VisualMemory MemoryFile::load() const {
  Database& database = implementation_->database;
  const MemoryHeader& header = implementation_->header;
  VisualMemory memory(header.shape, header.full_scale, header.elevations);
  const Transaction reading(database, Transaction::Kind::reading);
  try {
    const std::string sql = std::string("SELECT ") + view_columns + " FROM views ORDER BY id";
    Statement rows(database, sql.c_str());
    while (rows.step()) implementation_->append_row(rows, memory);
    // A page that lost its cells loses views without a fault of their own; the index of the names,
    // which lies on other pages, still counts them.
    const std::int64_t count = database.integer(
        "SELECT count(*) FROM views INDEXED BY sqlite_autoindex_views_1 WHERE name > ''");
    if (count != static_cast<std::int64_t>(memory.size())) {
      database.fail_damaged("it holds " + std::to_string(memory.size()) + " of " +
                            std::to_string(count) + " views");
    }
    implementation_->for_links([&](const Link& link) { memory.link(link); });
  } catch (const ContractError& error) {
    database.fail_damaged(error.what());
  }
  return memory;
}

VisualMemory MemoryFile::load(std::span<const ViewId> views) const {
  for (std::size_t i = 1; i < views.size(); ++i) {
    require(views[i - 1] < views[i], "views", static_cast<double>(views[i].value), "ascending");
  }
  Database& database = implementation_->database;
  const MemoryHeader& header = implementation_->header;
  VisualMemory memory(header.shape, header.full_scale, header.elevations);
  const Transaction reading(database, Transaction::Kind::reading);
  const std::string sql = std::string("SELECT ") + view_columns + " FROM views WHERE id = ?";
  Statement row(database, sql.c_str());
  for (const ViewId view : views) {
    if (!row.bind(1, std::int64_t{view.value}).step()) {
      // The index of the names lies on other pages: it still knows what the table has lost.
      Statement named(database,
                      "SELECT 1 FROM views INDEXED BY sqlite_autoindex_views_1 WHERE id = ?");
      if (!named.bind(1, std::int64_t{view.value}).step()) refuse_view(view);
      database.fail_damaged("view " + std::to_string(view.value) + " is missing");
    }
    try {
      implementation_->append_row(row, memory);
    } catch (const ContractError& error) {
      database.fail_damaged(error.what());
    }
    row.reset();
  }
  return memory;
}

std::vector<ViewId> MemoryFile::views() const {
  Database& database = implementation_->database;
  std::vector<ViewId> views;
  // The index of the names holds the ids, too, on far fewer pages than the table.
  Statement ids(database, "SELECT id FROM views INDEXED BY sqlite_autoindex_views_1");
  while (ids.step()) views.push_back(implementation_->id_in(ids, 0));
  std::ranges::sort(views);
  return views;
}

std::vector<Link> MemoryFile::links() const {
  std::vector<Link> links;
  const Transaction reading(implementation_->database, Transaction::Kind::reading);
  implementation_->for_links([&](const Link& link) { links.push_back(link); });
  return links;
}

std::vector<MemoryFault> MemoryFile::verify() const {
  Database& database = implementation_->database;
  std::vector<MemoryFault> faults;
  // Whatever goes wrong in one part must not hide the faults of the others.
  const auto check = [&](std::optional<ViewId> view, const auto& part) {
    try {
      part();
    } catch (const Error& error) {
      const std::string prefix = database.path().string() + ": ";
      std::string what = error.what();
      if (what.starts_with(prefix)) what.erase(0, prefix.size());
      if (what.starts_with("is damaged: ")) what.erase(0, 12);
      faults.push_back({view, std::move(what)});
    }
  };
  const Transaction reading(database, Transaction::Kind::reading);
  // The full check counts the entries of indexes, which has no end where pages refer to each other:
  // the quick one finds such pages.
  for (const char* sql : {"PRAGMA quick_check", "PRAGMA integrity_check"}) {
    if (!faults.empty()) break;
    check(std::nullopt, [&] {
      Statement rows(database, sql);
      while (rows.step()) {
        std::string line(rows.text(0));
        std::ranges::replace(line, '\n', ' ');
        if (line != "ok") faults.push_back({std::nullopt, std::move(line)});
      }
    });
  }
  check(std::nullopt, [&] { static_cast<void>(header_from(read_settings(database))); });

  check(std::nullopt, [&] { static_cast<void>(implementation_->last_id()); });
  // From the table and from the index of the names: a view that either has lost is found in the
  // other.
  std::set<ViewId> views;
  for (const char* sql : {"SELECT id FROM views NOT INDEXED ORDER BY id",
                          "SELECT id FROM views INDEXED BY sqlite_autoindex_views_1"}) {
    check(std::nullopt, [&] {
      Statement ids(database, sql);
      while (ids.step()) views.insert(implementation_->id_in(ids, 0));
    });
  }
  check(std::nullopt, [&] {
    const std::string sql = std::string("SELECT ") + view_columns + " FROM views WHERE id = ?";
    Statement row(database, sql.c_str());
    for (const ViewId view : views) {
      check(view, [&] {
        if (!row.bind(1, std::int64_t{view.value}).step()) database.fail_damaged("view is missing");
        static_cast<void>(implementation_->view_in(row));
      });
      row.reset();
    }
  });
  const auto check_beside_views = [&](const char* table, const auto& read) {
    check(std::nullopt, [&] {
      Statement ids(database,
                    ("SELECT view FROM " + std::string(table) + " ORDER BY view").c_str());
      ViewId before{0};
      while (ids.step()) {
        const ViewId view = implementation_->id_in(ids, 0);
        if (view <= std::exchange(before, view)) {
          database.fail_damaged(std::string(table) + " are out of order");
        }
        check(view, [&] {
          if (!views.contains(view)) {
            database.fail_damaged("an entry of " + std::string(table) + " without a view");
          }
          static_cast<void>(read(view));
        });
      }
    });
  };
  check_beside_views("thumbnails", [&](ViewId view) { return thumbnail(view); });
  if (has_feature_table(database)) {
    check_beside_views("features", [&](ViewId view) { return features(view); });
  }
  check(std::nullopt, [&] {
    Statement links(database, "SELECT a, b, kind, checksum FROM links ORDER BY a, b");
    std::pair<std::int64_t, std::int64_t> before{0, 0};
    while (links.step()) {
      const std::pair ends(links.integer(0), links.integer(1));
      if (ends <= std::exchange(before, ends)) database.fail_damaged("links are out of order");
      check(std::nullopt, [&] {
        const Link link = implementation_->link_in(links);
        if (!views.contains(link.a) || !views.contains(link.b)) {
          database.fail_damaged("a link of views " + std::to_string(link.a.value) + " and " +
                                std::to_string(link.b.value) + ", of which one is missing");
        }
      });
    }
  });
  check(std::nullopt, [&] {
    if (!has_map_table(database)) return;
    verify_maps(
        database, [&](ViewId view) { return views.contains(view); },
        [&](const std::function<void()>& part) { check(std::nullopt, part); });
  });
  check(std::nullopt, [&] {
    if (!has_route_tables(database)) return;
    verify_routes(database, [&](const std::function<void()>& part) { check(std::nullopt, part); });
  });
  check(std::nullopt, [&] { static_cast<void>(undoable()); });
  return faults;
}

MemoryFileInfo MemoryFile::info() const {
  Database& database = implementation_->database;
  const Transaction reading(database, Transaction::Kind::reading);
  const auto count = [&](const char* sql) {
    return static_cast<std::uint64_t>(database.integer(sql));
  };
  MemoryFileInfo info;
  // A condition makes SQLite step through the rows, which is bounded, instead of counting the
  // entries of pages, which is not.
  info.views = count("SELECT count(*) FROM views WHERE id > 0");
  info.views_with_position = count("SELECT count(x_m) FROM views WHERE id > 0");
  info.views_with_heading = count("SELECT count(heading_rad) FROM views WHERE id > 0");
  info.links = count("SELECT count(*) FROM links WHERE a > 0");
  info.thumbnails = count("SELECT count(*) FROM thumbnails WHERE view > 0");
  if (has_feature_table(database)) {
    info.views_with_features = count("SELECT count(*) FROM features WHERE view > 0");
    info.feature_bytes =
        count("SELECT coalesce(sum(length(features)), 0) FROM features WHERE view > 0");
  }
  if (has_chain_tables(database)) {
    info.unused_chains = count("SELECT count(*) FROM (SELECT 1 FROM chains LIMIT 1000000)");
  }
  if (has_map_table(database)) info.maps = count("SELECT count(*) FROM maps WHERE name > ''");
  if (has_route_tables(database))
    info.routes = count("SELECT count(*) FROM routes WHERE name > ''");
  info.format_version = static_cast<int>(database.integer("PRAGMA user_version"));
  for (const char* suffix : {"", "-wal"}) {
    std::filesystem::path file = database.path();
    file += suffix;
    std::error_code missing;
    const auto size = std::filesystem::file_size(file, missing);
    if (!missing) info.file_bytes += size;
  }
  return info;
}

}  // namespace panonav
