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

/// Turns the pictures of one recording into panoramic cylinders of one shape. For mirror pictures
/// the table is computed once, at construction. Several threads may use one at a time.
class PanoramaReader {
 public:
  /// `shape`: rows or columns 0 keep the pictures' own (80 x 512 for mirror pictures). Throws
  /// ContractError on a source that is not valid.
  PanoramaReader(PictureSource source, PanoramaShape shape);

  /// The layout of the pictures, as stated at construction.
  [[nodiscard]] const PictureSource& source() const noexcept { return source_; }
  /// The table that turns mirror pictures into panoramas where that is all there is to do: null for
  /// other pictures and where a mask hides a part of the mirror.
  [[nodiscard]] const Unwarper* unwarper() const noexcept {
    return unwarper_ && hidden_.empty() ? &*unwarper_ : nullptr;
  }
  /// Converts a picture. With a tilt, to the view of a level robot (`level_panorama`), for which
  /// more than the band is read where the picture shows more. Throws ContractError on a picture
  /// whose size is not the camera's, on an equirectangular one that is not twice as wide as high (2
  /// % off at most), and on a tilt as `level_panorama` does.
  [[nodiscard]] Panorama convert(ImageView picture, const Tilt& tilt = {}) const;
  /// Reads and converts. Throws FileError that names the file and what is wrong with it.
  [[nodiscard]] Panorama read(const std::filesystem::path& file) const;

 private:
  /// The table of a wider band of mirror pictures, made when the first tilted picture comes.
  struct Wide;
  const Wide* get_or_create_wide() const;

  PictureSource source_;
  PanoramaShape shape_;
  std::optional<Unwarper> unwarper_;
  std::vector<std::uint8_t> hidden_;  ///< by the mask; empty without one
  std::shared_ptr<Wide> wide_;
};

}  // namespace panonav
