#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "panonav/panorama/tilt.hpp"
#include "panonav/panorama/unwarper.hpp"

namespace panonav {

/// Throws ContractError if a picture of this size does not fit the layout: if it is not of the size
/// of the mirror's camera, or if an equirectangular one is not twice as wide as high, or not of the
/// ratio of the part of the sphere that it shows (`PictureLayout::elevations`), within 2 %.
/// Panoramas may have any size.
void require_picture_size(const PictureSource& source, ImageSize size);

/// Turns the pictures of one recording into panoramic cylinders of one shape. The unwarping
/// table of mirror pictures is computed once, at construction. Several threads may use one reader
/// at a time.
class PanoramaReader {
 public:
  /// If rows or columns of `shape` are 0, the pictures' own number is kept (80 x 512 for mirror
  /// pictures). Throws ContractError on a source that is not valid.
  PanoramaReader(PictureSource source, PanoramaShape shape);

  /// Returns the layout of the pictures, with the default bands of equirectangular ones.
  [[nodiscard]] const PictureSource& source() const noexcept { return source_; }
  /// Returns the unwarping table of mirror pictures if nothing else is needed to convert them; null
  /// for other pictures, and if a mask hides a part of the mirror.
  [[nodiscard]] const Unwarper* unwarper() const noexcept {
    return unwarper_ && hidden_.empty() ? &*unwarper_ : nullptr;
  }
  /// Converts a picture. With a tilt it gives the view of a level robot (`level_panorama`), and
  /// reads rows beyond the band for that, as far as the picture shows them. Throws ContractError if
  /// the size of a picture does not fit (`require_picture_size`), and on a tilt as `level_panorama`
  /// does.
  [[nodiscard]] Panorama convert(ImageView picture, const Tilt& tilt = {}) const;
  /// Reads a file and converts it. Throws FileError with the file and the fault.
  [[nodiscard]] Panorama read(const std::filesystem::path& file) const;

 private:
  /// The unwarping table of a wider band of mirror pictures, computed for the first tilted picture.
  struct Wide;
  const Wide* get_or_create_wide() const;

  PictureSource source_;
  PanoramaShape shape_;
  std::optional<Unwarper> unwarper_;
  std::vector<std::uint8_t> hidden_;  ///< values that the mask hides; empty: no mask
  std::shared_ptr<Wide> wide_;
};

}  // namespace panonav
