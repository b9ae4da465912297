#include "panonav/panorama/internal/unwarp_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/kernels/remap.hpp"

namespace panonav {

namespace {

/// Position of the upper left of four neighbouring pixels of a halved image, and the weights of the
/// four.
struct Tap {
  int level = 0;
  int u = -1;  // -1: nothing is seen there
  int v = -1;
  std::uint32_t weights = 0;
  [[nodiscard]] bool is_visible() const { return u >= 0; }
};

/// Taps of one row: tap t of column c at t * columns + c. With two lenses, the taps of both for one
/// direction follow each other.
using Taps = std::vector<Tap>;

/// Packs the four bilinear weights as bytes that add up to `sum` exactly. The units lost by
/// rounding down go to the weights with the largest fractions.
std::uint32_t pack_weights(double fraction_u, double fraction_v, int sum) {
  const std::array<double, 4> exact = {(1 - fraction_u) * (1 - fraction_v),
                                       (1 - fraction_u) * fraction_v, fraction_u * (1 - fraction_v),
                                       fraction_u * fraction_v};
  std::array<std::uint32_t, 4> weights{};
  std::array<double, 4> cut_off{};
  int left = sum;
  for (std::size_t i = 0; i < 4; ++i) {
    const double scaled = exact[i] * sum;
    weights[i] = static_cast<std::uint32_t>(scaled);
    cut_off[i] = scaled - weights[i];
    left -= static_cast<int>(weights[i]);
  }
  for (; left > 0; --left) {
    const auto largest =
        static_cast<std::size_t>(std::ranges::max_element(cut_off) - cut_off.begin());
    ++weights[largest];
    cut_off[largest] = -1.0;
  }
  return weights[0] | weights[1] << 8U | weights[2] << 16U | weights[3] << 24U;
}

double distance_px(const PixelPoint& a, const PixelPoint& b) {
  return std::hypot(a.u_px - b.u_px, a.v_px - b.v_px);
}

/// Makes the taps of one row after the other.
class RowSampler {
 public:
  RowSampler(const Camera& camera, int rows, int columns, const ElevationBand& band)
      : camera_(camera),
        columns_(columns),
        top_rad_(band.top_rad),
        column_rad_(2.0 * std::numbers::pi / columns),
        row_rad_((band.top_rad - band.bottom_rad) / rows),
        lens_count_(lens_count(camera)),
        rig_(std::get_if<RigModel>(&camera.model)) {
    if (const auto* model = std::get_if<DualFisheyeModel>(&camera.model)) {
      // Scales the brighter lens down to the darker one, so that no weight exceeds
      // `tap_weight_sum`.
      const double darker = std::min(model->lenses[0].gain, model->lenses[1].gain);
      for (int i = 0; i < 2; ++i) brightness_factors_[i] = darker / model->lenses[i].gain;
    }
  }

  [[nodiscard]] Taps make_row_taps(int row) const {
    const double elevation_rad = top_rad_ - row_rad_ * (row + 0.5);
    const Spacing spacing = measure_spacing(elevation_rad);
    int smaller_side = std::min(camera_.image_size.width, camera_.image_size.height);
    if (rig_) {
      for (const Camera& camera : rig_->cameras) {
        smaller_side = std::min({smaller_side, camera.image_size.width, camera.image_size.height});
      }
    }
    int level = static_cast<int>(
        std::lround(std::log2(std::max(1.0, std::min(spacing.across_px, spacing.down_px)))));
    while (level > 0 && (smaller_side >> level) < 4) --level;
    for (;; --level) {
      Placement placement = place_taps(elevation_rad, spacing, level);
      if (level == 0 || !placement.crosses_border) return std::move(placement.taps);
    }
  }

 private:
  /// Distances of neighbouring values in the image.
  struct Spacing {
    double across_px = 0.0;
    double down_px = 0.0;
  };
  struct Placement {
    Taps taps;
    /// True if a tap was moved radially because its pixels would have crossed the mirror's border.
    bool crosses_border = false;
  };

  [[nodiscard]] std::optional<PixelPoint> project_direction(double azimuth_rad,
                                                            double elevation_rad) const {
    return project(camera_, Direction3::from_angles(azimuth_rad, elevation_rad));
  }

  struct RadiusRange {
    double low_px, high_px;
  };

