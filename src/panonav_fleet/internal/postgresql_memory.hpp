#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "panonav/storage/internal/memory_tables.hpp"
#include "panonav_fleet/internal/postgresql_connection.hpp"
#include "panonav_fleet/memory_changes.hpp"

namespace panonav::fleet {

/// Adds name, x_m, y_m, heading_rad and stamp_s as the next values of a statement or fields of a
/// row.
template <class Fields>
void add_info(Fields& fields, const ReferenceInfo& info) {
  const auto& pose = info.pose;
  fields.add(std::string_view(info.name))
      .add(pose ? std::optional(pose->x_m) : std::nullopt)
      .add(pose ? std::optional(pose->y_m) : std::nullopt)
      .add(pose ? pose->heading_rad : std::nullopt)
      .add(info.stamp_s);
}

/// Reads the fields of `add_info` from a row, beginning at column `first`.
[[nodiscard]] inline ReferenceInfo read_info(const PostgresqlRows& rows, int row, int first) {
  ReferenceInfo info;
  info.name = rows.text(row, first);
  const auto x_m = rows.real(row, first + 1);
  const auto y_m = rows.real(row, first + 2);
  if (x_m && y_m) info.pose = ReferencePose{*x_m, *y_m, rows.real(row, first + 3)};
  info.stamp_s = rows.real(row, first + 4);
  return info;
}

[[nodiscard]] inline std::vector<std::int64_t> to_numbers(std::span<const ViewId> views) {
  std::vector<std::int64_t> numbers;
  for (const ViewId view : views) numbers.push_back(view.value);
  return numbers;
}

/// Accesses the rows of one memory on a server through its own connection.
class PostgresqlTables final : public MemoryTables {
 public:
  using Values = PostgresqlValues;
  using Rows = PostgresqlRows;

  PostgresqlTables(const ServerAddress& address, PostgresqlConnection connection,
                   std::int64_t memory, std::string channel);

  [[nodiscard]] const std::filesystem::path& path() const noexcept override {
    return connection_.printable();
  }
  [[nodiscard]] const std::filesystem::path& message_path() const noexcept override {
    return path();
  }
  [[nodiscard]] bool tolerates_bad_rows() const noexcept override { return true; }
  [[nodiscard]] std::unique_ptr<Transaction> transaction(Kind kind) override;

  [[nodiscard]] Settings settings() override;
  void write_setting(const std::string& key, const SettingValue& value) override;
  void erase_setting(const std::string& key) override;

  [[nodiscard]] std::uint32_t last_id() override;
  void insert(std::span<const ViewId> ids, std::span<const NewView> views) override;
  void require_views(std::span<const ViewId> views) override;
  void remove(std::span<const ViewId> views) override;
  void write_info(ViewId view, const ReferenceInfo& info, std::int64_t checksum) override;
  void read_views(const RowCallback<ViewRow>& consume) override;
  void read_views(std::span<const ViewId> views, const RowCallback<ViewRow>& consume) override;
  void read_available_views(std::span<const ViewId> views,
                            const RowCallback<ViewRow>& consume) override;
  void read_magnitudes(ViewId first, ViewId last, std::size_t bytes,
                       const RowCallback<MagnitudesRow>& consume) override;
  [[nodiscard]] std::optional<ViewId> find(std::string_view name) override;
  [[nodiscard]] std::vector<std::string> names() override;
  [[nodiscard]] std::vector<ViewId> views() override;
  [[nodiscard]] std::vector<PosedView> views_within(const PositionBounds& bounds) override;
  [[nodiscard]] std::vector<MemoryFile::ViewPlace> places() override;
  [[nodiscard]] std::vector<ViewId> views_with_attachment(ViewAttachment table) override;
  [[nodiscard]] bool has_attachments(ViewAttachment table) override;
  [[nodiscard]] std::optional<StoredBytes> bytes(ViewAttachment table, ViewId view) override;

  void write_links(std::span<const Link> links) override;
  void erase_link(ViewId a, ViewId b) override;
  void read_links(const RowCallback<LinkRow>& consume) override;

  void write_map(std::string_view name, const MapRow& row) override;
  [[nodiscard]] std::optional<MapRow> map(std::string_view name) override;
  void erase_map(std::string_view name) override;
  [[nodiscard]] std::vector<std::string> map_names() override;

