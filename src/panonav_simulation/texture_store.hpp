#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav::simulation {

/// Decodes the picture in a file; throws panonav::Error when it cannot. `read_image` of the module
/// io fits.
using TextureReader = std::function<Image(const std::filesystem::path&)>;

/// Reader and size limit of the pictures of a scene.
struct TextureOptions {
  TextureReader read;      ///< empty: every surface gets its plain colour
  int max_side_px = 1024;  ///< larger pictures are halved until they fit; >= 1
};

/// The textures of one scene, each read once. What cannot be found or read is never an error: it
/// gives no texture and one warning.
class TextureStore {
 public:
  /// Throws ContractError.
  explicit TextureStore(TextureOptions options);

  /// Finds the picture that a mesh or material file calls `written` (any slashes, absolute paths of
  /// foreign machines, `file://`). Looked for as written beside `directory`, then by its base name
  /// in the usual texture folders around `directory`, then with another ending (.png, .jpg, .jpeg)
  /// for the same base name; the case of letters is ignored. A name that is not as written is a
  /// warning. Null if there is none.
  [[nodiscard]] std::shared_ptr<const Image> find(std::string_view written,
                                                  const std::filesystem::path& directory);

  /// Returns one line for every picture that was missing, found in another case or could not be
  /// read, in order of first use.
  [[nodiscard]] const std::vector<std::string>& warnings() const& noexcept { return warnings_; }

 private:
  TextureOptions options_;
  std::map<std::string, std::shared_ptr<const Image>> images_;  // by path; null: could not be read
  std::map<std::string, bool> reported_missing_;
  std::vector<std::string> warnings_;
};

}  // namespace panonav::simulation
