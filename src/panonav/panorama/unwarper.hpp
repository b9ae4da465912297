#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "panonav/camera/camera.hpp"
#include "panonav/core/image.hpp"
#include "panonav/core/options.hpp"
#include "panonav/panorama/panorama.hpp"

namespace panonav {

struct UnwarpTable;

/// The cylinder onto which images are unwarped.
struct UnwarperOptions {
  int rows = 80;      ///< [M04 section 2.1]
  int columns = 512;  ///< [M04 section 2.1]
  /// Empty: all elevations that the camera sees at every azimuth (`visible_elevations`).
  std::optional<ElevationBand> elevations = std::nullopt;
  friend bool operator==(const UnwarperOptions&, const UnwarperOptions&) = default;
};

/// `elevations` is not an option of one number: callers set it.
void visit_options(UnwarperOptions& options, OptionVisitor& visitor);

/// Turns the images of one camera into panoramic cylinders by a table that is computed once.
///
/// Each value is the mean of one or more taps within its field; a tap interpolates linearly between
/// four pixels, of the image itself or of the image halved so often that the distance of its pixels
/// fits the distance of the values (in the direction where they lie closer; more than one tap where
/// the other direction needs it). So nothing aliases however dense the image is. The level and the
/// number of taps are the same along a row. Weights have 7 bit: a value differs from exact
/// interpolation by at most 2 grey levels next to full contrast, 0.3 typically.
///
/// Near the mirror's border finer levels are used, and in the image itself taps keep two pixels
/// away from it, so that the dark beyond does not leak in. Directions that the camera does not see
/// are looked up at the nearest row seen in the same column, and columns in which nothing is seen
/// at the nearest column: no edge appears that is not in the world.
///
/// Pictures of a dual fisheye camera are blended across the seam (`blend_share`), the brighter lens
/// made as dark as the other one.
///
/// Images of an equirectangular camera go through `panorama_from_picture`.
///
/// Immutable after construction; several threads may use one at a time, each with its own
/// Workspace.
class Unwarper {
 public:
  static constexpr int rows_per_block = 4;  ///< Rows that `unwrap_blocks` hands over at a time.

  /// Buffers that are reused from image to image; what they hold between calls does not matter.
  struct Workspace {
    std::vector<std::uint8_t> halved;  ///< images of half the size and less
    std::vector<std::uint16_t> pairs;  ///< pixels beside those below, see `kernels::pair_rows`
    std::vector<float> block;          ///< values of `rows_per_block` rows
  };

  /// Throws ContractError on a camera, size or band that is not valid, or when the camera sees
  /// nothing of the band. Cost: some 50 ms for 80 x 512.
  explicit Unwarper(const Camera& camera, const UnwarperOptions& options = {});

  /// The camera whose images it takes.
  [[nodiscard]] const Camera& camera() const noexcept { return camera_; }
  [[nodiscard]] int rows() const noexcept { return rows_; }        ///< Rows of its panoramas.
  [[nodiscard]] int columns() const noexcept { return columns_; }  ///< Columns of its panoramas.
  /// Of its panoramas: the wanted band, or all that the camera sees at every azimuth.
  [[nodiscard]] const ElevationBand& elevations() const noexcept { return elevations_; }
  /// False where the value is taken from a neighbour, because the camera does not see that
  /// direction.
  [[nodiscard]] bool is_seen(int row, int column) const noexcept;

  /// Throws ContractError unless the image has the camera's size; colour becomes grey.
  [[nodiscard]] Panorama unwrap(ImageView image) const;
  /// The same with buffers of the caller, which spare their allocation from the second image on.
  [[nodiscard]] Panorama unwrap(ImageView image, Workspace& workspace) const;

  /// The same values, handed over in blocks of `rows_per_block` rows (the last may be smaller) from
  /// the top while they are in the cache: take(first row, values of whole rows). Throws as
  /// `unwrap`.
  void unwrap_blocks(ImageView image, Workspace& workspace,
                     const std::function<void(int, std::span<const float>)>& take) const;

 private:
  void check(ImageView image) const;
  /// Halves and pairs what the table needs.
  void prepare(ImageView image, Workspace& workspace) const;
  void look_up(std::span<const std::uint16_t> pairs, int row, std::span<float> values) const;

  Camera camera_;
  int rows_, columns_;
  ElevationBand elevations_;
  std::shared_ptr<const UnwarpTable> table_;  ///< empty for equirectangular cameras
};

}  // namespace panonav