  /// Returns the distances from the centre at which all four pixels of a tap are entirely inside
  /// the mirror's ring. An inner radius of 0 sets no limit. `pixel`: pixel size of the level, in
  /// image pixels.
  [[nodiscard]] static RadiusRange compute_usable_radii(const ImageCircle& circle, double pixel) {
    const double reach_px = 1.5 * std::numbers::sqrt2 * pixel;
    const double inner_px = circle.inner_radius_px;
    const double middle_px = 0.5 * (inner_px + circle.rim_radius_px);
    return {inner_px > 0.0 ? std::min(inner_px + reach_px, middle_px) : 0.0,
            std::max(circle.rim_radius_px - reach_px, middle_px)};
  }

  /// Measures the mean distances between neighbouring values, over 32 azimuths; 0 if the camera
  /// sees none of them.
  [[nodiscard]] Spacing measure_spacing(double elevation_rad) const {
    Spacing sum;
    int across_count = 0;
    int down_count = 0;
    constexpr int probes = 32;
    for (int probe = 0; probe < probes; ++probe) {
      const double azimuth_rad = 2.0 * std::numbers::pi * probe / probes;
      const auto centre = project_direction(azimuth_rad, elevation_rad);
      if (!centre) continue;
      const auto neighbour = project_direction(azimuth_rad + column_rad_ / 2, elevation_rad);
      if (neighbour && are_in_one_picture(*centre, *neighbour)) {
        sum.across_px += 2.0 * distance_px(*centre, *neighbour);
        ++across_count;
      }
      for (const double half_rad : {row_rad_ / 2, -row_rad_ / 2}) {
        const auto below = project_direction(azimuth_rad, elevation_rad - half_rad);
        if (below && are_in_one_picture(*centre, *below)) {
          sum.down_px += 2.0 * distance_px(*centre, *below);
          ++down_count;
        }
      }
    }
    return {sum.across_px / std::max(1, across_count), sum.down_px / std::max(1, down_count)};
  }

  /// True if one camera of a rig took both points; always for other cameras.
  [[nodiscard]] bool are_in_one_picture(const PixelPoint& a, const PixelPoint& b) const {
    return !rig_ || tile_at(*rig_, a.u_px).camera == tile_at(*rig_, b.u_px).camera;
  }

  [[nodiscard]] Placement place_taps(double elevation_rad, const Spacing& spacing,
                                     int level) const {
    const double pixel = 1 << level;
    const int across = std::max(1, static_cast<int>(std::lround(spacing.across_px / pixel)));
    const int down = std::max(1, static_cast<int>(std::lround(spacing.down_px / pixel)));
    Placement placement;
    placement.taps.resize(static_cast<std::size_t>(across) * down * lens_count_ * columns_);
    const std::array<ImageCircle, 2> circles{image_circle(camera_, 0),
                                             image_circle(camera_, lens_count_ - 1)};
    auto tap = placement.taps.begin();
    for (int i = 0; i < down; ++i) {
      const double tap_elevation_rad = elevation_rad + row_rad_ * (0.5 - (i + 0.5) / down);
      for (int j = 0; j < across; ++j, tap += static_cast<std::ptrdiff_t>(lens_count_) * columns_) {
        for (int c = 0; c < columns_; ++c) {
          const double azimuth_rad = column_rad_ * (c + (j + 0.5) / across - 0.5);
          const auto points =
              project_all(camera_, Direction3::from_angles(azimuth_rad, tap_elevation_rad));
          // Rounds the running sum of both lenses' shares, so that their integer weights add up to
          // `tap_weight_sum`.
          double share = 0.0;
          int assigned = 0;
          for (int lens = 0; lens < lens_count_; ++lens) {
            if (!points[lens] || points[lens]->weight == 0.0) continue;
            share += points[lens]->weight * brightness_factors_[lens];
            const int sum =
                static_cast<int>(std::lround(share * kernels::tap_weight_sum)) - assigned;
            assigned += sum;
            Tap& placed = tap[static_cast<std::ptrdiff_t>(lens) * columns_ + c];
            placed =
                make_tap(points[lens]->pixel, sum, circles[lens], level, placement.crosses_border);
          }
          if (lens_count_ == 1) continue;
          // If only one lens sees the direction, the other lens gets a copy of its tap with weight
          // 0, so that all columns have the same number of taps.
          Tap& first = tap[c];
          Tap& second = tap[columns_ + c];
          if (first.is_visible() == second.is_visible()) continue;
          Tap& unseen = first.is_visible() ? second : first;
          unseen = first.is_visible() ? first : second;
          unseen.weights = 0;
        }
      }
    }
    return placement;
  }

