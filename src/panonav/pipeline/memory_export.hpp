#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Contents of an export of a memory.
struct MemoryExport {
  std::size_t views = 0;  ///< number in views.csv and signatures.npy
  /// Number of views whose thumbnail is a picture of the data set; 0: there is no data set.
  std::size_t pictures = 0;
  /// Number of these whose name cannot be that of a file: their pictures have other names.
  std::size_t renamed = 0;
  /// True if positions are in the data set. A data set has them for all of its pictures or for
  /// none; where some views have none they are in views.csv alone.
  bool positions = false;
  bool headings = false;  ///< see `positions`; not without them
  bool stamps = false;    ///< see `positions`
  bool enlarged = false;  ///< thumbnails are smaller than the panoramas that the memory compares
};

/// Writes views, poses, thumbnails and signatures into a new folder (docs/formats.md, section
/// "Export of a memory"), which appears whole or not at all. Thumbnails with all components of a
/// signature become the pictures of a data set, enlarged to the size of the memory's panoramas,
/// from which `memorise` makes a memory of the same shape. `advance` is called after each view.
/// Throws FileError when something but an empty folder is there, when the memory holds no view, and
/// when a file cannot be written.
MemoryExport export_memory(const MemoryFile& memory, const std::filesystem::path& folder,
                           const std::function<void()>& advance = {});

}  // namespace panonav
