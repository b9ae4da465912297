#include "panonav/signature/gradient_features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <tuple>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/types.hpp"

namespace panonav {

namespace {

/// Half of the side of the patch that a histogram of a panorama describes, for cylinders of 1,024
/// columns (docs/decisions.md).
constexpr double gradient_patch_rad = radians(4.0);
/// Sizes of the patches of a narrow picture relative to that: half an octave to each side.
constexpr std::array<double, 3> sector_patch_scales{1.0, 1.0 / std::numbers::sqrt2,
                                                    std::numbers::sqrt2};
/// Half-width of an azimuth window, and the largest number of corners kept in it. Panoramas keep
/// more, since the picture of another place shows some of them stronger than others.
constexpr double gradient_window_rad = radians(3.0);
constexpr int max_corners_of_panorama = 20;
constexpr int max_corners_of_sector = 12;
constexpr int max_leading_in_window = 5;
/// Corners of a narrow picture at most: `kernels::max_histograms` over the number of patches.
constexpr std::size_t max_sector_corners = kernels::max_histograms / sector_patch_scales.size();
/// Number of columns of a cylinder for features, to which multiples of a memory's are the nearest.
constexpr int gradient_columns = 1024;
/// Strength of a gradient of a third of a grey level per pixel in its weaker direction; factors as
/// in `LocalFeatures`. Corners of dark rooms count, too: the histogram is normalised.
constexpr float min_corner_strength = 0.1F * 25.0F * (2.0F * 9.0F) * (2.0F * 9.0F);
/// Pixels around a corner that must be visible: 3 x 3 of the mean, a difference, 5 x 5 of the sum.
constexpr int corner_margin = 4;
/// Smallest visible share of a patch.
constexpr double min_visible_share = 0.6;
/// Value of a histogram's entry that has a share of 1 of all gradients. Entries have a root mean
/// square of 1 / sqrt(128); few exceed four times that, which is the largest level.
constexpr float levels_of_root_share = 22.4F;

/// Grey levels of a part of the cylinder, with a margin on all sides, and the marks of visible
/// ones.
struct Grid {
  Grid(int rows_, int columns_, int margin_rows_, int margin_columns_)
      : rows(rows_),
        columns(columns_),
        margin_rows(margin_rows_),
        margin_columns(margin_columns_),
        stride(columns_ + 2 * margin_columns_) {
    const auto size =
        static_cast<std::size_t>(rows + 2 * margin_rows) * static_cast<std::size_t>(stride);
    values.resize(size);
    visible.resize(size);
  }
  [[nodiscard]] std::size_t index(int y, int x) const {
    return static_cast<std::size_t>((y + margin_rows) * stride + x + margin_columns);
  }
  int rows, columns, margin_rows, margin_columns, stride;
  std::vector<float> values;  // 0 .. 255
  std::vector<std::uint8_t> visible;
};

/// Gradients of the smoothed grid: their lengths, 0 where not all pixels are visible, and
/// directions in units of a histogram's.
struct GradientField {
  std::vector<float> along, down, lengths, directions;
  std::vector<std::uint8_t> known;
};

float to_grey_level(float value) {
  return static_cast<float>(static_cast<int>(std::clamp(value, 0.0F, 1.0F) * 255.0F + 0.5F));
}

/// Sums 3 x 3 pixels; `known` where all of them are visible.
void sum_neighbourhoods(const Grid& grid, std::vector<float>& sums,
                        std::vector<std::uint8_t>& known) {
  const auto stride = static_cast<std::size_t>(grid.stride);
  sums.assign(grid.values.size(), 0.0F);
  known.assign(grid.values.size(), 0);
  for (std::size_t i = stride + 1; i + stride + 1 < grid.values.size(); ++i) {
    float sum = 0.0F;
    int seen = 0;
    for (const std::size_t row : {i - stride, i, i + stride}) {
      for (std::size_t k = row - 1; k <= row + 1; ++k) {
        sum += grid.values[k];
        seen += grid.visible[k];
      }
    }
    sums[i] = sum;
    known[i] = seen == 9 ? 1 : 0;
  }
}

GradientField compute_gradients(const Grid& grid) {
  std::vector<float> sums;
  std::vector<std::uint8_t> known;
  sum_neighbourhoods(grid, sums, known);
  const auto stride = static_cast<std::size_t>(grid.stride);
  GradientField field;
  for (auto* const numbers : {&field.along, &field.down, &field.lengths, &field.directions}) {
    numbers->assign(sums.size(), 0.0F);
  }
  field.known.assign(sums.size(), 0);
  constexpr float per_turn = GradientFeatures::directions / (2.0F * std::numbers::pi_v<float>);
  for (std::size_t i = stride + 1; i + stride + 1 < sums.size(); ++i) {
    if ((known[i - 1] & known[i + 1] & known[i - stride] & known[i + stride]) == 0) continue;
    const float along = sums[i + 1] - sums[i - 1];
    const float down = sums[i + stride] - sums[i - stride];
    field.known[i] = 1;
    field.along[i] = along;
    field.down[i] = down;
    field.lengths[i] = std::sqrt(along * along + down * down);
    const float turns = std::atan2(-down, along) * per_turn;
    field.directions[i] = turns < 0.0F ? turns + GradientFeatures::directions : turns;
  }
  return field;
}

/// Computes the smaller eigenvalue of the structure tensor over 5 x 5 pixels [Shi and Tomasi 1994];
/// 0 where a gradient is unknown. Beside the first and last column, too, where azimuths repeat.
std::vector<float> compute_strengths(const Grid& grid, const GradientField& field) {
  std::vector<float> strengths(field.along.size());
  const auto stride = static_cast<std::ptrdiff_t>(grid.stride);
  for (int y = 0; y < grid.rows; ++y) {
    for (int x = -2; x < grid.columns + 2; ++x) {
      const auto at = static_cast<std::ptrdiff_t>(grid.index(y, x));
      float xx = 0.0F;
      float xy = 0.0F;
      float yy = 0.0F;
      int seen = 0;
      for (int j = -2; j <= 2; ++j) {
        for (std::ptrdiff_t k = at + j * stride - 2; k <= at + j * stride + 2; ++k) {
          const auto i = static_cast<std::size_t>(k);
          xx += field.along[i] * field.along[i];
          xy += field.along[i] * field.down[i];
          yy += field.down[i] * field.down[i];
          seen += field.known[i];
        }
      }
      if (seen < 25) continue;
      strengths[static_cast<std::size_t>(at)] =
          0.5F * (xx + yy - std::sqrt((xx - yy) * (xx - yy) + 4.0F * xy * xy));
    }
  }
  return strengths;
}

struct FoundCorner {
  int column, row;
  float strength;
  int stronger = 0;  // number of stronger corners in the window around it
};

bool is_local_maximum(const Grid& grid, const std::vector<float>& strengths, int row, int column) {
  const float here = strengths[grid.index(row, column)];
  for (int j = -2; j <= 2; ++j) {
    for (int i = -2; i <= 2; ++i) {
      const float other = strengths[grid.index(row + j, column + i)];
      if (other > here || (other == here && (j < 0 || (j == 0 && i < 0)))) return false;
    }
  }
  return true;
}

/// Counts the stronger corners in the window around each. `period`: columns after which azimuths
/// repeat; 0: they do not.
void count_stronger(std::vector<FoundCorner>& all, int columns, int window, int period) {
  std::vector<std::vector<float>> strengths(static_cast<std::size_t>(columns));
  for (const FoundCorner& corner : all) {
    strengths[static_cast<std::size_t>(corner.column)].push_back(corner.strength);
  }
  for (FoundCorner& corner : all) {
    for (int x = corner.column - window; x <= corner.column + window; ++x) {
      const int at = period > 0 ? ((x % period) + period) % period : x;
      if (at < 0 || at >= columns) continue;
      corner.stronger += static_cast<int>(
          std::ranges::count_if(strengths[static_cast<std::size_t>(at)],
                                [&](float other) { return other > corner.strength; }));
    }
  }
}

/// Number of corners that are kept.
struct CornerLimits {
  int in_window;      // around each, that are as strong
  std::size_t count;  // in all; the strongest ones
};

/// Keeps the corners within the limits, leading ones first, each by row and column.
std::vector<FoundCorner> spread_corners(std::vector<FoundCorner> corners,
                                        const CornerLimits& limits) {
  std::erase_if(corners, [&](const FoundCorner& c) { return c.stronger >= limits.in_window; });
  if (corners.size() > limits.count) {
    std::ranges::stable_sort(corners, std::greater<>(), &FoundCorner::strength);
    corners.resize(limits.count);
  }
  std::ranges::sort(corners, {}, [](const FoundCorner& c) {
    return std::tuple(c.stronger >= max_leading_in_window, c.row, c.column);
  });
  return corners;
}

/// A sample of a patch and the two by two cells to which it contributes.
struct PatchSample {
  int down, right;
  float weight;
  float cell_x, cell_y;  // of the middle of the sample, in cells from the first cell's middle
};

std::vector<PatchSample> make_patch(int radius_columns, int radius_rows) {
  constexpr double deviation = 0.8;  // of the Gaussian weight, in radii
  std::vector<PatchSample> samples;
  const int n = radius_columns;
  for (int j = -n; j < n; ++j) {
    for (int i = -n; i < n; ++i) {
      const double y = (j + 0.5) / n;
      const double x = (i + 0.5) / n;
      samples.push_back(
          {static_cast<int>(std::floor(y * radius_rows + 0.5)),
           static_cast<int>(std::floor(x * radius_columns + 0.5)),
           static_cast<float>(std::exp(-(x * x + y * y) / (2.0 * deviation * deviation))),
           static_cast<float>((x + 1.0) * GradientFeatures::cells / 2.0 - 0.5),
           static_cast<float>((y + 1.0) * GradientFeatures::cells / 2.0 - 0.5)});
    }
  }
  return samples;
}

/// Adds a gradient to the cells and directions next to it, linearly.
void add_sample(const PatchSample& sample, float length, float direction,
                std::array<float, GradientFeatures::dimensions>& sums) {
  const int x0 = static_cast<int>(std::floor(sample.cell_x));
  const int y0 = static_cast<int>(std::floor(sample.cell_y));
  const int d0 = static_cast<int>(direction);
  const float fx = sample.cell_x - static_cast<float>(x0);
  const float fy = sample.cell_y - static_cast<float>(y0);
  const float fd = direction - static_cast<float>(d0);
  constexpr int cells = GradientFeatures::cells;
  constexpr int directions = GradientFeatures::directions;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const int x = x0 + i;
      const int y = y0 + j;
      if (x < 0 || x >= cells || y < 0 || y >= cells) continue;
      const float weight =
          sample.weight * length * (i == 0 ? 1.0F - fx : fx) * (j == 0 ? 1.0F - fy : fy);
      float* const cell = sums.data() + (y * cells + x) * directions;
      cell[d0 % directions] += weight * (1.0F - fd);
      cell[(d0 + 1) % directions] += weight * fd;
    }
  }
}

