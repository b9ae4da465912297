#include "panonav/signature/signature_extractor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/kernels/polar.hpp"

namespace panonav {

namespace {

/// Running mean and standard deviation of all values added. Blocks are merged by the formula of
/// Chan, Golub and LeVeque, which avoids cancellation even at very low contrast.
class Moments {
 public:
  void add(std::span<const float> values) {
    const auto count = static_cast<double>(values.size());
    if (values.empty()) return;
    const double block_mean = sum(values, [](float value) { return value; }) / count;
    const auto shift = static_cast<float>(block_mean);
    const double block_squares =
        sum(values, [shift](float value) { return (value - shift) * (value - shift); });
    const double change = block_mean - mean_;
    const double total = count_ + count;
    mean_ += change * count / total;
    squares_ += block_squares + change * change * count_ * count / total;
    count_ = total;
  }

  [[nodiscard]] double mean() const { return mean_; }
  [[nodiscard]] double standard_deviation() const { return std::sqrt(squares_ / count_); }

 private:
  /// Sums function(value) in 16 partial sums, which the compiler vectorises without changing the
  /// order of the additions, so that results are equal on all machines.
  template <class Function>
  static double sum(std::span<const float> values, Function function) {
    std::array<float, 16> partial{};
    std::size_t i = 0;
    for (; i + partial.size() <= values.size(); i += partial.size()) {
      for (std::size_t j = 0; j < partial.size(); ++j) partial[j] += function(values[i + j]);
    }
    double total = 0.0;
    for (; i < values.size(); ++i) total += function(values[i]);
    for (const float part : partial) total += part;
    return total;
  }

  double count_ = 0.0;
  double mean_ = 0.0;
  double squares_ = 0.0;
};

}  // namespace

/// Transforms the rows of a panorama block by block and then computes its signature.
class SignatureExtractor::RowAccumulator {
 public:
  RowAccumulator(const SignatureExtractor& extractor, Workspace& workspace)
      : extractor_(extractor),
        rows_(static_cast<std::size_t>(extractor.rows_)),
        columns_(static_cast<std::size_t>(extractor.transform_.columns())),
        first_kept_(static_cast<std::size_t>(extractor.preprocessing_.masked_rows_top)),
        end_kept_(rows_ - static_cast<std::size_t>(extractor.preprocessing_.masked_rows_bottom)),
        real_(workspace.real),
        imaginary_(workspace.imaginary) {
    real_.resize(extractor.shape().size());
    imaginary_.resize(extractor.shape().size());
  }

  void add_rows(std::size_t first, std::span<const float> values) {
    extractor_.transform_(values, std::span(real_).subspan(first),
                          std::span(imaginary_).subspan(first), rows_, instructions_);
    const auto& preprocessing = extractor_.preprocessing_;
    if (!preprocessing.remove_mean && !preprocessing.normalise_gain) return;
    const std::size_t begin = std::max(first, first_kept_);
    const std::size_t end = std::min(first + values.size() / columns_, end_kept_);
    if (begin < end) {
      moments_.add(values.subspan((begin - first) * columns_, (end - begin) * columns_));
    }
  }

  /// Applies preprocessing to the coefficients and returns the signature. Subtracting the mean and
  /// scaling commute with the linear transform, so both can follow it.
  [[nodiscard]] FourierSignature finish(const std::optional<ElevationBand>& elevations) {
    if (extractor_.preprocessing_.remove_mean) {
      // k = 0 is twice the mean of its row.
      const auto offset = static_cast<float>(2.0 * moments_.mean());
      for (std::size_t y = first_kept_; y < end_kept_; ++y) real_[y] -= offset;
    }
    if (extractor_.preprocessing_.normalise_gain) {
      const auto gain = static_cast<float>(normalising_gain(moments_.standard_deviation()));
      for (float& value : real_) value *= gain;
      for (float& value : imaginary_) value *= gain;
    }
    if (first_kept_ > 0 || end_kept_ < rows_) clear_masked_rows();

    const SignatureShape shape = extractor_.shape();
    std::vector<float> magnitudes(shape.size());
    std::vector<float> phases(shape.size());
    kernels::to_polar(real_, imaginary_, magnitudes, phases, instructions_);
    return {shape, std::move(magnitudes), std::move(phases), elevations};
  }

 private:
  void clear_masked_rows() {
    for (std::size_t at = 0; at < real_.size(); at += rows_) {
      for (std::vector<float>* part : {&real_, &imaginary_}) {
        const auto component = std::span(*part).subspan(at, rows_);
        std::ranges::fill(component.first(first_kept_), 0.0F);
        std::ranges::fill(component.subspan(end_kept_), 0.0F);
      }
    }
  }

  const SignatureExtractor& extractor_;
  std::size_t rows_, columns_, first_kept_, end_kept_;
  std::vector<float>& real_;
  std::vector<float>& imaginary_;
  Moments moments_;
  kernels::Instructions instructions_ = kernels::chosen_instructions();
};

SignatureExtractor::SignatureExtractor(PanoramaShape cylinder, int components,
                                       const PreprocessingOptions& preprocessing)
    : rows_(cylinder.rows),
      transform_(cylinder.columns, components),
      preprocessing_(preprocessing) {
  require(rows_ >= 1, "rows", rows_, ">= 1");
  validate(preprocessing_);
  require_unmasked_rows(preprocessing_, rows_);
}

void SignatureExtractor::require_shape(int rows, int columns) const {
  require(rows == rows_, "panorama rows", rows, std::to_string(rows_));
  require(columns == transform_.columns(), "panorama columns", columns,
          std::to_string(transform_.columns()));
}

FourierSignature SignatureExtractor::signature(const Panorama& panorama,
                                               Workspace& workspace) const {
  require_shape(panorama.rows(), panorama.columns());
  if (preprocessing_.edge_channel) {
    return compute_signature(preprocess(panorama, preprocessing_), transform_);
  }
  RowAccumulator rows(*this, workspace);
  const auto values = panorama.values();
  const auto columns = static_cast<std::size_t>(panorama.columns());
  const std::size_t block = Unwarper::rows_per_block * columns;
  for (std::size_t at = 0; at < values.size(); at += block) {
    rows.add_rows(at / columns, values.subspan(at, std::min(block, values.size() - at)));
  }
  return rows.finish(panorama.elevations());
}

FourierSignature SignatureExtractor::signature(const Unwarper& unwarper, ImageView image,
                                               Workspace& workspace) const {
  require_shape(unwarper.rows(), unwarper.columns());
  if (preprocessing_.edge_channel) {
    return signature(unwarper.unwrap(image, workspace.unwarping), workspace);
  }
  RowAccumulator rows(*this, workspace);
  unwarper.unwrap_blocks(image, workspace.unwarping,
                         [&](int first_row, std::span<const float> values) {
                           rows.add_rows(static_cast<std::size_t>(first_row), values);
                         });
  return rows.finish(unwarper.elevations());
}

}  // namespace panonav
