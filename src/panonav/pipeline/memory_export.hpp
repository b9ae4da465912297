#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "panonav/core/executor.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Describes the contents of an exported memory.
struct MemoryExport {
  std::size_t views = 0;  ///< number of views in views.csv and signatures.npy
  /// Number of views whose thumbnail became an image of the data set; 0: no data set was written.
  std::size_t pictures = 0;
  /// Number of exported images with other names than their views, which cannot be file names.
  std::size_t renamed = 0;
  bool positions = false;  ///< the data set has positions: an exported view has one
  bool headings = false;   ///< like `positions`
  bool stamps = false;     ///< all exported views have a stamp; otherwise only views.csv has them
  bool enlarged =
      false;  ///< true: thumbnails are smaller than the panoramas of the memory and were enlarged
};

/// Writes views, poses, thumbnails and signatures into a new folder (docs/formats.md, section
/// "Export of a memory"), completely or not at all. If thumbnails are large enough for all
/// components of a signature, writes them as pictures of a data set, enlarged to the size of the
/// memory's panoramas; `memorise` can make a memory of the same shape from them. Calls `advance`
/// after each view. Throws FileError if the folder exists and is not empty, if the memory has no
/// view, or if a file cannot be written.
MemoryExport export_memory(const MemoryFile& memory, const std::filesystem::path& folder,
                           Executor& executor, const std::function<void()>& advance = {});
/// Writes them in the calling thread.
MemoryExport export_memory(const MemoryFile& memory, const std::filesystem::path& folder);

}  // namespace panonav