/// Returns the histogram of the patch around a corner; nullopt if too little of it is visible.
std::optional<GradientFeatures::Histogram> describe_patch(const Grid& grid,
                                                          const GradientField& field,
                                                          std::span<const PatchSample> patch,
                                                          const FoundCorner& corner) {
  std::array<float, GradientFeatures::dimensions> sums{};
  std::size_t seen = 0;
  for (const PatchSample& sample : patch) {
    const std::size_t at = grid.index(corner.row + sample.down, corner.column + sample.right);
    if (grid.visible[at] == 0) continue;
    ++seen;
    if (field.known[at] != 0) add_sample(sample, field.lengths[at], field.directions[at], sums);
  }
  if (static_cast<double>(seen) < min_visible_share * static_cast<double>(patch.size())) return {};
  float total = 0.0F;
  for (const float sum : sums) total += sum;
  if (!(total > 0.0F)) return {};
  GradientFeatures::Histogram histogram{};
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    const float level = levels_of_root_share * std::sqrt(sums[i] / total);
    histogram[i] = static_cast<std::uint8_t>(
        std::min(level + 0.5F, static_cast<float>(GradientFeatures::max_level)));
  }
  return histogram;
}

/// Layout of a grid on the cylinder.
struct GridLayout {
  double first_azimuth_rad = 0.0;
  double column_rad = 0.0;
  double top_rad = 0.0;
  double row_rad = 0.0;
  int period = 0;  ///< columns after which azimuths repeat; 0: they do not
};

