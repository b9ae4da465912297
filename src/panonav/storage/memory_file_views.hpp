#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "panonav/memory/view_source.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Reads views of a memory file when they are needed: a robot holds a part of a large memory. The
/// file is opened for reading only; while others change it, each `load` reads its present state. A
/// view whose bytes are damaged is refused when it is loaded, not before. One object belongs to one
/// thread at a time.
class MemoryFileViews final : public ViewSource {
 public:
  /// Opens the file and reads the ids, no view. Throws FileError as `MemoryFile::open`.
  explicit MemoryFileViews(const std::filesystem::path& path)
      : file_(MemoryFile::open(path, Access::read_only)), views_(file_.views()) {}

  /// Returns the views that the file had when it was opened.
  [[nodiscard]] std::span<const ViewId> views() const override { return views_; }
  /// Loads views. Throws FileError, ContractError as `MemoryFile::load`.
  [[nodiscard]] VisualMemory load(std::span<const ViewId> views) const override {
    return file_.load(views);
  }
  /// Returns the open file.
  [[nodiscard]] const MemoryFile& file() const noexcept { return file_; }

 private:
  MemoryFile file_;
  std::vector<ViewId> views_;
};

}  // namespace panonav
