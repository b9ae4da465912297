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

/// Checks that the names that the memory knows mean the same views, as two recordings with the same
/// file names must not be mixed. Compares poses and stamps of all known views, and their pictures
/// unless the memory knows the recording: same names, poses, sizes and times of change of all
/// files. Throws FileError at the first view that differs, or whose picture cannot be read. Cost:
/// reading the size and time of each file; for a recording that was changed or copied since, that
/// of memorising the known views; `compared` receives their number now and then.
void check_known_views(const Dataset& recording, const MemoryFile& memory,
                       const ViewEncoder& encoder, Executor& executor,
                       const std::function<void(std::size_t)>& compared = {});

/// Notes that all views of the recording that the memory knows are the recording's, or will be.
void remember_recording(const Dataset& recording, MemoryFile& memory);

/// A view that was dropped may come back from another recording, so no recording counts as known.
void forget_recordings(MemoryFile& memory);

/// True if they are equal but for rounding, as processors round differently.
[[nodiscard]] bool is_same_picture(const PackedSignature& a, const PackedSignature& b);

/// Throws the FileError for a name that the memory holds with another view.
[[noreturn]] void throw_different_view(const std::filesystem::path& memory, const std::string& name,
                                       const std::string& what);

}  // namespace panonav
