#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "panonav/memory/view_source.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Loads views of a memory file on demand, so that a robot can hold only a part of a large memory.
/// The file is opened read-only; if others change it, each `load` reads its present state. A
/// damaged view is refused only when it is loaded. Only one thread at a time may use an object.
class MemoryFileViews final : public ViewSource {
 public:
  /// Opens the file and reads the ids of its views. Throws FileError as `MemoryFile::open`.
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
