#include "panonav/signature/gradient_features.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

namespace {

/// Half of the side of the patch that a histogram describes. On crops of `ciirc_b670` smaller ones
/// recognise fewer places (docs/decisions.md).
constexpr double gradient_patch_rad = radians(8.0);
/// Half-width of an azimuth window, and the largest number of corners kept in it.
constexpr double gradient_window_rad = radians(6.0);
constexpr int max_corners_in_window = 12;
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
/// 0 where a gradient is unknown.
std::vector<float> compute_strengths(const Grid& grid, const GradientField& field) {
  std::vector<float> strengths(field.along.size());
  const auto stride = static_cast<std::ptrdiff_t>(grid.stride);
  for (int y = 0; y < grid.rows; ++y) {
    for (int x = 0; x < grid.columns; ++x) {
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

/// Keeps the corners that fewer than `max_corners_in_window` stronger ones are near to, and of
/// these the `max_count` strongest. `period`: columns after which azimuths repeat; 0: they do not.
std::vector<FoundCorner> spread_corners(const std::vector<FoundCorner>& all, int window,
                                        int period) {
  std::vector<FoundCorner> kept;
  for (const FoundCorner& corner : all) {
    const auto stronger = std::ranges::count_if(all, [&](const FoundCorner& other) {
      const int apart = std::abs(other.column - corner.column);
      return other.strength > corner.strength &&
             (period > 0 ? std::min(apart, period - apart) : apart) <= window;
    });
    if (stronger < max_corners_in_window) kept.push_back(corner);
  }
  if (kept.size() > GradientFeatures::max_count) {
    std::ranges::stable_sort(kept, std::greater<>(), &FoundCorner::strength);
    kept.resize(GradientFeatures::max_count);
    std::ranges::sort(kept, {}, [](const FoundCorner& c) { return std::pair(c.row, c.column); });
  }
  return kept;
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
PatchRadii find_patch_radii(double row_rad, double column_rad, int rows) {
  return {
      std::clamp(static_cast<int>(std::lround(gradient_patch_rad / row_rad)), 3, std::max(3, rows)),
      std::max(3, static_cast<int>(std::lround(gradient_patch_rad / column_rad)))};
}

GradientFeatures extract_from(const Grid& grid, const GridLayout& layout, const PatchRadii& radii) {
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
  const std::vector<PatchSample> patch = make_patch(radii.columns, radii.rows);
  GradientFeatures found;
  for (const FoundCorner& corner : spread_corners(all, window, layout.period)) {
    const auto histogram = describe_patch(grid, field, patch, corner);
    if (!histogram) continue;
    found.corners.push_back(
        {static_cast<float>(layout.first_azimuth_rad + corner.column * layout.column_rad),
         static_cast<float>(layout.top_rad - (corner.row + 0.5) * layout.row_rad)});
    found.histograms.push_back(*histogram);
  }
  return found;
}

bool is_masked_row(const PreprocessingOptions& preprocessing, int row, int rows) {
  return row < preprocessing.masked_rows_top || row >= rows - preprocessing.masked_rows_bottom;
}

/// Marks the end of an entry with gradient features: after it comes their number of bytes.
constexpr std::array<std::uint8_t, 4> gradient_mark{'G', 'R', 'A', '1'};
constexpr std::size_t trailer_bytes = gradient_mark.size() + 4;

}  // namespace

std::optional<GradientFeatures> extract_gradient_features(
    const Panorama& panorama, const PreprocessingOptions& preprocessing) {
  if (!panorama.elevations()) return std::nullopt;
  const int rows = panorama.rows();
  const int columns = panorama.columns();
  require_unmasked_rows(preprocessing, rows);
  const ElevationBand& band = *panorama.elevations();
  const GridLayout layout{0.0, 2.0 * std::numbers::pi / columns, band.top_rad,
                          (band.top_rad - band.bottom_rad) / rows, columns};
  const PatchRadii radii = find_patch_radii(layout.row_rad, layout.column_rad, rows);
  Grid grid(rows, columns, radii.rows + corner_margin, radii.columns + corner_margin);
  for (int y = 0; y < rows; ++y) {
    if (is_masked_row(preprocessing, y, rows)) continue;
    for (int x = -grid.margin_columns; x < columns + grid.margin_columns; ++x) {
      const int from = ((x % columns) + columns) % columns;
      grid.values[grid.index(y, x)] = to_grey_level(panorama.at(y, from));
      grid.visible[grid.index(y, x)] = 1;
    }
  }
  return extract_from(grid, layout, radii);
}

GradientFeatures extract_gradient_features(const SectorView& sector,
                                           const PreprocessingOptions& preprocessing) {
  const int rows = sector.panorama.rows;
  const GridLayout layout{sector.first_azimuth_rad, sector.column_rad(), sector.elevations.top_rad,
                          sector.row_rad(), 0};
  const PatchRadii radii = find_patch_radii(layout.row_rad, layout.column_rad, rows);
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
  return extract_from(grid, layout, radii);
}

GradientFeatures mirror(const GradientFeatures& features) {
  constexpr int cells = GradientFeatures::cells;
  constexpr int directions = GradientFeatures::directions;
  GradientFeatures mirrored;
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
  }
  return cut;
}

std::vector<std::uint8_t> pack(const GradientFeatures& features, PanoramaShape shape,
                               const ElevationBand& elevations) {
  const double column_rad = 2.0 * std::numbers::pi / shape.columns;
  const double row_rad = (elevations.top_rad - elevations.bottom_rad) / shape.rows;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(features.corners.size() * GradientFeatures::packed_bytes);
  for (std::size_t i = 0; i < features.corners.size(); ++i) {
    const auto& corner = features.corners[i];
    const auto column = static_cast<unsigned>(std::lround(corner.azimuth_rad / column_rad));
    const auto row = static_cast<unsigned>(
        std::lround((elevations.top_rad - corner.elevation_rad) / row_rad - 0.5));
    for (const unsigned value : {column, row}) {
      bytes.push_back(static_cast<std::uint8_t>(value & 255U));
      bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
    }
    const auto& histogram = features.histograms[i];
    for (std::size_t k = 0; k < histogram.size(); k += 2) {
      bytes.push_back(static_cast<std::uint8_t>(histogram[k] | histogram[k + 1] << 4U));
    }
  }
  return bytes;
}

GradientFeatures unpack_gradient_features(std::span<const std::uint8_t> bytes, PanoramaShape shape,
                                          const ElevationBand& elevations) {
  constexpr std::size_t size = GradientFeatures::packed_bytes;
  require(bytes.size() % size == 0 && bytes.size() <= size * GradientFeatures::max_count,
          "bytes of gradient features", static_cast<double>(bytes.size()),
          "68 for each, up to 256 of them");
  const double column_rad = 2.0 * std::numbers::pi / shape.columns;
  const double row_rad = (elevations.top_rad - elevations.bottom_rad) / shape.rows;
  GradientFeatures features;
  for (; !bytes.empty(); bytes = bytes.subspan(size)) {
    const int column = bytes[0] | bytes[1] << 8;
    const int row = bytes[2] | bytes[3] << 8;
    require(column < shape.columns, "column of a gradient feature", column,
            "one of the panorama's");
    require(row < shape.rows, "row of a gradient feature", row, "one of the panorama's");
    features.corners.push_back({static_cast<float>(column * column_rad),
                                static_cast<float>(elevations.top_rad - (row + 0.5) * row_rad)});
    auto& histogram = features.histograms.emplace_back();
    for (std::size_t k = 0; k < histogram.size(); k += 2) {
      const std::uint8_t both = bytes[4 + k / 2];
      histogram[k] = both & 15U;
      histogram[k + 1] = both >> 4U;
    }
  }
  return features;
}

std::vector<std::uint8_t> join_feature_bytes(const FeatureBytes& parts) {
  std::vector<std::uint8_t> bytes(parts.local.begin(), parts.local.end());
  if (parts.gradient.empty()) return bytes;
  bytes.insert(bytes.end(), parts.gradient.begin(), parts.gradient.end());
  for (unsigned shift = 0; shift < 32; shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>(parts.gradient.size() >> shift));
  }
  bytes.insert(bytes.end(), gradient_mark.begin(), gradient_mark.end());
  return bytes;
}

FeatureBytes split_feature_bytes(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() < trailer_bytes ||
      !std::ranges::equal(bytes.last(gradient_mark.size()), gradient_mark)) {
    return {bytes, {}};
  }
  const std::size_t before = bytes.size() - trailer_bytes;
  std::size_t size = 0;
  for (std::size_t i = 0; i < 4; ++i) size |= std::size_t{bytes[before + i]} << (8 * i);
  if (size > before || size % GradientFeatures::packed_bytes != 0) return {bytes, {}};
  return {bytes.first(before - size), bytes.subspan(before - size, size)};
}

}  // namespace panonav
