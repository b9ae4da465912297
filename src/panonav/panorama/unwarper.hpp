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

/// Visits rows and columns only; callers set `elevations`, which is not a single number.
void visit_options(UnwarperOptions& options, OptionVisitor& visitor);

/// Turns images of one camera into panoramic cylinders by a table computed once. Each value is the
/// mean of one or more taps within its solid angle; a tap interpolates bilinearly between four
/// pixels of the image, which is halved until its pixels are about as far apart as the values,
/// against aliasing. Weights have 7 bit: errors of at most 2 grey levels at edges of full contrast.
/// Taps stay two pixels inside a mirror's border. Directions that the camera does not see copy the
/// nearest visible row of their column, or else the nearest column. Two fisheye lenses blend across
/// the seam (`blend_share`). Immutable after construction; several threads may share an Unwarper,
/// each with its own Workspace.
class Unwarper {
 public:
  static constexpr int rows_per_block = 4;  ///< Rows that `unwrap_blocks` hands over at a time.

  /// Buffers reused from image to image; their contents between calls are irrelevant.
  struct Workspace {
    std::vector<std::uint8_t> halved;  ///< images of half the size and less
    std::vector<std::uint16_t> pairs;  ///< each pixel with the one below, see `kernels::pair_rows`
    std::vector<float> block;          ///< values of `rows_per_block` rows
  };

  /// Throws ContractError on a camera, size or band that is not valid, or when the camera sees
  /// nothing of the band. Cost: some 50 ms for 80 x 512.
  explicit Unwarper(const Camera& camera, const UnwarperOptions& options = {});

  /// Camera whose images are unwarped.
  [[nodiscard]] const Camera& camera() const noexcept { return camera_; }
  [[nodiscard]] int rows() const noexcept { return rows_; }        ///< Rows of its panoramas.
  [[nodiscard]] int columns() const noexcept { return columns_; }  ///< Columns of its panoramas.
  /// Elevations of the panoramas: `UnwarperOptions::elevations`, or by default all that the camera
  /// sees at every azimuth.
  [[nodiscard]] const ElevationBand& elevations() const noexcept { return elevations_; }
  /// False if the camera does not see that direction, so that the value is copied from a neighbour.
  [[nodiscard]] bool is_visible(int row, int column) const noexcept;
  /// Returns the offsets, v * width + u in ascending order, of the pixels that `unwrap` reads; all
  /// pixels for an equirectangular camera. Cost: some milliseconds.
  [[nodiscard]] std::vector<std::uint32_t> find_read_pixels() const;

  /// Throws ContractError unless the image has the camera's size; colour becomes grey.
  [[nodiscard]] Panorama unwrap(ImageView image) const;
  /// Unwraps with buffers of the caller, which saves their allocation from the second image on.
  [[nodiscard]] Panorama unwrap(ImageView image, Workspace& workspace) const;

  /// Computes the same values as `unwrap` and passes them from the top in blocks of
  /// `rows_per_block` rows (the last may be smaller) to consume_rows(first row, values of whole
  /// rows), while they are in the cache. Throws as `unwrap`.
  void unwrap_blocks(ImageView image, Workspace& workspace,
                     const std::function<void(int, std::span<const float>)>& consume_rows) const;

 private:
  void require_camera_size(ImageView image) const;
  /// Computes the halved images and the row pairs that the table reads.
  void build_halved_pairs(ImageView image, Workspace& workspace) const;
  void compute_row_values(std::span<const std::uint16_t> pairs, int row,
                          std::span<float> values) const;

  Camera camera_;
  int rows_, columns_;
  ElevationBand elevations_;
  std::shared_ptr<const UnwarpTable> table_;  ///< empty for equirectangular cameras
};

}  // namespace panonav
