#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/memory/view_index.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav/storage/memory_header.hpp"

namespace panonav {

/// A row of the table of views as stored, before any check. `signature` is valid until the next row
/// is read.
struct ViewRow {
  ViewId id;
  ReferenceInfo info;
  std::span<const std::uint8_t> signature;
  std::int64_t checksum = 0;
};

/// The columns that sketches are computed from; no checksum covers only these.
struct MagnitudesRow {
  ViewId id;
  std::optional<Point2> position;
  std::span<const std::uint8_t> magnitudes;  ///< valid until the next row is read
};

struct LinkRow {
  ViewId a, b;
  std::int64_t kind = 0;
  std::int64_t checksum = 0;
};

struct MapRow {
  std::vector<std::uint8_t> nodes, edges;
  std::int64_t checksum = 0;
};

struct RouteRow {
  std::int64_t columns = 0;
  std::int64_t lines = 0;
  std::int64_t checksum = 0;
};

/// A thumbnail, local features, or a block of lines of a route.
struct StoredBytes {
  std::vector<std::uint8_t> bytes;
  std::int64_t checksum = 0;
};

/// Tables of bytes that some views have.
enum class ViewAttachment { thumbnails, features };

/// Thrown for a row with content that our programs never write; the other rows may be correct.
class DamageError : public FileError {
 public:
  using FileError::FileError;
};

/// Storage of the rows of one memory: an SQLite file or a PostgreSQL server. It stores rows;
/// `MemoryFile`, map_tables.hpp and route_tables.hpp decide what rows mean and what is refused.
/// Functions throw FileError of one line that names the memory if the database refuses anything.
class MemoryTables {
 public:
  enum class Kind { reading, writing };

  /// Rolls back at destruction unless committed. A transaction within a writing one is a part of
  /// it: it can be rolled back alone, and is committed with the whole.
  class Transaction {
   public:
    Transaction() = default;
    virtual ~Transaction() = default;
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;
    /// Returns once everything is on the disk.
    virtual void commit() = 0;
  };
  template <class Row>
  using RowCallback = std::function<void(const Row&)>;
  /// Runs a part of `verify` and collects the error that it throws.
  using Check = std::function<void(const std::function<void()>&)>;

  MemoryTables() = default;
  virtual ~MemoryTables() = default;
  MemoryTables(const MemoryTables&) = delete;
  MemoryTables& operator=(const MemoryTables&) = delete;

  /// Returns the path or address as it was passed.
  [[nodiscard]] virtual const std::filesystem::path& path() const noexcept = 0;
  /// Returns the path that is named in messages about damage.
  [[nodiscard]] virtual const std::filesystem::path& message_path() const noexcept = 0;
  /// Throws DamageError.
  [[noreturn]] void fail_damaged(std::string_view what) const;
  /// Throws DamageError on a link one of whose views is missing.
  [[noreturn]] void fail_link_without_view(const Link& link) const;
  /// True if others than the user of this program may write rows, as on a server. A bad row is then
  /// left out and reported, so that it does not block access to the other rows; in a file it is an
  /// error.
  [[nodiscard]] virtual bool tolerates_bad_rows() const noexcept { return false; }
  /// Runs `work`, which reads one row. Returns false if it threw DamageError and the row was left
  /// out. If bad rows are not tolerated, the error is thrown on, as all other errors are.
  template <class Work>
  bool accept_row(std::optional<ViewId> view, const Work& work) {
    try {
      work();
      return true;
    } catch (const DamageError& error) {
      if (!tolerates_bad_rows()) throw;
      record_skipped_row(view, error.what());
      return false;
    }
  }
  /// Records that a row was left out and reports it to the handler of `set_skipped_row_handler`,
  /// unless that was done before. `view` is the view that is missing because of that; nullopt for
  /// other rows.
  void record_skipped_row(std::optional<ViewId> view, std::string_view what);
  /// Largest number of recorded faults, chosen so that recording one more stays cheap.
  static constexpr std::size_t max_left_out = 1000;
  /// Returns the rows left out since the memory was opened, at most `max_left_out`.
  [[nodiscard]] const std::vector<MemoryFile::Fault>& left_out() const noexcept {
    return left_out_;
  }
  /// True if the view itself was left out.
  [[nodiscard]] bool is_left_out(ViewId view) const { return left_out_views_.contains(view); }
  [[nodiscard]] const std::set<ViewId>& left_out_views() const noexcept { return left_out_views_; }
  /// Removes the memory's path and "is damaged: " from the beginning of a message.
  [[nodiscard]] std::string shorten_message(std::string_view message) const;
  /// Converts a stored number to a view id. Throws FileError if it is out of range.
  [[nodiscard]] ViewId to_view_id(std::int64_t number) const;
  /// Checks a row and returns it. Throws DamageError if it does not match its checksum, and as
  /// `check_info`.
  const ViewRow& check_row(const ViewRow& row, SignatureShape shape, RecordBytes& scratch) const;
  /// Throws DamageError on values out of range (`validate` of reference_validation.hpp).
  void check_info(ViewId view, const ReferenceInfo& info) const;
  /// Throws DamageError if the bytes do not match their checksum.
  void check_attachment(ViewAttachment table, ViewId view, const StoredBytes& stored) const;
  /// Returns the link of the row. Throws DamageError if its checksum or its values are wrong.
  [[nodiscard]] Link check_row(const LinkRow& row) const;
  [[nodiscard]] virtual std::unique_ptr<Transaction> transaction(Kind kind) = 0;

