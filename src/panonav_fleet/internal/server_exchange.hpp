#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panonav/storage/memory_header.hpp"
#include "panonav_fleet/internal/postgresql_memory.hpp"
#include "panonav_fleet/memory_changes.hpp"

namespace panonav::fleet {

/// The last version of a view of a file that a server accepted.
struct Upload {
  ViewId view;                 ///< in the file
  std::int64_t signature = 0;  ///< `signature_checksum`
  ViewId server_view;
  std::int64_t local_checksum = 0, server_checksum = 0;  ///< checksums of both rows at that time
  std::int64_t sent = 0;                                 ///< number of the sending synchronisation
};

/// A view on a server without its signature.
struct ServerView {
  ViewId id;
  ReferenceInfo info;
  std::int64_t checksum = 0;
};

/// A view on a server with all that belongs to it, checked.
struct FullServerView {
  ViewId id;
  NewView view;
  std::int64_t checksum = 0;
};

/// Summary of the rows whose ids share all but the lowest `block_bits` bits: their number and the
/// exclusive or of their checksums. Two blocks with equal summaries have equal rows.
struct Block {
  std::int64_t rows = 0;
  std::int64_t checksums = 0;
  friend bool operator==(const Block&, const Block&) = default;
};
using Blocks = std::map<std::int64_t, Block>;
inline constexpr unsigned block_bits = 8;  ///< chosen: 256 rows in a block
inline void add_to_block(Blocks& blocks, ViewId id, std::int64_t checksum) {
  Block& block = blocks[id.value >> block_bits];
  ++block.rows;
  block.checksums ^= checksum;
}

/// The areas of a server's memory that a file keeps; nullopt: all of them.
using KeptAreas = std::optional<std::vector<MemoryArea>>;

/// Links of a server's memory.
struct ServerLinks {
  std::vector<Link> accepted;
  std::set<std::pair<ViewId, ViewId>> left_out;  ///< ends of damaged rows
};

/// Exchanges many rows with a server in few messages, for a synchronisation. Functions throw
/// FileError as `MemoryTables` does. Call them within transactions of `tables()`, unless stated
/// otherwise.
class ServerExchange {
 public:
  /// Connects to a memory; nullptr if there is none. Throws FileError as `connect_to_memories`.
  [[nodiscard]] static std::unique_ptr<ServerExchange> connect(const ServerAddress& address);

  [[nodiscard]] PostgresqlTables& tables() noexcept { return tables_; }
  [[nodiscard]] bool can_add() const noexcept { return may_add_; }
  [[nodiscard]] bool can_change() const noexcept { return may_change_; }
  /// Returns the name of the robot that adds views.
  [[nodiscard]] const std::string& robot() const noexcept { return robot_; }

  struct State {
    std::string identity;
    std::int64_t last_view = 0;
  };
  [[nodiscard]] State read_state();
  /// Returns the uploads of these views of the file, by ascending id on the server. If a view has
  /// several, the last is valid.
  [[nodiscard]] std::vector<Upload> read_uploads(const std::string& file,
                                                 std::span<const ViewId> views);
  [[nodiscard]] std::vector<ServerView> find_views_by_name(std::span<const std::string> names);
  /// Reads names, poses, stamps and checksums of those of the views that exist.
  [[nodiscard]] std::vector<ServerView> read_infos(std::span<const ViewId> views);
  /// Reads the checksums of those of the views that exist.
  [[nodiscard]] std::map<ViewId, std::int64_t> read_checksums(std::span<const ViewId> views);
  [[nodiscard]] Blocks compute_view_blocks(const KeptAreas& areas);
  [[nodiscard]] std::map<ViewId, std::int64_t> read_checksums_in_blocks(
      const KeptAreas& areas, std::span<const std::int64_t> blocks);
  [[nodiscard]] Blocks compute_link_blocks(const KeptAreas& areas);
  [[nodiscard]] ServerLinks read_links_in_blocks(const KeptAreas& areas,
                                                 std::span<const std::int64_t> blocks);
  /// Computes `signature_checksum` of those of the views that exist.
  [[nodiscard]] std::map<ViewId, std::int64_t> read_signature_checksums(
      std::span<const ViewId> views);
  /// Reads those of the views that exist and are not damaged (`MemoryTables::accept_row`), with
  /// thumbnails and features, in one message.
  [[nodiscard]] std::vector<FullServerView> read_full_views(std::span<const ViewId> views,
                                                            SignatureShape shape);

