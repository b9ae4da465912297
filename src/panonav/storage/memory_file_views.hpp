#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "panonav/memory/view_source.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Views of a memory file, read when they are asked for: a robot holds the part of a large memory
/// that it needs. The file is opened for reading only; while others change it, each `load` sees it
/// as it is then. A view whose bytes are damaged is refused when it is loaded, not before. One
/// object belongs to one thread at a time.
class MemoryFileViews final : public ViewSource {
 public:
  /// Throws FileError as `MemoryFile::open`. Holds the ids, no view.
  explicit MemoryFileViews(const std::filesystem::path& path);

  /// Those that there were when the file was opened.
  [[nodiscard]] std::span<const ViewId> views() const override { return views_; }
  /// Throws FileError, ContractError as `MemoryFile::load`.
  [[nodiscard]] VisualMemory load(std::span<const ViewId> views) const override;
  /// The open file, for what it tells besides views.
  [[nodiscard]] const MemoryFile& file() const noexcept { return file_; }

 private:
  MemoryFile file_;
  std::vector<ViewId> views_;
};

}  // namespace panonav
