#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace panonav {

/// Throws FileError unless this is a regular file of at most 256 MB: worlds and meshes name other
/// files, and devices and pipes have no end.
void require_scene_file(const std::filesystem::path& file);

/// Finds the files that a Gazebo world refers to.
class GazeboFiles {
 public:
  GazeboFiles(std::filesystem::path world, std::vector<std::filesystem::path> model_folders);

  /// The file or folder that `uri` means: `model://` and `package://` in the model folders,
  /// `file://` and plain paths absolute, beside `directory`, beside the world or in the model
  /// folders. Empty when there is none.
  [[nodiscard]] std::optional<std::filesystem::path> resolve(
      std::string_view uri, const std::filesystem::path& directory) const;

  /// The model folders, for messages.
  [[nodiscard]] std::string places() const;

  /// Throws FileError on files that the SDF parser does not survive or not quietly: models that
  /// include themselves, directly or through others, more than 32 deep or 100,000 in all, and files
  /// that are not regular ones or whose root is not <sdf>.
  void check_includes() const;

 private:
  std::filesystem::path world_;
  std::vector<std::filesystem::path> folders_;
};

}  // namespace panonav