  /// Moves a point radially to where all pixels of its tap show the mirror; true if it was moved.
  static bool move_into_ring(PixelPoint& point, const ImageCircle& circle, double pixel) {
    const RadiusRange range = compute_usable_radii(circle, pixel);
    const double radius_px = distance_px(point, circle.centre);
    const double usable_px = std::clamp(radius_px, range.low_px, range.high_px);
    if (usable_px == radius_px) return false;
    const double inward = usable_px / radius_px;
    point.u_px = circle.centre.u_px + inward * (point.u_px - circle.centre.u_px);
    point.v_px = circle.centre.v_px + inward * (point.v_px - circle.centre.v_px);
    return true;
  }

  [[nodiscard]] Tap make_tap(PixelPoint point, int sum, const ImageCircle& circle, int level,
                             bool& crosses_border) const {
    const double pixel = 1 << level;
    const auto tile = rig_ ? tile_at(*rig_, point.u_px) : RigModel::Tile{0, 0, camera_.image_size};
    // Pixels of the halved image that only show this tile.
    const int left = (tile.left_px + (1 << level) - 1) >> level;
    const int right = (tile.left_px + tile.size.width) >> level;
    const int bottom = tile.size.height >> level;
    if (!rig_) crosses_border |= move_into_ring(point, circle, pixel);
    const double u = std::clamp(point.u_px / pixel - 0.5, 1.0 * left, right - 1.0);
    const double v = std::clamp(point.v_px / pixel - 0.5, 0.0, bottom - 1.0);
    Tap tap;
    tap.level = level;
    tap.u = std::min(static_cast<int>(u), right - 2);
    tap.v = std::min(static_cast<int>(v), bottom - 2);
    tap.weights = pack_weights(u - tap.u, v - tap.v, sum);
    return tap;
  }

