#include "panonav_recordings/internal/foreign_pictures.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/media_kind.hpp"
#include "panonav_recordings/internal/decoded_video.hpp"

namespace panonav::recordings {

namespace {

namespace fs = std::filesystem;

/// Pictures in files of their own, each decoded by a process of ffmpeg.
class ForeignPictures final : public PictureStore {
 public:
  explicit ForeignPictures(std::vector<fs::path> files) : files_(std::move(files)) {}
  [[nodiscard]] Image read(std::size_t index) const override {
    const std::string file = files_.at(index).string();
    DecodedVideo decoder({"-protocol_whitelist", "file,pipe", "-i", "file:" + file}, "", file, {});
    if (auto frame = decoder.next()) return std::move(frame->picture);
    const std::string why = to_readable_line(decoder.last_error());
    throw FileError(file, "is WebP, HEIC or AVIF, and the installed ffmpeg cannot decode it" +
                              (why.empty() ? "" : " (" + why + ")") +
                              "; convert it to PNG or JPEG (HEIC: heif-convert)");
  }

 private:
  std::vector<fs::path> files_;
};

/// Returns the foreign pictures of a folder; empty if it has a description or other pictures.
std::vector<fs::path> list_foreign_pictures(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const char* name : {"dataset.toml", "metadata.yaml"}) {
    if (fs::exists(folder / name, error)) return {};
  }
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& file = entry->path();
    if (is_folder_picture(file)) return {};
    if (!is_hidden(file) && identify_media_file(file) == MediaKind::foreign_picture)
      files.push_back(file);
  }
  std::ranges::sort(files, [](const fs::path& a, const fs::path& b) {
    return is_naturally_less(a.filename().string(), b.filename().string());
  });
  return files;
}

}  // namespace

bool is_foreign_picture(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return !list_foreign_pictures(path).empty();
  return identify_media_file(path) == MediaKind::foreign_picture;
}

Dataset read_foreign_pictures(const fs::path& path, PictureSource source) {
  std::error_code error;
  const bool is_folder = fs::is_directory(path, error);
  const std::vector<fs::path> files = is_folder ? list_foreign_pictures(path) : std::vector{path};
  if (files.empty()) throw FileError(path.string(), "contains no WebP, HEIC or AVIF image");
  const auto store = std::make_shared<const ForeignPictures>(files);
  Dataset dataset{is_folder ? path : path.parent_path(), std::move(source), {}, {}};
  for (const fs::path& file : files) {
    DatasetEntry& entry = dataset.entries.emplace_back();
    entry.file = escape_name(file.filename().string());
    entry.path = file;
    entry.store = store;
    entry.store_index = dataset.entries.size() - 1;
  }
  return dataset;
}

}  // namespace panonav::recordings
