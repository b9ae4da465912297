#include "panonav/panorama/preprocessing.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

/// Mean and standard deviation, summed in double precision, so that a rotation of the view changes
/// them only by rounding.
struct Moments {
  double mean = 0.0;
  double deviation = 0.0;
};

Moments compute_moments(const Panorama& panorama, int first_row, int end_row) {
  const double count = static_cast<double>(end_row - first_row) * panorama.columns();
  double sum = 0.0;
  for (int y = first_row; y < end_row; ++y) {
    for (const float value : panorama.row(y)) sum += value;
  }
  const double mean = sum / count;
  double squares = 0.0;
  for (int y = first_row; y < end_row; ++y) {
    for (const float value : panorama.row(y)) squares += (value - mean) * (value - mean);
  }
  return {mean, std::sqrt(squares / count)};
}

void replace_by_gradients(Panorama& panorama, int first_row, int end_row) {
  const int columns = panorama.columns();
  std::vector<float> above(panorama.row(first_row).begin(), panorama.row(first_row).end());
  std::vector<float> here = above;
  for (int y = first_row; y < end_row; ++y) {
    const auto below = panorama.row(std::min(y + 1, end_row - 1));
    std::vector<float> next(below.begin(), below.end());
    for (int c = 0; c < columns; ++c) {
      const float across = here[(c + 1) % columns] - here[(c + columns - 1) % columns];
      panorama.at(y, c) = 0.5F * std::hypot(across, next[c] - above[c]);
    }
    above = std::exchange(here, std::move(next));
  }
}

}  // namespace

void visit_options(PreprocessingOptions& options, OptionVisitor& visitor) {
  using T = PreprocessingOptions;
  constexpr OptionTable table{
      option<&T::masked_rows_top>("number of ignored rows at the upper edge of the panorama", 0),
      option<&T::masked_rows_bottom>("number of ignored rows at the lower edge of the panorama", 0),
      option<&T::edge_channel>("replace the brightness by the magnitude of its gradient"),
      option<&T::remove_mean>("subtract the mean brightness of the view"),
      option<&T::normalise_gain>("scale the contrast of every view to the same standard deviation"),
  };
  table.visit(options, visitor);
}

double normalising_gain(double standard_deviation) noexcept {
  constexpr double target_deviation = 0.25;
  constexpr double min_deviation = 0.25 / 255.0;
  return standard_deviation >= min_deviation ? target_deviation / standard_deviation : 1.0;
}

void require_unmasked_rows(const PreprocessingOptions& options, int rows) {
  if (options.masked_rows_top >= rows - options.masked_rows_bottom) {
    throw ContractError(
        "masked_rows_top + masked_rows_bottom",
        to_text(static_cast<double>(options.masked_rows_top) + options.masked_rows_bottom),
        "below " + std::to_string(rows) + " (the rows of the panorama)");
  }
}

Panorama preprocess(Panorama panorama, const PreprocessingOptions& options) {
  validate(options);
  require_unmasked_rows(options, panorama.rows());
  const int first = options.masked_rows_top;
  const int end = panorama.rows() - options.masked_rows_bottom;
  const auto values = panorama.values();
  const auto columns = static_cast<std::size_t>(panorama.columns());
  const auto kept = values.subspan(first * columns, (end - first) * columns);
  std::fill(values.begin(), values.begin() + first * columns, 0.0F);
  std::fill(values.begin() + end * columns, values.end(), 0.0F);

  if (options.edge_channel) replace_by_gradients(panorama, first, end);
  if (options.remove_mean || options.normalise_gain) {
    const Moments found = compute_moments(panorama, first, end);
    const double offset = options.remove_mean ? found.mean : 0.0;
    const double gain = options.normalise_gain ? normalising_gain(found.deviation) : 1.0;
    for (float& value : kept) value = static_cast<float>((value - offset) * gain);
  }
  return panorama;
}

}  // namespace panonav
