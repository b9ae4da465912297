#include "panonav/camera/internal/edge_field.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "panonav/core/error.hpp"

namespace panonav {
namespace {

struct Gradient {
  float u = 0.0F;
  float v = 0.0F;
  float squared = 0.0F;
};

std::vector<float> make_gaussian_kernel(double sigma_px) {
  const int reach = std::max(1, static_cast<int>(std::ceil(3 * sigma_px)));
  std::vector<float> kernel(2 * reach + 1);
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    const double x = i / sigma_px;
    kernel[i + reach] = static_cast<float>(std::exp(-0.5 * x * x));
    sum += kernel[i + reach];
  }
  for (float& weight : kernel) weight /= sum;
  return kernel;
}

std::vector<float> smooth_plane(const std::vector<float>& plane, int width, int height,
                                const std::vector<float>& kernel) {
  const int reach = static_cast<int>(kernel.size() / 2);
  std::vector<float> rows(plane.size());
  std::vector<float> result(plane.size());
  for (int v = 0; v < height; ++v) {
    const float* line = plane.data() + static_cast<std::ptrdiff_t>(v) * width;
    float* out = rows.data() + static_cast<std::ptrdiff_t>(v) * width;
    for (int u = 0; u < width; ++u) {
      float sum = 0;
      for (int i = -reach; i <= reach; ++i) {
        sum += kernel[i + reach] * line[std::clamp(u + i, 0, width - 1)];
      }
      out[u] = sum;
    }
  }
  for (int v = 0; v < height; ++v) {
    float* out = result.data() + static_cast<std::ptrdiff_t>(v) * width;
    for (int i = -reach; i <= reach; ++i) {
      const float weight = kernel[i + reach];
      const float* line =
          rows.data() + static_cast<std::ptrdiff_t>(std::clamp(v + i, 0, height - 1)) * width;
      for (int u = 0; u < width; ++u) out[u] += weight * line[u];
    }
  }
  return result;
}

/// Computes the gradient of the channel with the steepest slope; one-sided differences at the
/// frame.
Gradient find_largest_gradient(const SmoothPlanes& planes, int u, int v) {
  const int left = std::max(0, u - 1);
  const int right = std::min(planes.width - 1, u + 1);
  const int above = std::max(0, v - 1);
  const int below = std::min(planes.height - 1, v + 1);
  Gradient best;
  for (const std::vector<float>& plane : planes.channels) {
    const auto at = [&](int x, int y) { return plane[planes.index(x, y)]; };
    Gradient slope;
    slope.u = (at(right, v) - at(left, v)) / static_cast<float>(std::max(1, right - left));
    slope.v = (at(u, below) - at(u, above)) / static_cast<float>(std::max(1, below - above));
    slope.squared = slope.u * slope.u + slope.v * slope.v;
    if (slope.squared > best.squared) best = slope;
  }
  return best;
}

}  // namespace

SmoothPlanes make_smooth_planes(ImageView image, int reduction, double sigma_px) {
  require(image.data != nullptr && image.width >= 1 && image.height >= 1, "image width",
          image.width, "an image with pixels");
  require(reduction >= 1 && reduction <= std::min(image.width, image.height), "reduction",
          reduction, "1 .. the shorter side");
  require(sigma_px > 0 && sigma_px < 100, "sigma_px", sigma_px, "above 0, below 100");
  SmoothPlanes planes;
  planes.width = image.width / reduction;
  planes.height = image.height / reduction;
  const std::size_t size = planes.index(0, planes.height);
  const std::vector<float> kernel = make_gaussian_kernel(sigma_px);
  const float area = static_cast<float>(reduction) * static_cast<float>(reduction);
  for (int channel = 0; channel < image.channels; ++channel) {
    std::vector<float> plane(size);
    for (int v = 0; v < planes.height; ++v) {
      for (int u = 0; u < planes.width; ++u) {
        int sum = 0;
        for (int y = 0; y < reduction; ++y) {
          for (int x = 0; x < reduction; ++x) {
            sum += image.at(u * reduction + x, v * reduction + y, channel);
          }
        }
        plane[planes.index(u, v)] = static_cast<float>(sum) / area;
      }
    }
    planes.channels.push_back(smooth_plane(plane, planes.width, planes.height, kernel));
  }
  std::vector<float> slopes;
  slopes.reserve(size);
  for (int v = 0; v < planes.height; ++v) {
    for (int u = 0; u < planes.width; ++u)
      slopes.push_back(find_largest_gradient(planes, u, v).squared);
  }
  const auto percentile_80 = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() * 4 / 5);
  std::nth_element(slopes.begin(), percentile_80, slopes.end());
  planes.slope_scale = std::max(1.0F, std::sqrt(*percentile_80));
  return planes;
}

EdgeField make_edge_field(const SmoothPlanes& planes) {
  EdgeField field;
  field.width = planes.width;
  field.height = planes.height;
  const std::size_t size = field.index(0, field.height);
  field.cosine.reserve(size);
  field.sine.reserve(size);
  const float scale = planes.slope_scale * planes.slope_scale;
  for (int v = 0; v < field.height; ++v) {
    for (int u = 0; u < field.width; ++u) {
      const Gradient slope = find_largest_gradient(planes, u, v);
      // |g|^2 / (|g|^2 + scale) times (cos 2t, sin 2t) = (u^2 - v^2, 2 u v) / |g|^2.
      const float weight = 1.0F / (slope.squared + scale);
      field.cosine.push_back(weight * (slope.u * slope.u - slope.v * slope.v));
      field.sine.push_back(weight * 2 * slope.u * slope.v);
    }
  }
  return field;
}

EdgeField average_fields(std::span<const EdgeField> fields) {
  require(!fields.empty(), "number of fields", 0, "at least 1");
  EdgeField mean = fields[0];
  for (const EdgeField& field : fields.subspan(1)) {
    require(field.width == mean.width && field.height == mean.height, "field width", field.width,
            "all of one size");
    for (std::size_t i = 0; i < mean.cosine.size(); ++i) {
      mean.cosine[i] += field.cosine[i];
      mean.sine[i] += field.sine[i];
    }
  }
  const float share = 1.0F / static_cast<float>(fields.size());
  for (float& value : mean.cosine) value *= share;
  for (float& value : mean.sine) value *= share;
  return mean;
}

EdgeField reduce(const EdgeField& field, int reduction) {
  require(reduction >= 1 && reduction <= std::min(field.width, field.height), "reduction",
          reduction, "1 .. the shorter side");
  EdgeField result;
  result.width = field.width / reduction;
  result.height = field.height / reduction;
  const std::size_t size = result.index(0, result.height);
  result.cosine.assign(size, 0.0F);
  result.sine.assign(size, 0.0F);
  const float share = 1.0F / static_cast<float>(reduction * reduction);
  for (int v = 0; v < result.height * reduction; ++v) {
    for (int u = 0; u < result.width * reduction; ++u) {
      const std::size_t from = field.index(u, v);
      const std::size_t to = result.index(u / reduction, v / reduction);
      result.cosine[to] += share * field.cosine[from];
      result.sine[to] += share * field.sine[from];
    }
  }
  return result;
}

}  // namespace panonav
