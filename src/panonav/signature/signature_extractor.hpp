#pragma once

#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/kernels/row_transform.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/panorama/unwarper.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Computes signatures of panoramas or camera images: preprocessing and transform
/// in one pass over blocks of rows, while they are in the cache. The result equals
///   compute_signature(preprocess(panorama, preprocessing), components)
/// up to rounding: coefficients differ by at most 2e-6 of the largest magnitude before the
/// mean is removed. Only the edge channel needs the whole panorama at once. Immutable after
/// construction; several threads may share an extractor, each with its own Workspace.
class SignatureExtractor {
 public:
  /// Buffers reused from image to image; their contents between calls are irrelevant.
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
  /// Rows and components of the computed signatures.
  [[nodiscard]] SignatureShape shape() const noexcept { return {rows_, transform_.components()}; }

  /// Computes the signature of a panorama. Throws ContractError on another shape.
  [[nodiscard]] FourierSignature signature(const Panorama& panorama, Workspace& workspace) const;

  /// Unwarps the image and computes its signature; the result is bit-identical to that of
  /// `unwarper.unwrap(image)`. Throws ContractError unless the image has the camera's size (colour
  /// becomes grey) and the unwarper this extractor's rows and columns.
  [[nodiscard]] FourierSignature signature(const Unwarper& unwarper, ImageView image,
                                           Workspace& workspace) const;

 private:
  class RowAccumulator;
  void require_shape(int rows, int columns) const;

  int rows_;
  kernels::RowTransform transform_;
  PreprocessingOptions preprocessing_;
};

}  // namespace panonav
