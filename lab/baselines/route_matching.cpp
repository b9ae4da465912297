// Rivals that find the place on the route: SeqSLAM, and homing from picture to picture by
// min-warping.

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>

#include "lab/baselines/route_rivals.hpp"
#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::lab {

namespace {

// Replaces each value by its deviation from the patch around it, 9 columns and 5 rows, in standard
// deviations of the patch.
std::vector<float> normalise_patches(std::span<const float> view) {
  constexpr int half_columns = 4;
  constexpr int half_rows = 2;
  constexpr int columns = HeadingScan::columns;
  std::vector<float> result(view.size());
  for (int y = 0; y < HeadingScan::rows; ++y) {
    for (int c = 0; c < columns; ++c) {
      float sum = 0.0F;
      float squares = 0.0F;
      int count = 0;
      for (int v = std::max(0, y - half_rows); v <= std::min(HeadingScan::rows - 1, y + half_rows);
           ++v) {
        for (int u = c - half_columns; u <= c + half_columns; ++u, ++count) {
          const float value = view[static_cast<std::size_t>(v * columns + (u + columns) % columns)];
          sum += value;
          squares += value * value;
        }
      }
      const float mean = sum / static_cast<float>(count);
      const float variance = squares / static_cast<float>(count) - mean * mean;
      const auto at = static_cast<std::size_t>(y * columns + c);
      // A patch without contrast would show noise alone.
      result[at] = variance > 1e-6F ? (view[at] - mean) / std::sqrt(variance) : 0.0F;
    }
  }
  return result;
}

float absolute_difference(const float* a, const float* b) {
  constexpr std::size_t lanes = 8;
  std::array<float, lanes> sums{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(HeadingScan::rows) * HeadingScan::columns;
       i += lanes) {
    for (std::size_t k = 0; k < lanes; ++k) sums[k] += std::abs(a[i + k] - b[i + k]);
  }
  float sum = 0.0F;
  for (const float each : sums) sum += each;
  return sum;
}

class SequenceMatching final : public RouteMethod {
 public:
  [[nodiscard]] std::string name() const override { return "SeqSLAM"; }

  void learn(std::span<const RoutePicture> pictures) override {
    require_route(pictures);
    templates_.clear();
    history_.clear();
    for (std::size_t i = 0; i < pictures.size(); i += kept_every) {
      const HeadingScan scan(pictures[i].panorama);
      templates_.push_back(normalise_patches(scan.view(HeadingScan::ahead)));
    }
  }

  [[nodiscard]] RouteDirection steer(const RoutePicture& picture) override {
    const HeadingScan scan(picture.panorama);
    std::vector<std::vector<float>> turned;
    for (int heading = 0; heading < HeadingScan::headings; ++heading) {
      turned.push_back(normalise_patches(scan.view(heading)));
    }
    std::vector<float> differences(templates_.size(), std::numeric_limits<float>::infinity());
    std::vector<int> headings(templates_.size(), HeadingScan::ahead);
    for (std::size_t i = 0; i < templates_.size(); ++i) {
      for (int heading = 0; heading < HeadingScan::headings; ++heading) {
        const float difference = absolute_difference(
            templates_[i].data(), turned[static_cast<std::size_t>(heading)].data());
        if (difference >= differences[i]) continue;
        differences[i] = difference;
        headings[i] = heading;
      }
    }
    history_.push_front(enhance_contrast(differences));
    if (history_.size() > sequence_length) history_.pop_back();
    const std::size_t place = find_sequence();
    return {.turn_rad = HeadingScan::turn_rad(headings[place]), .place = place * kept_every};
  }

  [[nodiscard]] double bytes() const override {
    return static_cast<double>(templates_.size()) * HeadingScan::rows * HeadingScan::columns;
  }

 private:
  static constexpr std::size_t kept_every = 3;
  static constexpr std::size_t sequence_length = 10;

  // Deviation of each difference from those of the templates around it [Milford and Wyeth 2012 eq.
  // 2].
  static std::vector<float> enhance_contrast(const std::vector<float>& differences) {
    constexpr std::size_t half_window = 5;
    std::vector<float> enhanced(differences.size());
    for (std::size_t i = 0; i < differences.size(); ++i) {
      const std::size_t begin = i - std::min(i, half_window);
      const std::size_t end = std::min(differences.size(), i + half_window + 1);
      double sum = 0.0;
      double squares = 0.0;
      for (std::size_t k = begin; k < end; ++k) {
        sum += differences[k];
        squares += static_cast<double>(differences[k]) * differences[k];
      }
      const auto count = static_cast<double>(end - begin);
      const double mean = sum / count;
      const double deviation = std::sqrt(std::max(0.0, squares / count - mean * mean));
      enhanced[i] =
          deviation > 0.0 ? static_cast<float>((differences[i] - mean) / deviation) : 0.0F;
    }
    return enhanced;
  }

