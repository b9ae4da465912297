#include "panonav/io/panorama_reader.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/panorama/hidden_values.hpp"

namespace panonav {

namespace {

// Of a picture that is said to show the whole sphere.
void require_whole_sphere(ImageSize size) {
  constexpr double tolerance = 0.02;  // borders and scaling take or add a few pixels
  if (std::abs(size.width - 2.0 * size.height) <= tolerance * size.width) return;
  throw ContractError("equirectangular picture",
                      std::to_string(size.width) + " x " + std::to_string(size.height) + " px",
                      "twice as wide as high, the whole sphere; a part of the sphere is of the "
                      "kind panorama, with its elevation band");
}

}  // namespace

PanoramaReader::PanoramaReader(PictureSource source, PanoramaShape shape)
    : source_(std::move(source)), shape_(shape) {
  if (source_.kind != PictureKind::mirror) return;
  require(source_.camera.has_value(), "camera of mirror pictures", 0.0, "one camera");
  UnwarperOptions options;
  if (shape.rows != 0) options.rows = shape.rows;
  if (shape.columns != 0) options.columns = shape.columns;
  options.elevations = source_.layout.kept_elevations;
  unwarper_.emplace(*source_.camera, options);
  if (source_.mask) hidden_ = values_hidden_by(source_.mask->view(), *unwarper_);
}

Panorama PanoramaReader::convert(ImageView picture) const {
  if (source_.kind == PictureKind::equirectangular) require_whole_sphere(picture.size());
  if (!unwarper_) return panorama_from_picture(picture, source_.layout, shape_);
  Panorama panorama = unwarper_->unwrap(picture);
  if (!hidden_.empty()) fill_hidden_values(panorama, hidden_);
  return panorama;
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
