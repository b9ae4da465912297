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

/// A file's record of a view that a server has or that is being sent.
struct SynchronisedView {
  std::optional<ViewId> server_view;  ///< its id there; nullopt: sent the first time
  std::int64_t local_checksum = 0;    ///< of the row in the file when both were equal
  std::int64_t server_checksum = 0;   ///< of the row on the server at that time
  std::int64_t signature = 0;         ///< `signature_checksum`
  bool uploaded = false;              ///< true if this file sent it to the server
  /// Number of the synchronisation that sent the view; nullopt once the answer is known.
  std::optional<std::int64_t> sent;
  friend bool operator==(const SynchronisedView&, const SynchronisedView&) = default;
};

/// Computes the checksum of a signature's packed bytes. It identifies a view, because signatures
/// never change.
[[nodiscard]] std::int64_t signature_checksum(std::span<const std::uint8_t> signature);

using SynchronisedViews = std::map<ViewId, SynchronisedView>;
/// Kinds of the links that both sides had, by the server's ids, smaller id first.
using SynchronisedLinks = std::map<std::pair<ViewId, ViewId>, Link::Kind>;

/// Functions for the tables of a file with the state of a server. All throw FileError on damage.
/// Call those that change something within a writing transaction.
[[nodiscard]] SynchronisedViews read_synchronised_views(SqliteTables& file);
void write_synchronised_view(SqliteTables& file, ViewId view, const SynchronisedView& row);
void erase_synchronised_view(SqliteTables& file, ViewId view);
[[nodiscard]] SynchronisedLinks read_synchronised_links(SqliteTables& file);
void write_synchronised_link(SqliteTables& file, const Link& link);
void erase_synchronised_link(SqliteTables& file, ViewId a, ViewId b);

/// Returns the checksum of each view's row, by ascending id, without checking it.
[[nodiscard]] std::map<ViewId, std::int64_t> read_view_checksums(SqliteTables& file);
/// Returns the position of each view that has one, by ascending id.
[[nodiscard]] std::map<ViewId, std::pair<double, double>> read_positions(SqliteTables& file);
/// Returns a random number of 63 bits.
[[nodiscard]] std::int64_t make_random_number(SqliteTables& file);
/// Returns 128 random bits in hexadecimal.
[[nodiscard]] std::string make_random_identity(SqliteTables& file);

/// Identities of a file and of the memory on a server with which it is synchronised.
struct SynchronisedState {
  std::string file;            ///< random identity of the file; empty: none yet
  std::string memory;          ///< identity of the memory; empty: never synchronised
  std::int64_t last_view = 0;  ///< largest id that the server had given
  std::int64_t number = 0;     ///< random, new with each change of these tables
  friend bool operator==(const SynchronisedState&, const SynchronisedState&) = default;
};
[[nodiscard]] SynchronisedState read_synchronised_state(SqliteTables& file);
void write_synchronised_state(SqliteTables& file, const SynchronisedState& state);

}  // namespace panonav
