#pragma once

#include <filesystem>
#include <memory>

#include "panonav/storage/checksum.hpp"
#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/internal/memory_tables.hpp"
#include "panonav/storage/internal/undo_changes.hpp"

namespace panonav {

/// The tables of an SQLite file whose schema has been checked (memory_schema.hpp).
class SqliteTables final : public MemoryTables {
 public:
  SqliteTables(std::filesystem::path path, Database database);

  [[nodiscard]] const std::filesystem::path& path() const noexcept override { return path_; }
  [[nodiscard]] const std::filesystem::path& message_path() const noexcept override {
    return database_.path();
  }
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
  [[nodiscard]] std::vector<MemoryFile::KeptChange> history() override;
  void undo() override;

  [[nodiscard]] std::set<ViewId> verify_structure(const Check& check) override;
  [[nodiscard]] MemoryFile::Info info() override;
  [[nodiscard]] MemoryFile::Counts counts() override;

  /// Returns the database, for the tables that only files have (synchronised_tables.hpp).
  [[nodiscard]] Database& database() noexcept { return database_; }

 private:
  [[nodiscard]] ViewId read_view_id(const Statement& row, int column) const;
  [[nodiscard]] ViewRow read_view_row(const Statement& row) const;
  void insert_attachments(ViewAttachment table, std::span<const ViewId> ids,
                          std::span<const NewView> views);
  [[nodiscard]] std::uint64_t count_attachments(ViewAttachment table);
  [[nodiscard]] std::uint64_t attachment_bytes(ViewAttachment table);
  [[nodiscard]] std::vector<std::string> query_texts(const char* sql);
  /// Throws for a view that a search for its id did not find: DamageError if the file lists it all
  /// the same, and otherwise as `throw_unknown_view`. Cost: one pass over all views.
  [[noreturn]] void fail_missing_view(ViewId view);
  /// Removes kept changes beyond the limits of `MemoryFile::change`.
  void shorten_history();
  /// Throws FileError if rows that `undo` has restored cannot be read.
  void require_intact(UndoneRows rows);

  std::filesystem::path path_;
  Database database_;
  std::vector<std::uint8_t> signature_;  // buffer, reused for every view
  RecordBytes scratch_;
  Statement insert_view_;
  Statement find_name_;
  Statement find_view_;
};

}  // namespace panonav