/// Radii of a patch in rows and columns.
struct PatchRadii {
  int rows, columns;
};
PatchRadii find_patch_radii(const GridLayout& layout, double scale, int rows) {
  const double patch_rad = scale * gradient_patch_rad;
  return {
      std::clamp(static_cast<int>(std::lround(patch_rad / layout.row_rad)), 3, std::max(3, rows)),
      std::max(3, static_cast<int>(std::lround(patch_rad / layout.column_rad)))};
}

/// Radii of the largest of several patches.
PatchRadii find_margins(const GridLayout& layout, std::span<const double> scales, int rows) {
  return find_patch_radii(layout, std::ranges::max(scales), rows);
}

GradientFeatures extract_from(const Grid& grid, const GridLayout& layout,
                              std::span<const double> scales, const CornerLimits& limits) {
  const GradientField field = compute_gradients(grid);
  const std::vector<float> strengths = compute_strengths(grid, field);
  std::vector<FoundCorner> all;
  for (int y = 0; y < grid.rows; ++y) {
    for (int x = 0; x < grid.columns; ++x) {
      const float strength = strengths[grid.index(y, x)];
      if (strength > min_corner_strength && is_local_maximum(grid, strengths, y, x)) {
        all.push_back({x, y, strength});
      }
    }
  }
  const auto window = static_cast<int>(gradient_window_rad / layout.column_rad);
  count_stronger(all, grid.columns, window, layout.period);
  const std::vector<FoundCorner> kept = spread_corners(std::move(all), limits);
  GradientFeatures found;
  for (const double scale : scales) {
    const PatchRadii radii = find_patch_radii(layout, scale, grid.rows);
    const std::vector<PatchSample> patch = make_patch(radii.columns, radii.rows);
    for (const FoundCorner& corner : kept) {
      const auto histogram = describe_patch(grid, field, patch, corner);
      if (!histogram) continue;
      found.corners.push_back(
          {static_cast<float>(layout.first_azimuth_rad + corner.column * layout.column_rad),
           static_cast<float>(layout.top_rad - (corner.row + 0.5) * layout.row_rad)});
      found.histograms.push_back(*histogram);
      if (scale == scales.front() && corner.stronger < max_leading_in_window) ++found.leading;
    }
  }
  return found;
}

