#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "panonav/storage/checksum.hpp"
#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// A row of the table of views, checked. `signature` points into the statement's row.
struct StoredView {
  ViewId id;
  ReferenceInfo info;
  std::span<const std::uint8_t> signature;
};

/// Throws the ContractError for a view that is not in the file.
[[noreturn]] void refuse_view(ViewId view);

/// Throws the ContractError for a name that another `what` ("view", "route") of the file has.
[[noreturn]] void refuse_taken_name(std::string_view what, std::string_view name,
                                    const std::filesystem::path& file);

/// Throws ContractError on a new name that people could not type or read.
void require_name(std::string_view what, std::string_view name);

struct MemoryFile::Implementation {
  Implementation(std::filesystem::path path_, Database database_, MemoryHeader header_);

  [[nodiscard]] ViewId id_in(const Statement& row, int column);
  /// Reads and checks a row of all columns of the table of views.
  [[nodiscard]] StoredView view_in(const Statement& row);
  /// Appends such a row to a memory.
  void append_row(const Statement& row, VisualMemory& memory);
  /// The largest id that was ever given to a view; 0: none.
  [[nodiscard]] std::uint32_t last_id();
  void insert(ViewId id, const NewView& view);
  [[nodiscard]] bool contains(ViewId view);
  /// The checksum of the view's row with its fields changed. Throws as `refuse_view`.
  [[nodiscard]] std::int64_t checksum_with(ViewId view,
                                           const std::function<void(ReferenceInfo&)>& change);
  [[nodiscard]] Link link_in(const Statement& row);
  /// Passes each link to `take`, ascending.
  template <class Take>
  void for_links(const Take& take) {
    Statement check(database, "PRAGMA quick_check(links)");
    if (!check.step() || check.text(0) != "ok") database.fail_damaged("table links");
    check.reset();
    Statement rows(database, "SELECT a, b, kind, checksum FROM links ORDER BY a, b");
    while (rows.step()) take(link_in(rows));
  }

  std::filesystem::path path;
  Database database;
  MemoryHeader header;
  RecordBytes scratch;
  std::vector<std::uint8_t> signature;
  PackedSignature packed;
  Statement insert_view;
  Statement insert_thumbnail;
  Statement find_name;
};

}  // namespace panonav
