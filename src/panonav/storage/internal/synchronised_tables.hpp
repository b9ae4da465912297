#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "panonav/core/ids.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/storage/internal/sqlite_tables.hpp"

namespace panonav {

/// The file's knowledge of a view that a server has or is being sent.
struct SynchronisedView {
  std::optional<ViewId> server_view;  ///< its id there; empty: it is being sent for the first time
  std::int64_t local_checksum = 0;    ///< of the row in the file when both were the same
  std::int64_t server_checksum = 0;   ///< of the row on the server then
  std::int64_t signature = 0;         ///< `signature_checksum`
  bool uploaded = false;              ///< this file gave it to the server
  /// Number of the synchronisation that sent the view, until the answer is known.
  std::optional<std::int64_t> sent;
  friend bool operator==(const SynchronisedView&, const SynchronisedView&) = default;
};

/// Computes the checksum of a signature's packed bytes. It identifies a view, as signatures never
/// change.
[[nodiscard]] std::int64_t signature_checksum(std::span<const std::uint8_t> signature);

using SynchronisedViews = std::map<ViewId, SynchronisedView>;
/// Kinds of links that both sides had, by the server's ids, the smaller first.
using SynchronisedLinks = std::map<std::pair<ViewId, ViewId>, Link::Kind>;

/// The tables of a file with the state of a server. All throw FileError on damage; those that
/// change something are to be called within a writing transaction.
[[nodiscard]] SynchronisedViews read_synchronised_views(SqliteTables& file);
void write_synchronised_view(SqliteTables& file, ViewId view, const SynchronisedView& row);
void erase_synchronised_view(SqliteTables& file, ViewId view);
[[nodiscard]] SynchronisedLinks read_synchronised_links(SqliteTables& file);
void write_synchronised_link(SqliteTables& file, const Link& link);
void erase_synchronised_link(SqliteTables& file, ViewId a, ViewId b);

/// Checksum of each view's row, unchecked, by ascending id.
[[nodiscard]] std::map<ViewId, std::int64_t> read_view_checksums(SqliteTables& file);
/// Position of each view that has one, by ascending id.
[[nodiscard]] std::map<ViewId, std::pair<double, double>> read_positions(SqliteTables& file);
/// 63 random bits.
[[nodiscard]] std::int64_t random_number(SqliteTables& file);
/// 128 random bits, hexadecimal.
[[nodiscard]] std::string random_identity(SqliteTables& file);

/// Identifies a file and the memory on a server with which it is synchronised.
struct SynchronisedState {
  std::string file;            ///< random identity of the file; empty: none yet
  std::string memory;          ///< identity of the memory; empty: never synchronised
  std::int64_t last_view = 0;  ///< the largest id that the server had given
  std::int64_t number = 0;     ///< random, another one with each change of these tables
  friend bool operator==(const SynchronisedState&, const SynchronisedState&) = default;
};
[[nodiscard]] SynchronisedState read_synchronised_state(SqliteTables& file);
void write_synchronised_state(SqliteTables& file, const SynchronisedState& state);

}  // namespace panonav