  // Returns the last template of the sequence with the smallest sum, over speeds of 0.8 to 1.2.
  [[nodiscard]] std::size_t find_sequence() const {
    std::size_t best = 0;
    double min_sum = std::numeric_limits<double>::infinity();
    for (std::size_t end = 0; end < templates_.size(); ++end) {
      for (const double speed : {0.8, 0.9, 1.0, 1.1, 1.2}) {
        double sum = 0.0;
        for (std::size_t t = 0; t < history_.size(); ++t) {
          const auto back = static_cast<std::size_t>(std::lround(speed * static_cast<double>(t)));
          sum += history_[t][end - std::min(end, back)];
        }
        if (sum >= min_sum) continue;
        min_sum = sum;
        best = end;
      }
    }
    return best;
  }

  std::vector<std::vector<float>> templates_;
  std::deque<std::vector<float>> history_;  // enhanced differences, the latest first
};

// Relative sizes of a column seen from both places; the planes are a factor of 2^(1/3) apart.
constexpr int planes = 7;
double plane_scale(int plane) {
  return std::exp2((plane - planes / 2) / 3.0);
}

// Edges from row to row of one column; `scale` enlarges it about the horizon.
std::vector<float> column_edges(const Panorama& view, int column, double scale) {
  std::vector<float> values;
  for (int y = 0; y < view.rows(); ++y) {
    const double elevation = std::atan(std::tan(view.elevation_rad(y)) / scale);
    const double low = view.elevations()->bottom_rad;
    const double high = view.elevations()->top_rad;
    const double row = (high - elevation) / (high - low) * view.rows() - 0.5;
    const double inside = std::clamp(row, 0.0, view.rows() - 1.0);
    const int upper = std::min(static_cast<int>(inside), view.rows() - 2);
    const auto share = static_cast<float>(inside - upper);
    values.push_back((1.0F - share) * view.at(upper, column) + share * view.at(upper + 1, column));
  }
  for (std::size_t y = 0; y + 1 < values.size(); ++y) values[y] = values[y + 1] - values[y];
  values.pop_back();
  return values;
}

// Sum of absolute differences over the sum of both: 0 for equal columns, 1 for unrelated ones.
float column_difference(const std::vector<float>& a, const std::vector<float>& b) {
  float difference = 0.0F;
  float sum = 1e-3F;
  for (std::size_t y = 0; y < a.size(); ++y) {
    difference += std::abs(a[y] - b[y]);
    sum += std::abs(a[y]) + std::abs(b[y]);
  }
  return difference / sum;
}

// A bearing in the current view that a column may have, and the plane of its relative size.
struct Shift {
  int columns = 0;
  int plane = planes / 2;
};

// Returns the shifts of a column at `bearing` columns from the direction of the motion: things move
// towards the back, and their relative sizes follow from the law of sines.
std::vector<Shift> list_shifts(int bearing, int columns) {
  const double column_rad = 2.0 * std::numbers::pi / columns;
  const double from = wrap_angle(bearing * column_rad);
  const double side = from < 0.0 ? -1.0 : 1.0;
  // Straight ahead and behind things do not move.
  if (std::abs(std::sin(from)) < 1e-6) return {{0, planes / 2}};
  std::vector<Shift> shifts;
  constexpr int max_shift = 12;  // of 72 columns: 60 degrees
  for (int shift = 0; shift <= max_shift; ++shift) {
    const double to = std::abs(from) + shift * column_rad;
    if (to >= std::numbers::pi - 1e-6) break;
    const double scale = std::sin(to) / std::abs(std::sin(from));
    const int plane = static_cast<int>(std::lround(3.0 * std::log2(scale))) + planes / 2;
    if (plane < 0 || plane >= planes) continue;
    shifts.push_back({static_cast<int>(side) * shift, plane});
  }
  return shifts;
}

class MinWarping final : public RouteMethod {
 public:
  [[nodiscard]] std::string name() const override { return "min-warping"; }

  void learn(std::span<const RoutePicture> pictures) override {
    require_route(pictures);
    snapshots_.clear();
    constexpr std::size_t kept_every = 10;
    for (std::size_t i = 0; i < pictures.size(); i += kept_every) {
      snapshots_.push_back(shrink(pictures[i].panorama));
    }
    target_ = std::min<std::size_t>(1, snapshots_.size() - 1);
  }

