#include "panonav/storage/memory_file_views.hpp"

namespace panonav {

MemoryFileViews::MemoryFileViews(const std::filesystem::path& path)
    : file_(MemoryFile::open(path, Access::read_only)), views_(file_.views()) {}

VisualMemory MemoryFileViews::load(std::span<const ViewId> views) const {
  return file_.load(views);
}

}  // namespace panonav