  void write_route(std::string_view name, const RouteRow& row) override;
  [[nodiscard]] std::optional<RouteRow> route(std::string_view name) override;
  void erase_route(std::string_view name) override;
  [[nodiscard]] std::vector<std::string> route_names() override;
  void write_block(std::string_view route, std::int64_t number, std::span<const std::uint8_t> lines,
                   std::int64_t checksum) override;
  [[nodiscard]] std::optional<StoredBytes> block(std::string_view route,
                                                 std::int64_t number) override;
  [[nodiscard]] std::int64_t block_count(std::string_view route) override;
  [[nodiscard]] std::int64_t route_bytes(std::string_view route) override;
  [[nodiscard]] std::vector<std::string> list_routes_with_blocks() override;

  void run_undoably(const std::function<void()>& changes, const std::string& what) override;
  /// Returns at most one change, the last.
  [[nodiscard]] std::vector<MemoryFile::KeptChange> history() override;
  void undo() override;

  [[nodiscard]] std::set<ViewId> verify_structure(const Check& check) override;
  [[nodiscard]] MemoryFile::Info info() override;

  /// Commits the transaction in which the memory was created.
  void commit_creation() { connection_.execute("COMMIT"); }

  /// Returns the connection, for statements that only servers have (server_exchange.hpp).
  [[nodiscard]] PostgresqlConnection& connection() noexcept { return connection_; }
  [[nodiscard]] std::int64_t memory_id() const noexcept { return memory_; }
  /// Returns the areas changed since the last call as text for a notification, and clears them.
  /// Empty if there are many, or if views without a position were changed.
  [[nodiscard]] std::string consume_changed_areas();
  /// Returns the id of this connection's session, to which the views that it adds refer.
  std::int64_t get_or_create_session();
  /// Records a change at a position for the notification of the transaction.
  void record_changed_area(const std::optional<double>& x_m, const std::optional<double>& y_m) {
    if (x_m && y_m) {
      areas_.insert(to_memory_area(*x_m, *y_m));
    } else {
      changes_unplaced_views_ = true;
    }
  }
  void record_changed_area(const std::optional<ReferencePose>& pose) {
    if (pose) {
      record_changed_area(pose->x_m, pose->y_m);
    } else {
      changes_unplaced_views_ = true;
    }
  }

 private:
  class ServerTransaction;
  /// Runs a statement with the memory as $1.
  Rows run(const std::string& sql) { return connection_.run(sql, Values().add(memory_)); }
  Rows run(const std::string& sql, std::string_view name) {
    return connection_.run(sql, Values().add(memory_).add(name));
  }
  [[nodiscard]] ViewId read_view_id(const Rows& rows, int row, int column) const {
    return to_view_id(rows.integer(row, column));
  }
  [[nodiscard]] ViewRow read_view_row(const Rows& rows) const;
  [[nodiscard]] std::vector<std::string> query_texts(const std::string& sql);
  void make_incoming_table_if_needed();
  void record_changed_rows(const Rows& rows);
  void notify();

  std::optional<std::string> robot_;
  PostgresqlConnection connection_;
  std::int64_t memory_;
  std::string channel_;
  std::optional<std::int64_t> session_;
  bool has_incoming_ = false;            // temporary table exists
  std::set<MemoryArea> areas_;           // changed by the transaction
  bool changes_unplaced_views_ = false;  // by the transaction
};

struct FoundMemory {
  std::int64_t id = 0;
  std::string channel;
};

/// Result of `connect_to_memories`, which creates a missing schema if `make_schema`, and throws
/// FileError on a schema of another version.
struct MemoriesConnection {
  PostgresqlConnection connection;
  bool has_schema = false;
};
[[nodiscard]] MemoriesConnection connect_to_memories(const ServerAddress& address,
                                                     bool make_schema);
[[nodiscard]] std::optional<FoundMemory> find_memory(MemoriesConnection& memories,
                                                     const ServerAddress& address);
[[noreturn]] void throw_missing_memory(const ServerAddress& address);
/// Creates an empty memory on the server and, with enough rights, a missing schema and its roles
/// (docs/scale.md); `fill` runs in the same transaction. Throws FileError if a memory of that name
/// exists.
void create_postgresql_memory(const ServerAddress& address, const MemoryHeader& header,
                              const std::function<void(MemoryTables&)>& fill);

}  // namespace panonav::fleet