  // Each of the following functions is one statement outside of transactions, so that no other
  // client waits for the network of this one.

  /// Returns the same as `read_uploads`, after waiting until no writer is active.
  [[nodiscard]] std::vector<Upload> read_settled_uploads(const std::string& file,
                                                         std::span<const ViewId> views);
  /// Copies views to a temporary table, numbered by their index in `views`, and records their areas
  /// for the notification of `submit_views`.
  void stage_views(std::span<const NewView> views);
  /// Reserves `count` ids for views; returns the last id before them.
  [[nodiscard]] std::uint32_t reserve_ids(std::size_t count);
  struct Staged {
    std::size_t number = 0;  ///< index of the staged view
    Upload upload;           ///< its `server_view` is a reserved id
    std::int64_t thumbnail_checksum = 0, features_checksum = 0;
  };
  /// Adds the staged views, except those that were accepted before and still exist, and those whose
  /// name is used by another view. Returns the uploads of the file's views that exist, by ascending
  /// id.
  [[nodiscard]] std::vector<Upload> submit_views(const std::string& file, std::int64_t sent,
                                                 std::span<const Staged> views);
  struct ChangedView {
    Upload upload;
    ReferenceInfo info;
    std::int64_t former_checksum = 0;  ///< of the server's row, as known to the file
  };
  /// Changes names, poses and stamps of views, unless another robot has changed a view first.
  /// Returns the accepted uploads.
  [[nodiscard]] std::vector<Upload> submit_changes(const std::string& file, std::int64_t sent,
                                                   std::span<const ChangedView> views);
  /// Removes views that still have these checksums, with all that belongs to them. Returns the
  /// removed ones.
  [[nodiscard]] std::vector<ViewId> submit_removals(
      const std::map<ViewId, std::int64_t>& checksums);
  struct ChangedLink {
    Link former;
    std::optional<Link::Kind> new_kind;  ///< nullopt: the link is removed
  };
  /// Adds links between existing views that have none, and changes or removes links that still have
  /// the former kind. Returns the number of links that were added, changed or removed.
  std::size_t submit_links(std::span<const Link> added, std::span<const ChangedLink> changed);

 private:
  ServerExchange(const ServerAddress& address, PostgresqlConnection connection,
                 const FoundMemory& found);
  [[nodiscard]] PostgresqlConnection& connection() noexcept { return tables_.connection(); }
  [[nodiscard]] PostgresqlValues values() const;
  [[noreturn]] void throw_memory_removed() const;
  [[nodiscard]] std::vector<Upload> to_uploads(const PostgresqlRows& rows) const;
  [[nodiscard]] ServerView read_server_view(const PostgresqlRows& rows, int row) const;
  [[nodiscard]] std::vector<ServerView> read_server_views(const PostgresqlRows& rows) const;
  /// Parses and checks the view of the first row; damaged attachments are left out. Throws
  /// DamageError if the view itself is damaged.
  [[nodiscard]] FullServerView read_full_view(const PostgresqlRows& rows, SignatureShape shape,
                                              RecordBytes& scratch);
  [[nodiscard]] std::map<ViewId, std::int64_t> to_checksums(const PostgresqlRows& rows) const;
  [[nodiscard]] ViewId read_view_id(const PostgresqlRows& rows, int row, int column) const {
    return tables_.to_view_id(rows.integer(row, column));
  }

  PostgresqlTables tables_;
  bool may_add_ = false;
  bool may_change_ = false;
  std::string robot_;
};

}  // namespace panonav::fleet
