#include "panonav_recordings/internal/foreign_pictures.hpp"

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

}  // namespace

bool is_foreign_picture(const fs::path& path) {
  return identify_media_file(path) == MediaKind::foreign_picture;
}

std::shared_ptr<const PictureStore> make_foreign_picture_store(std::vector<fs::path> files) {
  return std::make_shared<const ForeignPictures>(std::move(files));
}

Dataset read_foreign_picture(const fs::path& path, PictureSource source) {
  Dataset dataset = read_single_picture(path, std::move(source));
  dataset.entries.front().store = make_foreign_picture_store({path});
  return dataset;
}

}  // namespace panonav::recordings
