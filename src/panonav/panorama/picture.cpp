#include "panonav/panorama/picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
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

/// New samples of a row, with all weights in one list.
class RowSamples {
 public:
  RowSamples(int width, const PictureLayout& layout, int columns) : width_(width) {
    const double column_step = static_cast<double>(width) / columns;
    const double sign = azimuth_sign(layout.direction);
    for (int c = 0; c < columns; ++c) {
      const Sample sample =
          make_sample(layout.forward_column * width + sign * c * column_step - 0.5, column_step);
      first_.push_back((sample.first % width + width) % width);
      weights_.insert(weights_.end(), sample.weights.begin(), sample.weights.end());
      end_.push_back(weights_.size());
      max_count_ = std::max(max_count_, sample.weights.size());
    }
  }
  /// Values that a line needs: those of the picture, then the first ones again.
  [[nodiscard]] std::size_t line_size() const {
    return static_cast<std::size_t>(width_) + max_count_;
  }
  void wrap(std::span<float> line) const {
    for (auto u = static_cast<std::size_t>(width_); u < line.size(); ++u) {
      line[u] = line[u - static_cast<std::size_t>(width_)];
    }
  }
  /// Sums the samples of a wrapped line.
  void sample(std::span<const float> line, std::span<float> values) const {
    std::size_t weight = 0;
    for (std::size_t c = 0; c < values.size(); ++c) {
      float sum = 0.0F;
      const float* from = line.data() + first_[c];
      for (; weight < end_[c]; ++weight) sum += weights_[weight] * *from++;
      values[c] = std::clamp(sum * (1.0F / 255.0F), 0.0F, 1.0F);
    }
  }

 private:
  int width_;
  std::vector<int> first_;
  std::vector<std::size_t> end_;
  std::vector<float> weights_;
  std::size_t max_count_ = 0;
};

// Resamples the picture to `shape`, from height `top` (fraction from the upper edge) in steps of
// `row_step` old rows. Each row is interpolated vertically before its columns. Rows beyond the
// picture repeat its edge. Colours are converted to grey only in rows that are used.
std::vector<float> sample_grey(ImageView picture, const PictureLayout& layout, double top,
                               double row_step, PanoramaShape shape) {
  const RowSamples row_samples(picture.width, layout, shape.columns);
  std::vector<Sample> samples;
  for (int y = 0; y < shape.rows; ++y) {
    samples.push_back(make_sample(top * picture.height + (y + 0.5) * row_step - 0.5, row_step));
  }
  const auto clamp_row = [&](int v) { return std::clamp(v, 0, picture.height - 1); };
  const int first_row = clamp_row(samples.front().first);
  Image grey(1, 1);
  if (picture.channels != 1) {
    const Sample& last = samples.back();
    const int last_row = clamp_row(last.first + static_cast<int>(last.weights.size()) - 1);
    grey = to_grey({picture.data + first_row * picture.stride, picture.width,
                    last_row - first_row + 1, picture.channels, picture.stride});
  }
  const auto row_data = [&](int v) {
    return picture.channels == 1 ? picture.data + v * picture.stride : &grey.at(0, v - first_row);
  };
  std::vector<float> values(static_cast<std::size_t>(shape.rows) * shape.columns);
  std::vector<float> line(row_samples.line_size());
  for (int y = 0; y < shape.rows; ++y) {
    const Sample& row_sample = samples[static_cast<std::size_t>(y)];
    std::fill(line.begin(), line.end(), 0.0F);
    for (std::size_t i = 0; i < row_sample.weights.size(); ++i) {
      const std::uint8_t* from = row_data(clamp_row(row_sample.first + static_cast<int>(i)));
      for (int u = 0; u < picture.width; ++u) line[u] += row_sample.weights[i] * from[u];
    }
    row_samples.wrap(line);
    row_samples.sample(line, std::span(values).subspan(static_cast<std::size_t>(y) * shape.columns,
                                                       static_cast<std::size_t>(shape.columns)));
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
  auto values = sample_grey(picture, layout, top, kept_rows / shape.rows, shape);
  return {shape.rows, shape.columns, band, std::move(values)};
}

}  // namespace panonav
