#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Checks that views with the same name in recording and memory are the same view, so that two
/// recordings with the same file names are not mixed. Compares poses and stamps of all known views.
/// Compares images too, unless names, poses, sizes and modification times of all files are those of
/// a recording that was memorised. Throws FileError at the first view that differs or whose image
/// cannot be read. Cost: reading size and time of each file; for a changed or copied recording,
/// that of memorising the known views. `compared` receives their number from time to time.
void check_known_views(const Dataset& recording, const MemoryFile& memory,
                       const ViewEncoder& encoder, Executor& executor,
                       const std::function<void(std::size_t)>& compared = {});

/// Records in the memory that its views with names of this recording come from this recording, now
/// and in future.
void remember_recording(const Dataset& recording, MemoryFile& memory);

/// Marks all recordings as unknown: after a removal, views of that name may come from another
/// recording.
void forget_recordings(MemoryFile& memory);

/// True if the signatures differ only by rounding, which varies between processors.
[[nodiscard]] bool is_same_picture(const PackedSignature& a, const PackedSignature& b);

/// Throws the FileError for a name that the memory holds with another view.
[[noreturn]] void throw_different_view(const std::filesystem::path& memory, const std::string& name,
                                       const std::string& what);

}  // namespace panonav
