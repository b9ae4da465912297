#pragma once

#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/kernels/row_transform.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/panorama/unwarper.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Makes signatures of pictures: preprocessing and transform in one pass, row by row while a row is
/// in the cache. The result is that of
///   compute_signature(preprocess(panorama, preprocessing), components)
/// up to rounding: coefficients differ by at most 2e-6 of the largest magnitude before the mean is
/// removed. Only the edge channel needs the whole panorama at once. Immutable after construction;
/// several threads may use one at a time, each with its own Workspace.
class SignatureExtractor {
 public:
  /// Buffers that are reused from picture to picture; what they hold between calls does not matter.
  struct Workspace {
    Unwarper::Workspace unwarping;  ///< of `Unwarper`
    std::vector<float> real,        ///< Fourier sums of the rows, the cosine parts
        imaginary;                  ///< the sine parts
  };

  /// Makes an extractor for cylinders of this shape. Throws ContractError unless 1 <= components <=
  /// columns / 2 and the masks leave a row; OptionError.
  explicit SignatureExtractor(PanoramaShape cylinder, int components = 15,
                              const PreprocessingOptions& preprocessing = {});

  /// The steps before the transform.
  [[nodiscard]] const PreprocessingOptions& preprocessing() const noexcept {
    return preprocessing_;
  }
  /// Rows and components of the signatures that it makes.
  [[nodiscard]] SignatureShape shape() const noexcept { return {rows_, transform_.components()}; }

  /// Computes the signature of a panorama. Throws ContractError on another shape.
  [[nodiscard]] FourierSignature signature(const Panorama& panorama, Workspace& workspace) const;

  /// Computes the signature of the panorama that `unwarper` would make of the image, to the bit.
  /// Throws
  /// ContractError unless the image has the camera's size (colour becomes grey) and the unwarper's
  /// cylinder this shape.
  [[nodiscard]] FourierSignature signature(const Unwarper& unwarper, ImageView image,
                                           Workspace& workspace) const;

 private:
  class Rows;
  void require_shape(int rows, int columns) const;

  int rows_;
  kernels::RowTransform transform_;
  PreprocessingOptions preprocessing_;
};

}  // namespace panonav