bool is_masked_row(const PreprocessingOptions& preprocessing, int row, int rows) {
  return row < preprocessing.masked_rows_top || row >= rows - preprocessing.masked_rows_bottom;
}

}  // namespace

PanoramaShape find_gradient_shape(PanoramaShape shape) noexcept {
  constexpr int max_times = 8;
  const auto times =
      static_cast<int>(std::lround(gradient_columns / std::max(1.0, 1.0 * shape.columns)));
  const int used = std::clamp(times, 1, max_times);
  return {used * shape.rows, used * shape.columns};
}

std::optional<GradientFeatures> extract_gradient_features(
    const Panorama& panorama, const PreprocessingOptions& preprocessing) {
  if (!panorama.elevations()) return std::nullopt;
  const int rows = panorama.rows();
  const int columns = panorama.columns();
  require_unmasked_rows(preprocessing, rows);
  const ElevationBand& band = *panorama.elevations();
  const GridLayout layout{0.0, 2.0 * std::numbers::pi / columns, band.top_rad,
                          (band.top_rad - band.bottom_rad) / rows, columns};
  constexpr std::array<double, 1> scales{1.0};
  const PatchRadii radii = find_margins(layout, scales, rows);
  Grid grid(rows, columns, radii.rows + corner_margin, radii.columns + corner_margin);
  for (int y = 0; y < rows; ++y) {
    if (is_masked_row(preprocessing, y, rows)) continue;
    for (int x = -grid.margin_columns; x < columns + grid.margin_columns; ++x) {
      const int from = ((x % columns) + columns) % columns;
      grid.values[grid.index(y, x)] = to_grey_level(panorama.at(y, from));
      grid.visible[grid.index(y, x)] = 1;
    }
  }
  return extract_from(grid, layout, scales, {max_corners_of_panorama, GradientFeatures::max_count});
}