  [[nodiscard]] RouteDirection steer(const RoutePicture& picture) override {
    const Panorama view = shrink(picture.panorama);
    Warp warp = compute_min_warp(snapshots_[target_], view);
    // Once the snapshot after the target fits better, the robot has passed the target.
    while (target_ + 1 < snapshots_.size()) {
      const Warp next = compute_min_warp(snapshots_[target_ + 1], view);
      if (next.cost >= warp.cost) break;
      warp = next;
      ++target_;
    }
    if (target_ + 1 < snapshots_.size() && is_near(warp)) {
      warp = compute_min_warp(snapshots_[++target_], view);
    }
    // Blocks of columns are centred half of the difference of both widths further left.
    const double centre_rad =
        std::numbers::pi * (1.0 / view.columns() - 1.0 / picture.panorama.columns());
    return {.turn_rad = wrap_angle(warp.home_rad + centre_rad), .place = target_};
  }

  [[nodiscard]] double bytes() const override {
    return static_cast<double>(snapshots_.size() * snapshots_.front().values().size());
  }

 private:
  static Panorama shrink(const Panorama& picture) {
    return shrink_panorama(picture, picture.rows(), HeadingScan::columns);
  }
  // The snapshot lies behind: the robot has passed it.
  static bool is_near(const Warp& warp) { return std::abs(warp.home_rad) > radians(100.0); }

  std::vector<Panorama> snapshots_;
  std::size_t target_ = 0;
};

}  // namespace

Warp compute_min_warp(const Panorama& snapshot, const Panorama& current) {
  const int columns = snapshot.columns();
  require(current.columns() == columns && current.rows() == snapshot.rows(), "columns",
          current.columns(), "the shape of the snapshot");
  require(snapshot.elevations().has_value() && snapshot.rows() >= 3, "rows", snapshot.rows(),
          ">= 3, of known elevations");
  // Differences of all pairs of columns, in each plane; current columns run backwards, twice, so
  // that those of growing turns are neighbours.
  const auto wide = 2 * static_cast<std::size_t>(columns);
  std::vector<std::vector<float>> seen;
  for (int c = 0; c < columns; ++c) seen.push_back(column_edges(current, c, 1.0));
  std::vector<float> differences(static_cast<std::size_t>(planes * columns) * wide);
  for (int plane = 0; plane < planes; ++plane) {
    for (int x = 0; x < columns; ++x) {
      const auto edges = column_edges(snapshot, x, plane_scale(plane));
      float* const row = differences.data() + static_cast<std::size_t>(plane * columns + x) * wide;
      for (int c = 0; c < columns; ++c) {
        const float difference = column_difference(edges, seen[static_cast<std::size_t>(c)]);
        row[columns - 1 - c] = difference;
        row[2 * columns - 1 - c] = difference;
      }
    }
  }
  std::vector<std::vector<Shift>> shifts;
  for (int b = 0; b < columns; ++b) shifts.push_back(list_shifts(b, columns));
  const int max_turn = columns / 6;
  std::vector<float> sums(static_cast<std::size_t>(2 * max_turn + 1));
  std::vector<float> minima(sums.size());
  Warp best{.cost = std::numeric_limits<double>::infinity()};
  for (int motion = 0; motion < columns; ++motion) {
    std::ranges::fill(sums, 0.0F);
    for (int bearing = 0; bearing < columns; ++bearing) {
      const int x = (motion + bearing) % columns;
      std::ranges::fill(minima, 1.0F);
      for (const Shift& shift : shifts[static_cast<std::size_t>(bearing)]) {
        // Column of the current view at turn -max_turn; each further turn moves it one back.
        const int first = (x + shift.columns + max_turn + columns) % columns;
        const float* const from = differences.data() +
                                  static_cast<std::size_t>(shift.plane * columns + x) * wide +
                                  (columns - 1 - first);
        for (std::size_t i = 0; i < minima.size(); ++i) minima[i] = std::min(minima[i], from[i]);
      }
      for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += minima[i];
    }
    const auto smallest = std::ranges::min_element(sums);
    if (*smallest / static_cast<float>(columns) >= best.cost) continue;
    const double column_rad = 2.0 * std::numbers::pi / columns;
    best.cost = *smallest / static_cast<float>(columns);
    best.turn_rad = column_rad * (static_cast<double>(smallest - sums.begin()) - max_turn);
    best.home_rad = wrap_angle(motion * column_rad + std::numbers::pi - best.turn_rad);
  }
  return best;
}

std::unique_ptr<RouteMethod> make_sequence_matching() {
  return std::make_unique<SequenceMatching>();
}
std::unique_ptr<RouteMethod> make_min_warping() {
  return std::make_unique<MinWarping>();
}

}  // namespace panonav::lab
