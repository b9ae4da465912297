#include "panonav/io/panorama_reader.hpp"

#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav {

PanoramaReader::PanoramaReader(PictureSource source, PanoramaShape shape)
    : source_(std::move(source)), shape_(shape) {
  if (source_.kind != PictureKind::mirror) return;
  require(source_.camera.has_value(), "camera of mirror pictures", 0.0, "one camera");
  UnwarperOptions options;
  if (shape.rows != 0) options.rows = shape.rows;
  if (shape.columns != 0) options.columns = shape.columns;
  options.elevations = source_.layout.kept_elevations;
  unwarper_.emplace(*source_.camera, options);
}

Panorama PanoramaReader::convert(ImageView picture) const {
  if (!unwarper_) return panorama_from_picture(picture, source_.layout, shape_);
  if (!source_.mask) return unwarper_->unwrap(picture);
  Image masked = to_grey(picture);
  const Image& mask = *source_.mask;
  if (mask.size() == masked.size()) {
    const auto pixels = masked.pixels();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (mask.pixels()[i] == 0) pixels[i] = 0;
    }
  }
  return unwarper_->unwrap(masked.view());
}

Panorama PanoramaReader::read(const std::filesystem::path& file) const {
  const Image picture = read_image(file);
  try {
    return convert(picture.view());
  } catch (const ContractError& error) {
    throw FileError(file.string(), error.what());
  }
}

}  // namespace panonav
