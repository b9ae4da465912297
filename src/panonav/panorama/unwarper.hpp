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

/// Turns images of one camera into panoramic cylinders by a table computed once.
/// Each value is the mean of one or more taps within its field; a tap interpolates linearly between
/// four pixels of the image, halved until its pixels are as far apart as the values, so that
/// nothing aliases. Weights have 7 bit: at most 2 grey levels of error next to full contrast. Taps
/// keep two pixels away from a mirror's border.
/// Directions that the camera does not see take the nearest row seen in the same column, or the
/// nearest column. Two fisheye lenses blend across the seam (`blend_share`). Immutable after
/// construction; several threads may use one at a time, each with its own Workspace.
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
  /// Elevations of its panoramas: the band of the options, or all that the camera sees at every
  /// azimuth.
  [[nodiscard]] const ElevationBand& elevations() const noexcept { return elevations_; }
  /// False if the camera does not see that direction, so that the value is copied from a neighbour.
  [[nodiscard]] bool is_visible(int row, int column) const noexcept;

  /// Throws ContractError unless the image has the camera's size; colour becomes grey.
  [[nodiscard]] Panorama unwrap(ImageView image) const;
  /// Unwraps with buffers of the caller, which saves their allocation from the second image on.
  [[nodiscard]] Panorama unwrap(ImageView image, Workspace& workspace) const;

  /// Passes the same values in blocks of `rows_per_block` rows (the last may be smaller) from the
  /// top while they are in the cache: take(first row, values of whole rows). Throws as `unwrap`.
  void unwrap_blocks(ImageView image, Workspace& workspace,
                     const std::function<void(int, std::span<const float>)>& take) const;

 private:
  void require_camera_size(ImageView image) const;
  /// Halves the image and pairs its rows as the table needs.
  void halve_and_pair(ImageView image, Workspace& workspace) const;
  void compute_row(std::span<const std::uint16_t> pairs, int row, std::span<float> values) const;

  Camera camera_;
  int rows_, columns_;
  ElevationBand elevations_;
  std::shared_ptr<const UnwarpTable> table_;  ///< empty for equirectangular cameras
};

}  // namespace panonav
