#pragma once

#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/kernels/row_transform.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/panorama/unwarper.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// From camera images straight to signatures: unwrap, preprocess, transform, row by row while a row
/// is in the cache. The result is that of
///   compute_signature(preprocess(unwarper.unwrap(image), preprocessing), components)
/// up to rounding: coefficients differ by at most 2e-6 of the largest magnitude before the mean is
/// removed. Only the edge channel needs
/// the whole panorama at once. Holds buffers, so each thread needs one of its own; copies are
/// independent.
class SignatureExtractor {
 public:
  /// Throws ContractError unless 1 <= components <= columns / 2 and the masks leave a row;
  /// OptionError.
  explicit SignatureExtractor(Unwarper unwarper, int components = 15,
                              const PreprocessingOptions& preprocessing = {});

  [[nodiscard]] const Unwarper& unwarper() const noexcept { return unwarper_; }
  [[nodiscard]] const PreprocessingOptions& preprocessing() const noexcept {
    return preprocessing_;
  }
  [[nodiscard]] SignatureShape shape() const noexcept {
    return {unwarper_.rows(), transform_.components()};
  }

  /// Throws ContractError unless the image has the camera's size; colour becomes grey.
  [[nodiscard]] FourierSignature signature_from_image(ImageView image);

 private:
  Unwarper unwarper_;
  kernels::RowTransform transform_;
  PreprocessingOptions preprocessing_;
  Unwarper::Workspace workspace_;
  std::vector<float> real_, imaginary_;
};

}  // namespace panonav
