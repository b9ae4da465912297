#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Checks that views with the same name in recording and memory are the same view, so that two
/// recordings with the same file names are not mixed. Compares the poses and stamps of all such
/// (known) views. Also compares their images, unless names, poses, sizes and modification times of
/// all files equal those of a recording memorised before. Throws FileError at the first view that
/// differs or whose image cannot be read; with `unread`, passes the latter to it instead. Cost: a
/// query of the size and modification time of each file; for a changed or copied recording,
/// encoding the known views. `compared` receives the number of images compared since its last call.
void check_known_views(const Dataset& recording, const MemoryFile& memory,
                       const ViewEncoder& encoder, Executor& executor,
                       const std::function<void(std::size_t)>& compared = {},
                       const std::function<void(const DatasetEntry&, const Error&)>& unread = {});

/// Returns the views of images that the memory does not know by name, by the names of the images: a
/// view is next to that of a neighbouring image, has a name that the recording lacks, and the same
/// picture, stamp and, if the image has one, pose. Images that cannot be read are left out.
[[nodiscard]] std::map<std::string, ViewId> find_renamed_views(const Dataset& recording,
                                                               const MemoryFile& memory,
                                                               const ViewEncoder& encoder);

/// Stores in the memory that its views with names of this recording come from this recording, so
/// that `check_known_views` need not compare images. Does nothing for a single image.
void remember_recording(const Dataset& recording, MemoryFile& memory);

/// Marks all recordings as unknown. Call it after removing views, since later views of the same
/// names may come from another recording.
void forget_recordings(MemoryFile& memory);

/// True if the signatures differ at most by rounding errors, which vary between processors.
[[nodiscard]] bool is_same_picture(const PackedSignature& a, const PackedSignature& b);

/// Throws a FileError: the memory has a different view with this name.
[[noreturn]] void throw_different_view(const std::filesystem::path& memory, const std::string& name,
                                       const std::string& what);

}  // namespace panonav
