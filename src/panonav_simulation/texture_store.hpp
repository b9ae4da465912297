#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav::simulation {

/// Decodes the image in a file; throws panonav::Error if it cannot. `read_image` of the module io
/// is suitable.
using TextureReader = std::function<Image(const std::filesystem::path&)>;

/// Reader and size limit of a scene's textures.
struct TextureOptions {
  TextureReader read;      ///< empty: surfaces get their plain colours
  int max_side_px = 1024;  ///< larger textures are halved until they fit; >= 1
};

/// The textures of one scene, each read once. A texture that cannot be found or read is no error:
/// its surfaces get a plain colour, and there is one warning.
class TextureStore {
 public:
  /// Throws ContractError unless max_side_px >= 1.
  explicit TextureStore(TextureOptions options);

  /// Finds the texture that a mesh or material file calls `written` (with any slashes, absolute
  /// paths of other machines or `file://`): first relative to `directory`, then by its base name in
  /// the usual texture folders around `directory`, then with another extension (.png, .jpg, .jpeg).
  /// The case of letters is ignored, with a warning if it differs. Returns null if there is no such
  /// file.
  [[nodiscard]] std::shared_ptr<const Image> find(std::string_view written,
                                                  const std::filesystem::path& directory);

  /// Returns one line per texture that was missing, found in other case or could not be read, in
  /// order of first use.
  [[nodiscard]] const std::vector<std::string>& warnings() const& noexcept { return warnings_; }

 private:
  TextureOptions options_;
  std::map<std::string, std::shared_ptr<const Image>> images_;  // by path; null: unreadable
  std::set<std::string> reported_paths_;
  std::vector<std::string> warnings_;
};

}  // namespace panonav::simulation
