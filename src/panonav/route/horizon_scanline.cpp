#include "panonav/route/horizon_scanline.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

// Returns the mean of the rows near the horizon, with the columns of the panorama.
std::vector<float> average_rows(const Panorama& panorama, double half_band_rad) {
  std::vector<double> sum(static_cast<std::size_t>(panorama.columns()));
  double weights = 0.0;
  const auto add = [&](int y, double weight) {
    const auto row = panorama.row(y);
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += weight * static_cast<double>(row[c]);
    weights += weight;
  };
  for (int y = 0; y < panorama.rows(); ++y) {
    if (!panorama.elevations() || std::abs(panorama.elevation_rad(y)) <= half_band_rad) add(y, 1.0);
  }
  if (weights == 0.0) {
    const auto near = panorama.horizon_row();
    if (!near) {
      const auto band = *panorama.elevations();
      throw ContractError(
          "elevations of the panorama",
          to_text(degrees(band.bottom_rad)) + " .. " + to_text(degrees(band.top_rad)) + " degrees",
          "a range that contains the horizon");
    }
    // Rows go downwards: this is the next one on the other side of the horizon.
    const double elevation = panorama.elevation_rad(*near);
    const int other = std::clamp(elevation > 0.0 ? *near + 1 : *near - 1, 0, panorama.rows() - 1);
    const double beyond = panorama.elevation_rad(other);
    const double share = other == *near ? 0.0 : elevation / (elevation - beyond);
    add(*near, 1.0 - share);
    if (share > 0.0) add(other, share);
  }
  std::vector<float> row(sum.size());
  for (std::size_t c = 0; c < sum.size(); ++c) row[c] = static_cast<float>(sum[c] / weights);
  return row;
}

}  // namespace

void visit_options(HorizonScanlineOptions& options, OptionVisitor& visitor) {
  using T = HorizonScanlineOptions;
  constexpr OptionTable table{
      option<&T::columns>("number of pixels of a line", 16, 16384),
      option<&T::half_band_rad>("rows within this angle from the horizon are averaged", 0, 0.5),
  };
  table.visit(options, visitor);
}

std::vector<float> horizon_scanline(const Panorama& panorama,
                                    const HorizonScanlineOptions& options) {
  validate(options);
  const auto row = average_rows(panorama, options.half_band_rad);
  const auto from = static_cast<double>(row.size());
  const auto count = static_cast<std::size_t>(options.columns);
  const double step = from / static_cast<double>(count);
  std::vector<float> line(count);
  if (step == 1.0) return row;
  const auto at = [&](long long c) {
    const auto size = static_cast<long long>(row.size());
    return static_cast<double>(row[static_cast<std::size_t>(((c % size) + size) % size)]);
  };
  // Each value is the mean of half a step, and at least half a pixel of the panorama, to either
  // side of its middle.
  const double half = 0.5 * std::max(1.0, step);
  for (std::size_t c = 0; c < count; ++c) {
    const double low = static_cast<double>(c) * step - half + 0.5;
    const double high = low + 2.0 * half;
    double sum = 0.0;
    for (auto i = static_cast<long long>(std::floor(low)); static_cast<double>(i) < high; ++i) {
      const double begin = std::max(low, static_cast<double>(i));
      const double end = std::min(high, static_cast<double>(i) + 1.0);
      if (end > begin) sum += (end - begin) * at(i);
    }
    line[c] = static_cast<float>(sum / (high - low));
  }
  return line;
}

std::vector<float> smooth_line(std::span<const float> line, double sigma) {
  if (sigma < 0.3 || line.empty()) return {line.begin(), line.end()};
  const auto reach = static_cast<std::size_t>(std::ceil(3.0 * sigma));
  std::vector<float> kernel(reach + 1);
  float sum = 0.0F;
  for (std::size_t k = 0; k <= reach; ++k) {
    const double off = static_cast<double>(k) / sigma;
    kernel[k] = static_cast<float>(std::exp(-0.5 * off * off));
    sum += (k == 0 ? 1.0F : 2.0F) * kernel[k];
  }
  for (float& weight : kernel) weight /= sum;
  // Continues the line periodically beyond both ends, so that the loops below do not wrap.
  std::vector<float> closed(line.size() + 2 * reach);
  for (std::size_t i = 0; i < closed.size(); ++i) {
    closed[i] = line[(i + line.size() - reach % line.size()) % line.size()];
  }
  std::vector<float> result(line.size());
  for (std::size_t c = 0; c < line.size(); ++c) result[c] = kernel[0] * closed[c + reach];
  for (std::size_t k = 1; k <= reach; ++k) {
    const float* const left = closed.data() + reach - k;
    const float* const right = closed.data() + reach + k;
    for (std::size_t c = 0; c < line.size(); ++c) result[c] += kernel[k] * (left[c] + right[c]);
  }
  return result;
}

}  // namespace panonav
