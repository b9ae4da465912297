#include "panonav/signature/signature_extractor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/kernels/polar.hpp"

namespace panonav {

namespace {

/// Mean and sum of squared deviations from it, of all values so far. Blocks are merged by the rule
/// of Chan, Golub and LeVeque, so that nothing cancels however small the contrast is.
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
  /// Sixteen partial sums: the compiler adds them as vectors, in an order that is the same
  /// everywhere.
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

SignatureExtractor::SignatureExtractor(Unwarper unwarper, int components,
                                       const PreprocessingOptions& preprocessing)
    : unwarper_(std::move(unwarper)),
      transform_(unwarper_.columns(), components),
      preprocessing_(preprocessing),
      real_(shape().size()),
      imaginary_(shape().size()) {
  validate(preprocessing_);
  check_masks(preprocessing_, unwarper_.rows());
}

FourierSignature SignatureExtractor::signature_from_image(ImageView image) {
  if (preprocessing_.edge_channel) {
    return compute_signature(preprocess(unwarper_.unwrap(image, workspace_), preprocessing_),
                             transform_);
  }
  const auto rows = static_cast<std::size_t>(unwarper_.rows());
  const auto columns = static_cast<std::size_t>(unwarper_.columns());
  const auto first_kept = static_cast<std::size_t>(preprocessing_.masked_rows_top);
  const std::size_t end_kept = rows - static_cast<std::size_t>(preprocessing_.masked_rows_bottom);
  const bool needs_moments = preprocessing_.remove_mean || preprocessing_.normalise_gain;
  const kernels::Instructions instructions = kernels::chosen_instructions();

  Moments moments;
  unwarper_.unwrap_blocks(image, workspace_, [&](int first_row, std::span<const float> values) {
    const auto first = static_cast<std::size_t>(first_row);
    transform_(values, std::span(real_).subspan(first), std::span(imaginary_).subspan(first), rows,
               instructions);
    if (needs_moments) {
      const std::size_t begin = std::max(first, first_kept);
      const std::size_t end = std::min(first + values.size() / columns, end_kept);
      if (begin < end)
        moments.add(values.subspan((begin - first) * columns, (end - begin) * columns));
    }
  });

  // The steps of `preprocess` are linear in each row, so they may as well follow the transform.
  if (preprocessing_.remove_mean) {
    // k = 0 is twice the mean of its row.
    const auto offset = static_cast<float>(2.0 * moments.mean());
    for (std::size_t y = first_kept; y < end_kept; ++y) real_[y] -= offset;
  }
  if (preprocessing_.normalise_gain) {
    const auto gain = static_cast<float>(normalising_gain(moments.standard_deviation()));
    for (float& value : real_) value *= gain;
    for (float& value : imaginary_) value *= gain;
  }
  if (first_kept > 0 || end_kept < rows) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(transform_.components()); ++k) {
      for (std::vector<float>* part : {&real_, &imaginary_}) {
        const auto begin = part->begin() + static_cast<std::ptrdiff_t>(k * rows);
        std::fill(begin, begin + static_cast<std::ptrdiff_t>(first_kept), 0.0F);
        std::fill(begin + static_cast<std::ptrdiff_t>(end_kept),
                  begin + static_cast<std::ptrdiff_t>(rows), 0.0F);
      }
    }
  }

  std::vector<float> magnitudes(shape().size());
  std::vector<float> phases(shape().size());
  kernels::to_polar(real_, imaginary_, magnitudes, phases, instructions);
  return {shape(), std::move(magnitudes), std::move(phases), unwarper_.elevations()};
}

}  // namespace panonav
