#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Contents of an export of a memory.
struct MemoryExport {
  std::size_t views = 0;  ///< number in views.csv and signatures.npy
  /// Number of views whose thumbnail became an image of the data set; 0: no data set was written.
  std::size_t pictures = 0;
  /// Number of these whose name cannot be a file name; their images have other names.
  std::size_t renamed = 0;
  /// True if the data set has positions: all of its images have one. Otherwise positions are only
  /// in views.csv.
  bool positions = false;
  bool headings = false;  ///< like `positions`; false without them
  bool stamps = false;    ///< like `positions`
  bool enlarged =
      false;  ///< true: thumbnails are smaller than the panoramas of the memory and were enlarged
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