GradientFeatures extract_gradient_features(const SectorView& sector,
                                           const PreprocessingOptions& preprocessing,
                                           double share) {
  const int rows = sector.panorama.rows;
  const GridLayout layout{sector.first_azimuth_rad, sector.column_rad(), sector.elevations.top_rad,
                          sector.row_rad(), 0};
  const PatchRadii radii = find_margins(layout, sector_patch_scales, rows);
  Grid grid(rows, sector.columns, radii.rows + corner_margin, radii.columns + corner_margin);
  for (int y = 0; y < rows; ++y) {
    if (is_masked_row(preprocessing, y, rows)) continue;
    for (int x = 0; x < sector.columns; ++x) {
      const auto from = static_cast<std::size_t>(y * sector.columns + x);
      if (sector.visible[from] == 0) continue;
      grid.values[grid.index(y, x)] = to_grey_level(sector.values[from]);
      grid.visible[grid.index(y, x)] = 1;
    }
  }
  return extract_from(
      grid, layout, sector_patch_scales,
      {max_corners_of_sector, static_cast<std::size_t>(share * max_sector_corners)});
}

GradientFeatures mirror(const GradientFeatures& features) {
  constexpr int cells = GradientFeatures::cells;
  constexpr int directions = GradientFeatures::directions;
  GradientFeatures mirrored;
  mirrored.leading = features.leading;
  for (const auto& corner : features.corners) {
    mirrored.corners.push_back({-corner.azimuth_rad, corner.elevation_rad});
  }
  for (const auto& histogram : features.histograms) {
    auto& to = mirrored.histograms.emplace_back();
    for (int i = 0; i < GradientFeatures::dimensions; ++i) {
      const int cell = i / directions;
      // A direction at the angle a goes to pi - a.
      const int direction = (directions / 2 - i % directions + directions) % directions;
      const int other = cell / cells * cells + (cells - 1 - cell % cells);
      to[static_cast<std::size_t>(other * directions + direction)] =
          histogram[static_cast<std::size_t>(i)];
    }
  }
  return mirrored;
}

GradientFeatures cut_sector(const GradientFeatures& features, double middle_rad, double width_rad,
                            const ElevationBand& elevations) {
  GradientFeatures cut;
  for (std::size_t i = 0; i < features.corners.size(); ++i) {
    const auto& [azimuth_rad, elevation_rad] = features.corners[i];
    const double turned_rad = angle_difference(azimuth_rad, middle_rad);
    if (std::abs(turned_rad) > 0.5 * width_rad || elevation_rad < elevations.bottom_rad ||
        elevation_rad > elevations.top_rad) {
      continue;
    }
    cut.corners.push_back({static_cast<float>(turned_rad), elevation_rad});
    cut.histograms.push_back(features.histograms[i]);
    if (i < features.leading) ++cut.leading;
  }
  return cut;
}

}  // namespace panonav
