#include "panonav_simulation/texture_store.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::simulation {

namespace {

namespace fs = std::filesystem;

// Returns a path with forward slashes and without the scheme file://.
std::string normalise_path(std::string_view written) {
  std::string path(written);
  if (path.rfind("file://", 0) == 0) path.erase(0, 7);
  std::replace(path.begin(), path.end(), '\\', '/');
  return path;
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

// Finds a file in `folder` with this base name: preferably with the same extension, else with one
// that can be decoded.
std::optional<fs::path> find_in_folder(const fs::path& folder, const fs::path& name) {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (to_lower_case(it->path().stem().string()) == to_lower_case(name.stem().string()) &&
        is_file(it->path())) {
      entries.push_back(it->path());
    }
  }
  // Sort, because the order of a directory differs between machines.
  std::sort(entries.begin(), entries.end());
  const std::array<std::string, 4> endings{to_lower_case(name.extension().string()), ".png", ".jpg",
                                           ".jpeg"};
  for (const std::string& ending : endings) {
    for (const fs::path& entry : entries) {
      if (to_lower_case(entry.extension().string()) == ending) return entry;
    }
  }
  return std::nullopt;
}

std::optional<fs::path> find_texture_file(const std::string& path, const fs::path& directory) {
  const fs::path written(path);
  if (is_file(directory / written)) return directory / written;
  const fs::path name = written.filename();
  if (name.empty()) return std::nullopt;
  const std::array<fs::path, 7> folders{directory / written.parent_path(),
                                        directory,
                                        directory / "textures",
                                        directory / "../materials/textures",
                                        directory / "../textures",
                                        directory / "../materials",
                                        directory / ".."};
  for (const fs::path& folder : folders) {
    if (const auto found = find_in_folder(folder, name)) return found;
  }
  return std::nullopt;
}

Image halve(const Image& image) {
  const int width = std::max(1, image.width() / 2);
  const int height = std::max(1, image.height() / 2);
  Image half(width, height, image.channels());
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      // An image 1 pixel wide or high has no second column or row.
      const int right = std::min(2 * u + 1, image.width() - 1);
      const int below = std::min(2 * v + 1, image.height() - 1);
      for (int c = 0; c < image.channels(); ++c) {
        const int sum = image.at(2 * u, 2 * v, c) + image.at(right, 2 * v, c) +
                        image.at(2 * u, below, c) + image.at(right, below, c);
        half.at(u, v, c) = static_cast<std::uint8_t>((sum + 2) / 4);
      }
    }
  }
  return half;
}

}  // namespace

TextureStore::TextureStore(TextureOptions options) : options_(std::move(options)) {
  require(options_.max_side_px >= 1, "max_side_px", options_.max_side_px, ">= 1");
}

std::shared_ptr<const Image> TextureStore::find(std::string_view written,
                                                const fs::path& directory) {
  if (!options_.read || written.empty()) return nullptr;
  const std::string path = normalise_path(written);
  const auto found = find_texture_file(path, directory);
  if (!found) {
    if (reported_paths_.insert(path).second) {
      warnings_.push_back(directory.string() + ": texture \"" + path +
                          "\" was not found; a plain colour is shown instead");
    }
    return nullptr;
  }
  const std::string file_name = found->filename().string();
  const std::string name = fs::path(path).filename().string();
  if (file_name != name && to_lower_case(file_name) == to_lower_case(name) &&
      reported_paths_.insert(path).second) {
    warnings_.push_back(directory.string() + ": texture \"" + path +
                        "\" was not found; taken instead, with letters of other case: " +
                        found->lexically_normal().string());
  }
  const auto [entry, is_new] = images_.try_emplace(found->lexically_normal().string());
  if (is_new) {
    try {
      Image image = options_.read(*found);
      while (std::max(image.width(), image.height()) > options_.max_side_px) {
        image = halve(image);
      }
      entry->second = std::make_shared<const Image>(std::move(image));
    } catch (const Error& error) {
      warnings_.push_back(std::string(error.what()) + "; a plain colour is shown instead");
    }
  }
  return entry->second;
}

}  // namespace panonav::simulation