  const Camera& camera_;
  int columns_;
  double top_rad_, column_rad_, row_rad_;
  int lens_count_;
  const RigModel* rig_;  // null for other cameras
  std::array<double, 2> brightness_factors_{1.0, 1.0};
};

/// Replaces each invisible tap by the first visible tap of the same value (the taps of both lenses
/// together). Returns 1 for each column that has a visible tap.
std::vector<std::uint8_t> fill_missing_taps(Taps& taps, int columns, int lenses) {
  std::vector<std::uint8_t> visible(static_cast<std::size_t>(columns), 0);
  const int count = static_cast<int>(taps.size()) / columns;
  for (int c = 0; c < columns; ++c) {
    const auto tap = [&](int t) -> Tap& { return taps[static_cast<std::size_t>(t) * columns + c]; };
    int instead = 0;
    while (instead < count && !tap(instead).is_visible()) instead += lenses;
    if (instead == count) continue;
    visible[c] = 1;
    for (int t = 0; t < count; ++t) {
      if (!tap(t).is_visible()) tap(t) = tap(instead + t % lenses);
    }
  }
  return visible;
}

void copy_column(const Taps& from, int from_column, Taps& to, int to_column, int columns) {
  const std::size_t from_count = from.size() / columns;
  for (std::size_t t = 0; t < to.size() / columns; ++t) {
    to[t * columns + to_column] = from[t % from_count * columns + from_column];
  }
}

/// Finds the first index for which holds(index) is true, in the order start, start - 1, start + 1,
/// start - 2, ..
template <class Predicate>
std::optional<int> find_nearest_index(int start, int count, bool wraps, Predicate holds) {
  for (int distance = 0; distance < count; ++distance) {
    for (const int sign : {-1, 1}) {
      int index = start + sign * distance;
      if (wraps) index = (index + count) % count;
      if (index >= 0 && index < count && holds(index)) return index;
    }
  }
  return {};
}

/// Gives directions that the camera does not see the taps of the nearest visible row of the same
/// column, or of the nearest column with a visible row.
void fill_invisible_directions(std::vector<Taps>& rows,
                               const std::vector<std::vector<std::uint8_t>>& visible, int columns) {
  const int count = static_cast<int>(rows.size());
  std::vector<std::uint8_t> column_visible(static_cast<std::size_t>(columns), 0);
  for (const auto& row : visible) {
    for (int c = 0; c < columns; ++c) column_visible[c] |= row[c];
  }
  if (std::ranges::count(column_visible, 0) == columns) {
    throw ContractError("elevations", "out of sight", "a band of which the camera sees something");
  }
  const std::vector<Taps> original = rows;
  for (int y = 0; y < count; ++y) {
    // An invisible row gets as many taps per value as the visible row that is copied into it.
    if (std::ranges::count(visible[y], 0) == columns) {
      const auto like = find_nearest_index(
          y, count, false, [&](int row) { return std::ranges::count(visible[row], 0) < columns; });
      rows[y].assign(original[*like].size(), Tap{});
    }
    for (int c = 0; c < columns; ++c) {
      if (visible[y][c] != 0) continue;
      const int column = *find_nearest_index(c, columns, true,
                                             [&](int other) { return column_visible[other] != 0; });
      const int row = *find_nearest_index(y, count, false,
                                          [&](int other) { return visible[other][column] != 0; });
      copy_column(original[row], column, rows[y], c, columns);
    }
  }
}

/// Finds the part of each halved image that the taps need, and its offsets in the buffers.
void compute_level_layout(const std::vector<Taps>& rows, UnwarpTable& table) {
  int highest = 0;
  for (const Taps& taps : rows) {
    for (const Tap& tap : taps) highest = std::max(highest, tap.level);
  }
  table.levels.resize(static_cast<std::size_t>(highest) + 1);
  for (UnwarpTable::Level& level : table.levels) {
    level.left = level.top = level.pair_left = level.pair_top = std::numeric_limits<int>::max();
  }
  for (const Taps& taps : rows) {
    for (const Tap& tap : taps) {
      UnwarpTable::Level& level = table.levels[tap.level];
      level.pair_left = std::min(level.pair_left, tap.u);
      level.pair_top = std::min(level.pair_top, tap.v);
      level.pair_right = std::max(level.pair_right, tap.u + 2);
      level.pair_bottom = std::max(level.pair_bottom, tap.v + 1);  // a pair reaches one row further
    }
  }
  for (int i = highest; i >= 0; --i) {
    UnwarpTable::Level& level = table.levels[i];
    if (level.has_pairs()) {
      level.left = std::min(level.left, level.pair_left);
      level.top = std::min(level.top, level.pair_top);
      level.right = std::max(level.right, level.pair_right);
      level.bottom = std::max(level.bottom, level.pair_bottom + 1);
      level.pairs_offset = table.pairs_size;
      table.pairs_size += static_cast<std::size_t>(level.pair_right - level.pair_left) *
                          (level.pair_bottom - level.pair_top);
    }
    if (i == 0) break;
    level.halved_offset = table.halved_size;
    table.halved_size +=
        static_cast<std::size_t>(level.right - level.left) * (level.bottom - level.top);
    UnwarpTable::Level& finer = table.levels[static_cast<std::size_t>(i) - 1];
    finer.left = std::min(finer.left, 2 * level.left);
    finer.top = std::min(finer.top, 2 * level.top);
    finer.right = std::max(finer.right, 2 * level.right);
    finer.bottom = std::max(finer.bottom, 2 * level.bottom);
  }
}

}  // namespace

UnwarpTable make_unwarp_table(const Camera& camera, int rows, int columns,
                              const ElevationBand& band) {
  const RowSampler sampler(camera, rows, columns, band);
  std::vector<Taps> taps_of_rows;
  std::vector<std::vector<std::uint8_t>> visible;
  for (int y = 0; y < rows; ++y) {
    taps_of_rows.push_back(sampler.make_row_taps(y));
    visible.push_back(fill_missing_taps(taps_of_rows.back(), columns, lens_count(camera)));
  }
  fill_invisible_directions(taps_of_rows, visible, columns);

  UnwarpTable table;
  compute_level_layout(taps_of_rows, table);
  for (const Taps& taps : taps_of_rows) {
    table.rows.push_back({static_cast<int>(taps.size()) / columns, table.positions.size()});
    for (const Tap& tap : taps) {
      const UnwarpTable::Level& level = table.levels[tap.level];
      const auto width = static_cast<std::size_t>(level.pair_right - level.pair_left);
      table.positions.push_back(static_cast<std::uint32_t>(
          level.pairs_offset + (tap.v - level.pair_top) * width + (tap.u - level.pair_left)));
      table.weights.push_back(tap.weights);
    }
  }
  for (const auto& row : visible) table.visible.insert(table.visible.end(), row.begin(), row.end());
  return table;
}

}  // namespace panonav
