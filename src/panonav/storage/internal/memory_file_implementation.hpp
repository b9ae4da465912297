#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "panonav/storage/checksum.hpp"
#include "panonav/storage/internal/memory_tables.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

struct MemoryFile::Implementation {
  Implementation(std::filesystem::path address_, std::unique_ptr<MemoryTables> tables_,
                 MemoryHeader header_);

  /// The row itself. Throws FileError when it does not match its checksum.
  const ViewRow& checked(const ViewRow& row);
  /// Appends a row to a memory, checked.
  void append_row(const ViewRow& row, VisualMemory& memory);
  /// Within a transaction. Throws as `refuse_view`.
  void change_info(ViewId view, const std::function<void(ReferenceInfo&)>& change);

  std::filesystem::path address;  ///< as it was opened; it may hold a password
  std::unique_ptr<MemoryTables> tables;
  MemoryHeader header;
  RecordBytes scratch;
  PackedSignature packed;
};

}  // namespace panonav
