#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

/// Returns the folder with the built files of the page (apps/web): that of the environment variable
/// PANONAV_WEB_PAGE, otherwise installed with the command, or of the build folder. Throws FileError
/// that says how to build them if there is none.
[[nodiscard]] std::filesystem::path find_web_page();

/// Numbers of a written page.
struct WebFolder {
  std::size_t views = 0;       ///< places of the memory
  std::size_t pictures = 0;    ///< views with a picture of the recording
  std::size_t thumbnails = 0;  ///< views with a thumbnail in the memory
  std::uintmax_t bytes = 0;    ///< of all files
};

/// Writes a new folder for a web server, completely or not at all: the files of `page`, a copy of
/// the memory, and small pictures of the views that `recording` (may be null) contains by their
/// names. Calls `advance` after each picture. Throws FileError if the folder exists and is not
/// empty, if the memory has no view, if no view is in the recording, or if a file cannot be read or
/// written.
WebFolder write_web_folder(const MemoryFile& memory, const std::filesystem::path& page,
                           const Dataset* recording, const std::filesystem::path& folder,
                           Executor& executor, const std::function<void()>& advance);

}  // namespace panonav::command
