#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panonav/storage/memory_header.hpp"
#include "panonav_fleet/internal/postgresql_memory.hpp"
#include "panonav_fleet/memory_changes.hpp"

namespace panonav::fleet {

/// What a server took last of a view of a file.
struct Upload {
  ViewId view;                 ///< in the file
  std::int64_t signature = 0;  ///< `signature_checksum`
  ViewId server_view;
  std::int64_t local_checksum = 0, server_checksum = 0;  ///< of both rows then
  std::int64_t sent = 0;                                 ///< number of the synchronisation
};

/// A view on a server without its signature.
struct ServerView {
  ViewId id;
  ReferenceInfo info;
  std::int64_t checksum = 0;
};

/// A view on a server with all that belongs to it, checked.
struct WholeServerView {
  ViewId id;
  NewView view;
  std::int64_t checksum = 0;
};

/// Number of rows whose ids share all but the lowest bits, and the exclusive or of their checksums:
/// where two of these are equal, so are the rows.
struct Block {
  std::int64_t rows = 0;
  std::int64_t checksums = 0;
  friend bool operator==(const Block&, const Block&) = default;
};
using Blocks = std::map<std::int64_t, Block>;
inline constexpr unsigned block_bits = 8;
inline void add_to_block(Blocks& blocks, ViewId id, std::int64_t checksum) {
  Block& block = blocks[id.value >> block_bits];
  ++block.rows;
  block.checksums ^= checksum;
}

/// The part of a memory on a server that a file keeps; empty: all of it.
using KeptAreas = std::optional<std::vector<MemoryArea>>;

/// What a synchronisation asks a server: many rows with few messages. Throws FileError as the rows'
/// interface does. Within transactions of `tables()`.
class ServerExchange {
 public:
  /// Empty when there is no such memory. Throws FileError as `connect_to_memories`.
  [[nodiscard]] static std::unique_ptr<ServerExchange> connect(const ServerAddress& address);

  [[nodiscard]] PostgresqlTables& tables() noexcept { return tables_; }
  [[nodiscard]] bool may_add() const noexcept { return may_add_; }
  [[nodiscard]] bool may_change() const noexcept { return may_change_; }
  /// Who adds views.
  [[nodiscard]] const std::string& robot() const noexcept { return robot_; }

  struct State {
    std::string identity;
    std::int64_t last_view = 0;
  };
  [[nodiscard]] State state();
  /// By ascending id on the server: the last of a view counts.
  [[nodiscard]] std::vector<Upload> uploads(const std::string& file, std::span<const ViewId> views);
  [[nodiscard]] std::vector<ServerView> named(std::span<const std::string> names);
  /// Those that are there.
  [[nodiscard]] std::vector<ServerView> infos(std::span<const ViewId> views);
  /// Those that are there.
  [[nodiscard]] std::map<ViewId, std::int64_t> checksums(std::span<const ViewId> views);
  [[nodiscard]] Blocks view_blocks(const KeptAreas& areas);
  [[nodiscard]] std::map<ViewId, std::int64_t> checksums_in(const KeptAreas& areas,
                                                            std::span<const std::int64_t> blocks);
  [[nodiscard]] Blocks link_blocks(const KeptAreas& areas);
  [[nodiscard]] std::vector<Link> links_in(const KeptAreas& areas,
                                           std::span<const std::int64_t> blocks);
  /// `signature_checksum` of those that are there.
  [[nodiscard]] std::map<ViewId, std::int64_t> signatures(std::span<const ViewId> views);
  /// Those that are there, with thumbnails and features, in one message.
  [[nodiscard]] std::vector<WholeServerView> whole(std::span<const ViewId> views);

  // What follows is taken by one statement each, outside of transactions: nobody waits for the
  // link.

  /// The same as `uploads`, once nobody is writing.
  [[nodiscard]] std::vector<Upload> settled_uploads(const std::string& file,
                                                    std::span<const ViewId> views);
  /// Brings views to a table of the connection's own; `take_views` will tell their areas. Their
  /// numbers are their places in `views`.
  void stage(std::span<const NewView> views);
  /// The last id before those that nobody else gets.
  [[nodiscard]] std::uint32_t reserve_ids(std::size_t count);
  struct Staged {
    std::size_t number = 0;  ///< as it was staged
    Upload upload;           ///< its `server_view` is a reserved id
    std::int64_t thumbnail_checksum = 0, features_checksum = 0;
  };
  /// Adds staged views, but for those that were taken before and are there, and those whose name is
  /// taken. Returns what is there of the file's views, by ascending id.
  [[nodiscard]] std::vector<Upload> take_views(const std::string& file, std::int64_t sent,
                                               std::span<const Staged> views);
  struct ChangedView {
    Upload upload;
    ReferenceInfo info;
    std::int64_t former_checksum = 0;  ///< as the file knows it
  };
  /// Gives views other names, poses and stamps where nobody was first. Returns what was taken.
  [[nodiscard]] std::vector<Upload> take_changes(const std::string& file, std::int64_t sent,
                                                 std::span<const ChangedView> views);
  /// Removes views that have these checksums, with all that belongs to them. Returns which.
  [[nodiscard]] std::vector<ViewId> take_removals(const std::map<ViewId, std::int64_t>& checksums);
  struct ChangedLink {
    Link former;
    std::optional<LinkKind> wanted;  ///< empty: it is removed
  };
  /// Adds links of views that are there where these have none, and gives links another kind where
  /// they still have the former one. Returns how many.
  std::size_t take_links(std::span<const Link> added, std::span<const ChangedLink> changed);

 private:
  ServerExchange(const ServerAddress& address, PostgresqlConnection connection,
                 const FoundMemory& found);
  [[nodiscard]] PostgresqlConnection& connection() noexcept { return tables_.connection(); }
  [[nodiscard]] PostgresqlValues values() const;
  [[noreturn]] void refuse_removed() const;
  [[nodiscard]] std::vector<Upload> uploads_in(const PostgresqlRows& rows) const;
  [[nodiscard]] ServerView view_in(const PostgresqlRows& rows, int row) const;
  [[nodiscard]] std::vector<ServerView> views_in(const PostgresqlRows& rows) const;
  [[nodiscard]] std::map<ViewId, std::int64_t> checksums_in(const PostgresqlRows& rows) const;
  [[nodiscard]] ViewId id_in(const PostgresqlRows& rows, int row, int column) const {
    return tables_.view_id(rows.integer(row, column));
  }

  PostgresqlTables tables_;
  bool may_add_ = false;
  bool may_change_ = false;
  std::string robot_;
};

}  // namespace panonav::fleet
