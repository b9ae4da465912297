#include "panonav/panorama/picture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

/// Keys' cubic convolution kernel, a = -1/2: exact on parabolas.
double cubic_kernel(double x) {
  x = std::abs(x);
  if (x < 1.0) return (1.5 * x - 2.5) * x * x + 1.0;
  if (x < 2.0) return ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0;
  return 0.0;
}

/// A new sample as the weighted sum of consecutive old samples, from index `first`.
struct Sample {
  int first = 0;
  std::vector<float> weights;
};

/// Computes the weights of one new sample. `position`: its centre in units of old samples (old
/// sample i is at i). `step`: spacing of the new samples, in old ones.
Sample make_sample(double position, double step) {
  const double width = std::max(1.0, step);
  // Removes the rounding error of positions computed from angles, so that copies are exact.
  const double nearest = std::round(position);
  if (std::abs(position - nearest) < 1e-9) position = nearest;
  Sample sample;
  sample.first = static_cast<int>(std::floor(position - 2.0 * width)) + 1;
  const int last = static_cast<int>(std::ceil(position + 2.0 * width)) - 1;
  std::vector<double> weights;
  double sum = 0.0;
  for (int i = sample.first; i <= last; ++i) {
    weights.push_back(cubic_kernel((i - position) / width));
    sum += weights.back();
  }
  for (const double weight : weights) sample.weights.push_back(static_cast<float>(weight / sum));
  return sample;
}

void validate_layout(const PictureLayout& layout) {
  require(layout.forward_column >= 0.0 && layout.forward_column <= 1.0, "forward_column",
          layout.forward_column, "0 .. 1 (a fraction of the width)");
  const auto check_band = [](const ElevationBand& band, const char* name, double low, double high) {
    constexpr double rounding = 1e-9;
    require(band.bottom_rad >= low - rounding && band.bottom_rad < band.top_rad, name,
            band.bottom_rad, to_text(low) + " rad .. below the top");
    require(band.top_rad <= high + rounding, name, band.top_rad,
            "above the bottom .. " + to_text(high) + " rad");
  };
  constexpr double zenith = std::numbers::pi / 2.0;
  if (layout.elevations) check_band(*layout.elevations, "elevations", -zenith, zenith);
  if (layout.kept_elevations) {
    if (!layout.elevations) {
      throw ContractError("kept_elevations", "given",
                          "only where the picture's own elevations are known");
    }
    check_band(*layout.kept_elevations, "kept_elevations", layout.elevations->bottom_rad,
               layout.elevations->top_rad);
  }
}

// Resamples the picture to `shape`, from height `top` (fraction from the upper edge) in steps of
// `row_step` old rows. Each row is interpolated vertically before its columns. Rows beyond the
// picture repeat its edge.
std::vector<float> sample_grey(ImageView picture, const PictureLayout& layout, double top,
                               double row_step, PanoramaShape shape) {
  const double column_step = static_cast<double>(picture.width) / shape.columns;
  const double sign = layout.direction == ColumnDirection::clockwise ? -1.0 : 1.0;
  std::vector<Sample> column_samples;
  for (int c = 0; c < shape.columns; ++c) {
    Sample sample = make_sample(
        layout.forward_column * picture.width + sign * c * column_step - 0.5, column_step);
    sample.first = (sample.first % picture.width + picture.width) % picture.width;
    column_samples.push_back(std::move(sample));
  }
  std::vector<float> values(static_cast<std::size_t>(shape.rows) * shape.columns);
  std::vector<float> line(static_cast<std::size_t>(picture.width));
  for (int y = 0; y < shape.rows; ++y) {
    const Sample row_sample =
        make_sample(top * picture.height + (y + 0.5) * row_step - 0.5, row_step);
    std::fill(line.begin(), line.end(), 0.0F);
    for (std::size_t i = 0; i < row_sample.weights.size(); ++i) {
      const int v = std::clamp(row_sample.first + static_cast<int>(i), 0, picture.height - 1);
      const std::uint8_t* from = picture.data + v * picture.stride;
      for (int u = 0; u < picture.width; ++u) line[u] += row_sample.weights[i] * from[u];
    }
    for (int c = 0; c < shape.columns; ++c) {
      float sum = 0.0F;
      int u = column_samples[c].first;
      for (const float weight : column_samples[c].weights) {
        sum += weight * line[u];
        if (++u == picture.width) u = 0;
      }
      values[static_cast<std::size_t>(y) * shape.columns + c] =
          std::clamp(sum * (1.0F / 255.0F), 0.0F, 1.0F);
    }
  }
  return values;
}

}  // namespace

Panorama panorama_from_picture(ImageView picture, const PictureLayout& layout,
                               PanoramaShape shape) {
  validate_layout(layout);
  require(picture.width >= 4, "image width", picture.width, ">= 4");
  require(picture.height >= 1, "image height", picture.height, ">= 1");
  require(shape.rows >= 0, "rows", shape.rows, ">= 0");
  require(shape.columns == 0 || shape.columns >= 4, "columns", shape.columns, "0 or >= 4");

  // The part of the rows that is kept, as fractions of the height from the top.
  double top = 0.0;
  double bottom = 1.0;
  std::optional<ElevationBand> band = layout.elevations;
  if (layout.kept_elevations) {
    const double full = layout.elevations->top_rad - layout.elevations->bottom_rad;
    top =
        std::clamp((layout.elevations->top_rad - layout.kept_elevations->top_rad) / full, 0.0, 1.0);
    bottom = std::clamp((layout.elevations->top_rad - layout.kept_elevations->bottom_rad) / full,
                        0.0, 1.0);
    band = layout.kept_elevations;
  }
  const double kept_rows = (bottom - top) * picture.height;
  if (shape.rows == 0) shape.rows = std::max(1, static_cast<int>(std::lround(kept_rows)));
  if (shape.columns == 0) shape.columns = picture.width;
  Image grey_copy(1, 1);
  if (picture.channels != 1) {
    grey_copy = to_grey(picture);
    picture = grey_copy.view();
  }
  auto values = sample_grey(picture, layout, top, kept_rows / shape.rows, shape);
  return {shape.rows, shape.columns, band, std::move(values)};
}

}  // namespace panonav