  /// Returns all settings, after checking their checksums.
  [[nodiscard]] virtual Settings settings() = 0;
  /// Sets the value of a key.
  virtual void write_setting(const std::string& key, const SettingValue& value) = 0;
  virtual void erase_setting(const std::string& key) = 0;

  /// Returns the largest id that a view ever had; 0: none.
  [[nodiscard]] virtual std::uint32_t last_id() = 0;
  /// Adds views, whose ids are above `last_id` and ascending. Throws as `throw_used_name`.
  virtual void insert(std::span<const ViewId> ids, std::span<const NewView> views) = 0;
  /// Throws as `throw_unknown_view` for the first of these views that does not exist.
  virtual void require_views(std::span<const ViewId> views) = 0;
  /// Removes views with their links, thumbnails and features.
  virtual void remove(std::span<const ViewId> views) = 0;
  /// Replaces name, pose, stamp and checksum of a view. Throws as `throw_used_name`.
  virtual void write_info(ViewId view, const ReferenceInfo& info, std::int64_t checksum) = 0;
  /// Reads all views, by ascending id.
  virtual void read_views(const RowCallback<ViewRow>& consume) = 0;
  /// Reads these views, in this order. Throws as `throw_unknown_view`.
  virtual void read_views(std::span<const ViewId> views, const RowCallback<ViewRow>& consume) = 0;
  /// Reads those of the views that exist, in any order.
  virtual void read_available_views(std::span<const ViewId> views,
                                    const RowCallback<ViewRow>& consume) = 0;
  /// Reads the first `bytes` bytes of the signatures of the views with ids first .. last, by
  /// ascending id.
  virtual void read_magnitudes(ViewId first, ViewId last, std::size_t bytes,
                               const RowCallback<MagnitudesRow>& consume) = 0;
  [[nodiscard]] virtual std::optional<ViewId> find(std::string_view name) = 0;
  /// Returns the names of all views by ascending id.
  [[nodiscard]] virtual std::vector<std::string> names() = 0;
  /// Returns the ids of all views, ascending.
  [[nodiscard]] virtual std::vector<ViewId> views() = 0;
  /// Returns the views within the bounds, ascending.
  [[nodiscard]] virtual std::vector<PosedView> views_within(const PositionBounds& bounds) = 0;
  /// Returns where all views were taken, ascending.
  [[nodiscard]] virtual std::vector<MemoryFile::ViewPlace> places() = 0;
  /// Returns the views that have an entry in the table, ascending.
  [[nodiscard]] virtual std::vector<ViewId> views_with_attachment(ViewAttachment table) = 0;
  [[nodiscard]] virtual bool has_attachments(ViewAttachment table) = 0;
  [[nodiscard]] virtual std::optional<StoredBytes> bytes(ViewAttachment table, ViewId view) = 0;
  /// Returns the bytes after checking them; nullopt if there are none. Throws as
  /// `throw_unknown_view`, and DamageError if they do not match their checksum.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> read_checked_bytes(ViewAttachment table,
                                                                            ViewId view);

  /// Writes links with a < b; an existing pair gets the new kind.
  virtual void write_links(std::span<const Link> links) = 0;
  virtual void erase_link(ViewId a, ViewId b) = 0;
  /// Reads all links, ascending.
  virtual void read_links(const RowCallback<LinkRow>& consume) = 0;

  virtual void write_map(std::string_view name, const MapRow& row) = 0;
  [[nodiscard]] virtual std::optional<MapRow> map(std::string_view name) = 0;
  virtual void erase_map(std::string_view name) = 0;
  /// Returns the names, ascending.
  [[nodiscard]] virtual std::vector<std::string> map_names() = 0;

  virtual void write_route(std::string_view name, const RouteRow& row) = 0;
  [[nodiscard]] virtual std::optional<RouteRow> route(std::string_view name) = 0;
  /// Removes a route with its blocks.
  virtual void erase_route(std::string_view name) = 0;
  /// Returns the names, ascending.
  [[nodiscard]] virtual std::vector<std::string> route_names() = 0;
  virtual void write_block(std::string_view route, std::int64_t number,
                           std::span<const std::uint8_t> lines, std::int64_t checksum) = 0;
  [[nodiscard]] virtual std::optional<StoredBytes> block(std::string_view route,
                                                         std::int64_t number) = 0;
  [[nodiscard]] virtual std::int64_t block_count(std::string_view route) = 0;
  /// Returns the packed bytes of all blocks of a route.
  [[nodiscard]] virtual std::int64_t route_bytes(std::string_view route) = 0;
  /// Returns the names of routes that have blocks.
  [[nodiscard]] virtual std::vector<std::string> list_routes_with_blocks() = 0;

  /// Runs `changes` within a writing transaction, and keeps the rows that they add, replace or
  /// remove, so that `undo` can restore them.
  virtual void run_undoably(const std::function<void()>& changes, const std::string& what) = 0;
  /// Returns the kept changes, newest first.
  [[nodiscard]] virtual std::vector<MemoryFile::KeptChange> history() = 0;
  /// Undoes the newest change, within a writing transaction.
  virtual void undo() = 0;

  /// Checks the tables themselves: passes each part to `check`. If it finds faults, later reads may
  /// fail. Returns the ids of all views found.
  [[nodiscard]] virtual std::set<ViewId> verify_structure(const Check& check) = 0;
  [[nodiscard]] virtual MemoryFile::Info info() = 0;
  /// Returns some of the numbers of `info`, which may cost less.
  [[nodiscard]] virtual MemoryFile::Counts counts();

 private:
  std::vector<MemoryFile::Fault> left_out_;
  std::set<ViewId> left_out_views_;
};

}  // namespace panonav
