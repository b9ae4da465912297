#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "panonav/camera/rig_model.hpp"
#include "panonav/io/dataset.hpp"

namespace panonav {

/// Pictures of a rig whose cameras have files of their own, joined when they are read
/// (`join_pictures`).
class RigPictures : public PictureStore {
 public:
  /// `files`: those of picture i are files[n * i] to files[n * i + n - 1], for n cameras. Throws
  /// ContractError unless their number is a multiple of n.
  RigPictures(RigModel rig, std::vector<std::filesystem::path> files);
  /// Throws FileError if a file is missing, damaged or of another size than its camera's pictures.
  [[nodiscard]] Image read(std::size_t index) const override;

 private:
  RigModel rig_;
  std::vector<std::filesystem::path> files_;
};

/// Makes pictures of a rig from entries that name the files of its cameras one after the other:
/// each `n` become one, with the name and path of the first. Changes nothing if the camera is no
/// rig, or if the first file has the size of a joined picture. Throws ContractError unless their
/// number is a multiple of n; FileError if the first file cannot be read.
void join_entries(Dataset& dataset);
/// Makes pictures of a rig from entries that name files in the folder of its first camera; the
/// other cameras have files of the same name in theirs. Throws FileError with the name of a file
/// that is missing or in none of these folders.
void join_folders(Dataset& dataset, const RigModel& rig, std::span<const std::string> folders);

}  // namespace panonav
