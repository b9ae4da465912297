#include "panonav/navigation/floor_scanner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

constexpr double full_turn_rad = 2.0 * std::numbers::pi;

// Smallest distance between stored pictures.
constexpr double min_spacing_m = 0.02;
// Distance from a picture within which its floor is learnt: from where a patch appears in front of
// the robot to where the robot is over it.
constexpr double max_learning_distance_m = 1.0;
// Pictures that are stored, for more than `max_learning_distance_m` of path at 3 cm.
constexpr std::size_t max_frames = 40;
// Patches of the floor that are stored, for some metres of path.
constexpr std::size_t max_floor_patches = 600;
// Patches that must have been compared with earlier ones before patches count as other than floor.
constexpr std::size_t min_compared_patches = 100;
// Distances of the pictures that are compared with the last one: the nearest matches what moves
// much in the picture, the farthest what moves little.
constexpr std::array baselines_m{0.05, 0.12, 0.25};
// Ratio of the distances of successive surfaces: about a row of the panorama for 25 cm of travel.
constexpr double distance_ratio = 1.07;
// Entries of the table of rows for a slope of 1, and the largest slope.
constexpr double rows_per_slope = 200.0;
constexpr double max_slope = 3.0;

// Smallest sum of log-likelihood ratios of a surface (chosen on variants of the scene lab: 3 finds
// hardly more of the near obstacles, and twice as many where there are none).
constexpr double min_surface_evidence = 5.0;
// Log-likelihood ratio from which a patch moves like the floor.
constexpr double min_floor_evidence = 0.3;
// Share of log-likelihood that a value counts, as neighbouring values of a patch are not
// independent.
constexpr double independent_share = 0.25;
// Largest squared normal deviate of a difference, beyond which it is an outlier.
constexpr float max_squared_deviate = 9.0F;
// Deviation of a position in the picture, in rows or columns, by the motion and by interpolation.
constexpr float position_deviation = 0.3F;
// Quantile of the distances between patches that the robot drove over, and the factor of it beyond
// which a patch is no floor: the light on floor that it did not drive over differs more.
constexpr double floor_quantile = 0.97;
constexpr double floor_distance_factor = 3.0;
// Successive patches without the appearance of the floor at which it ends; with two, twice as many
// alarms on variants of the scene lab, and hardly an obstacle more.
constexpr int min_other_patches = 3;

std::size_t index(int row, int column) {
  return static_cast<std::size_t>(row) * FloorScanner::columns + static_cast<std::size_t>(column);
}

int wrap_column(int column) {
  return (column + FloorScanner::columns) % FloorScanner::columns;
}

// Subtracts the mean of the surrounding 9 x 9 values, so that exposure and vignetting cancel.
std::vector<float> subtract_local_mean(const Panorama& view) {
  constexpr int half = 4;
  std::vector<float> row_sums(view.values().size());
  for (int y = 0; y < view.rows(); ++y) {
    float sum = 0.0F;
    for (int x = -half; x <= half; ++x) sum += view.at(y, wrap_column(x));
    for (int x = 0; x < view.columns(); ++x) {
      row_sums[index(y, x)] = sum;
      sum += view.at(y, wrap_column(x + half + 1)) - view.at(y, wrap_column(x - half));
    }
  }
  std::vector<float> values(view.values().begin(), view.values().end());
  for (int y = 0; y < view.rows(); ++y) {
    const int first = std::max(0, y - half);
    const int last = std::min(view.rows() - 1, y + half);
    const auto count = static_cast<float>((2 * half + 1) * (last - first + 1));
    for (int x = 0; x < view.columns(); ++x) {
      float sum = 0.0F;
      for (int i = first; i <= last; ++i) sum += row_sums[index(i, x)];
      values[index(y, x)] -= sum / count;
    }
  }
  return values;
}

// Returns the squared gradients of values, per row and column.
std::vector<float> compute_squared_gradients(const std::vector<float>& values) {
  std::vector<float> gradients(values.size());
  for (int y = 0; y < FloorScanner::rows; ++y) {
    const int above = std::max(0, y - 1);
    const int below = std::min(FloorScanner::rows - 1, y + 1);
    for (int x = 0; x < FloorScanner::columns; ++x) {
      const float down = 0.5F * (values[index(below, x)] - values[index(above, x)]);
      const float across =
          0.5F * (values[index(y, wrap_column(x + 1))] - values[index(y, wrap_column(x - 1))]);
      gradients[index(y, x)] = down * down + across * across;
    }
  }
  return gradients;
}

}  // namespace

double FloorScan::azimuth_rad(std::size_t sector) const noexcept {
  return wrap_angle(full_turn_rad * static_cast<double>(sector) /
                    static_cast<double>(range_m.size()));
}

FloorScanner::FloorScanner(const FloorScannerOptions& options) : options_(options) {
  require(options.camera_height_m > 0.0, "camera_height_m", options.camera_height_m, "> 0");
  require(options.robot_radius_m > 0.0, "robot_radius_m", options.robot_radius_m, "> 0");
  require(options.max_range_m > min_range_m, "max_range_m", options.max_range_m,
          "> " + to_text(min_range_m));
  for (double m = min_range_m; m < options.max_range_m; m *= distance_ratio)
    distances_m_.push_back(m);
}

void FloorScanner::set_elevations(const ElevationBand& elevations) {
  elevations_ = elevations;
  const double row_rad = (elevations.top_rad - elevations.bottom_rad) / rows;
  for (int y = 0; y < rows; ++y)
    slopes_.push_back(std::tan(elevations.top_rad - (y + 0.5) * row_rad));
  for (int i = 0; i <= max_slope * rows_per_slope; ++i) {
    row_by_slope_.push_back((elevations.top_rad + std::atan(i / rows_per_slope)) / row_rad - 0.5);
  }
}

// Returns the row of a slope <= 0, or a row below the picture.
double FloorScanner::row_at_slope(double slope) const noexcept {
  const double at = -slope * rows_per_slope;
  if (!(at < max_slope * rows_per_slope)) return rows;
  const auto i = static_cast<std::size_t>(at);
  const double share = at - static_cast<double>(i);
  return (1.0 - share) * row_by_slope_[i] + share * row_by_slope_[i + 1];
}

// Interpolates bilinearly; `row` is at most the last one.
float FloorScanner::sample(const Frame& frame, double row, double column) noexcept {
  row = std::max(row, 0.0);
  const int y = std::min(static_cast<int>(row), rows - 2);
  const double left = std::floor(column);
  const auto down = static_cast<float>(row - y);
  const auto across = static_cast<float>(column - left);
  const int x = ((static_cast<int>(left) % columns) + columns) % columns;
  const int next = x + 1 == columns ? 0 : x + 1;
  const float* const a = frame.values.data() + static_cast<std::ptrdiff_t>(y) * columns;
  const float* const b = a + columns;
  return (1.0F - down) * ((1.0F - across) * a[x] + across * a[next]) +
         down * ((1.0F - across) * b[x] + across * b[next]);
}

void FloorScanner::add(const Panorama& view, const Pose2& moved) {
  if (view.rows() != rows || view.columns() != columns) {
    throw ContractError("panorama of the floor",
                        std::to_string(view.rows()) + " x " + std::to_string(view.columns()),
                        std::to_string(rows) + " x " + std::to_string(columns));
  }
  if (!view.elevations() || view.elevations()->top_rad > 0.0 ||
      (elevations_ && !(*elevations_ == *view.elevations()))) {
    throw ContractError("elevations of the floor", "others",
                        "below the horizon, those of the first picture");
  }
  if (!elevations_) set_elevations(*view.elevations());
  Frame frame{.values = subtract_local_mean(view)};
  frame.path_from_robot = frames_.empty() ? Pose2{} : frames_.back().path_from_robot * moved;
  for (int band = 0; band < bands; ++band) {
    for (int sector = 0; sector < sectors; ++sector) {
      float sum = 0.0F;
      float squares = 0.0F;
      for (int y = 0; y < patch_size; ++y) {
        for (int x = 0; x < patch_size; ++x) {
          const int column = wrap_column(sector * patch_size + x - patch_size / 2);
          const float value = view.at(band * patch_size + y, column);
          sum += value;
          squares += value * value;
        }
      }
      constexpr float count = patch_size * patch_size;
      constexpr float noise = 0.005F;  // contrast of a patch without texture
      const float mean = sum / count;
      const float contrast = std::sqrt(std::max(0.0F, squares / count - mean * mean));
      frame.patches.push_back({mean, std::log(contrast + noise)});
    }
  }
  const bool replaces =
      frames_.size() > 1 && distance(frames_[frames_.size() - 2].path_from_robot.position(),
                                     frame.path_from_robot.position()) < min_spacing_m;
  if (replaces) frames_.pop_back();
  frames_.push_back(std::move(frame));
  if (frames_.size() > max_frames) frames_.pop_front();
  learn_floor();
}

// Learns the patches of earlier pictures over which the robot is now.
void FloorScanner::learn_floor() {
  const Pose2 here = frames_.back().path_from_robot;
  for (Frame& frame : frames_) {
    const Pose2 there = inverse(frame.path_from_robot) * here;
    const double away_m = std::hypot(there.x_m, there.y_m);
    if (away_m > max_learning_distance_m) continue;
    for (int band = 0; band < bands; ++band) {
      const double range_m =
          -options_.camera_height_m / slopes_[band * patch_size + patch_size / 2];
      if (std::abs(range_m - away_m) > options_.robot_radius_m) continue;
      for (int sector = 0; sector < sectors; ++sector) {
        Patch& patch = frame.patches[static_cast<std::size_t>(band * sectors + sector)];
        const double azimuth_rad = full_turn_rad * sector / sectors;
        const Point2 position{range_m * std::cos(azimuth_rad), range_m * std::sin(azimuth_rad)};
        if (patch.is_learnt || distance(position, there.position()) > options_.robot_radius_m)
          continue;
        patch.is_learnt = true;
        if (floor_.size() > min_compared_patches) {
          floor_distances_.push_back(distance_to_floor(patch));
          if (floor_distances_.size() > max_floor_patches) floor_distances_.pop_front();
        }
        floor_.push_back(patch);
        if (floor_.size() > max_floor_patches) floor_.pop_front();
      }
    }
  }
}

// Returns the distance of a patch to the most similar one that the robot drove over.
double FloorScanner::distance_to_floor(const Patch& patch) const {
  constexpr float brightness_scale = 0.02F;  // 5 grey levels
  constexpr float contrast_scale = 0.4F;     // factor 1.5
  float nearest = std::numeric_limits<float>::infinity();
  for (const Patch& floor : floor_) {
    const float brightness = (patch.brightness - floor.brightness) / brightness_scale;
    const float contrast = (patch.log_contrast - floor.log_contrast) / contrast_scale;
    nearest = std::min(nearest, brightness * brightness + contrast * contrast);
  }
  return std::sqrt(nearest);
}

// Returns the distance beyond which a patch is no floor; infinity before enough is learnt.
double FloorScanner::floor_limit() const {
  if (floor_distances_.size() < min_compared_patches)
    return std::numeric_limits<double>::infinity();
  std::vector<double> sorted(floor_distances_.begin(), floor_distances_.end());
  const auto at = sorted.begin() +
                  static_cast<std::ptrdiff_t>(floor_quantile * static_cast<double>(sorted.size()));
  std::ranges::nth_element(sorted, at);
  return floor_distance_factor * std::max(1.0, *at);
}

std::vector<const FloorScanner::Frame*> FloorScanner::select_references() const {
  std::vector<const Frame*> references;
  const Point2 here = frames_.back().path_from_robot.position();
  for (const double baseline_m : baselines_m) {
    const Frame* nearest = nullptr;
    double nearest_m = 0.5 * baseline_m;
    for (const Frame& frame : frames_) {
      const double off_m = std::abs(distance(frame.path_from_robot.position(), here) - baseline_m);
      if (off_m > nearest_m) continue;
      nearest = &frame;
      nearest_m = off_m;
    }
    if (nearest != nullptr && std::ranges::find(references, nearest) == references.end())
      references.push_back(nearest);
  }
  return references;
}

// Corrects the rotation by odometry, which errs by more than a column, such that the floor of both
// pictures agrees.
FloorScanner::Alignment FloorScanner::align(const Frame& reference) const {
  constexpr int tried = 17;
  constexpr double step_columns = 0.75;
  constexpr double max_distance_m = 6.0;
  constexpr float max_difference = 0.1F;
  const Frame& frame = frames_.back();
  const Pose2 odometry = inverse(reference.path_from_robot) * frame.path_from_robot;
  std::array<double, tried> costs{};
  std::array<std::vector<float>, tried> differences;
  for (int y = 1; y < rows; y += 2) {
    const double m = -options_.camera_height_m / slopes_[y];
    if (m > max_distance_m) continue;
    for (int x = 0; x < columns; x += 2) {
      const double azimuth_rad = full_turn_rad * x / columns;
      const Pose2 seen =
          odometry * Pose2{m * std::cos(azimuth_rad), m * std::sin(azimuth_rad), 0.0};
      const double row = row_at_slope(-options_.camera_height_m / std::hypot(seen.x_m, seen.y_m));
      if (row > rows - 1) continue;
      const double column = std::atan2(seen.y_m, seen.x_m) * columns / full_turn_rad;
      const float value = frame.values[index(y, x)];
      for (int i = 0; i < tried; ++i) {
        const float difference =
            std::abs(value - sample(reference, row, column + step_columns * (i - tried / 2)));
        costs[i] += std::min(difference, max_difference);
        differences[i].push_back(difference);
      }
    }
  }
  const auto best = static_cast<std::size_t>(std::ranges::min_element(costs) - costs.begin());
  double shift = static_cast<double>(best) - tried / 2;
  if (best > 0 && best + 1 < costs.size()) {
    const double before = costs[best - 1] - costs[best];
    const double after = costs[best + 1] - costs[best];
    if (before + after > 0.0) shift += 0.5 * (before - after) / (before + after);
  }
  auto& sorted = differences[best];
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  if (sorted.empty()) return {odometry, 1.0};
  std::ranges::nth_element(sorted, middle);
  constexpr double min_noise = 0.004;               // a grey level
  constexpr double deviation_over_median = 1.4826;  // of absolute normal deviates
  return {Pose2{0.0, 0.0, shift * step_columns * full_turn_rad / columns} * odometry,
          std::max(min_noise, deviation_over_median * static_cast<double>(*middle))};
}

void FloorScanner::add_evidence(const Frame& reference, const std::vector<float>& gradients,
                                double weight, Evidence& evidence) const {
  const Frame& frame = frames_.back();
  const Alignment alignment = align(reference);
  const Pose2 pose = alignment.reference_from_robot;
  const double noise = alignment.noise;
  const auto noise2 = static_cast<float>(noise * noise);
  const auto compare = [&](int y, int x, double row, double column) {
    const float difference = frame.values[index(y, x)] - sample(reference, row, column);
    const float variance =
        noise2 + position_deviation * position_deviation * gradients[index(y, x)];
    return std::min(difference * difference / variance, max_squared_deviate);
  };
  for (int x = 0; x < columns; ++x) {
    const double azimuth_rad = full_turn_rad * x / columns;
    const std::size_t sector = (x + patch_size / 2) / patch_size % sectors;
    const auto see = [&, c = std::cos(azimuth_rad), s = std::sin(azimuth_rad)](double m) {
      const Pose2 seen = pose * Pose2{m * c, m * s, 0.0};
      return std::pair(m / std::hypot(seen.x_m, seen.y_m),
                       std::atan2(seen.y_m, seen.x_m) * columns / full_turn_rad);
    };
    std::array<float, rows> floor_costs{};
    std::array<bool, rows> is_seen{};
    for (int y = 0; y < rows; ++y) {
      const auto [ratio, column] = see(-options_.camera_height_m / slopes_[y]);
      const double row = row_at_slope(slopes_[y] * ratio);
      is_seen[y] = row <= rows - 1;
      if (is_seen[y]) floor_costs[y] = compare(y, x, row, column);
    }
    for (std::size_t k = 0; k < distances_m_.size(); ++k) {
      const auto [ratio, column] = see(distances_m_[k]);
      for (int y = 0; y < rows; ++y) {
        if (slopes_[y] * distances_m_[k] <= -options_.camera_height_m) break;  // below its base
        const double row = row_at_slope(slopes_[y] * ratio);
        if (!is_seen[y] || row > rows - 1) continue;
        evidence.of_surface[k][static_cast<std::size_t>(y / patch_size) * sectors + sector] +=
            weight * static_cast<double>(floor_costs[y] - compare(y, x, row, column));
      }
    }
  }
}

FloorScanner::Evidence FloorScanner::collect_evidence(
    const std::vector<const Frame*>& references) const {
  const std::vector<double> none(std::size_t{bands} * sectors, 0.0);
  Evidence evidence{std::vector(distances_m_.size(), none), none, none};
  const auto gradients = compute_squared_gradients(frames_.back().values);
  for (const Frame* const reference : references) {
    add_evidence(*reference, gradients,
                 independent_share / (2.0 * static_cast<double>(references.size())), evidence);
  }
  // Just above its base, a surface moves like the floor.
  const double min_height_m = 0.2 * options_.camera_height_m;
  for (std::size_t i = 0; i < none.size(); ++i) {
    const double slope = slopes_[i / sectors * patch_size + patch_size / 2];
    double largest = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < distances_m_.size(); ++k) {
      const double ratio = evidence.of_surface[k][i];
      evidence.of_best[i] = std::max(evidence.of_best[i], ratio);
      if (options_.camera_height_m + slope * distances_m_[k] >= min_height_m)
        largest = std::max(largest, ratio);
    }
    if (std::isfinite(largest)) evidence.of_floor[i] = -largest;
  }
  return evidence;
}

// Returns the distance of the nearest surface; the range if there is none.
double FloorScanner::find_surface_m(const Evidence& evidence, int sector) const {
  std::vector<double> scores(distances_m_.size(), 0.0);
  for (std::size_t k = 0; k < scores.size(); ++k) {
    double sum = 0.0;
    for (int band = 0; band < bands; ++band) {
      const auto i = static_cast<std::size_t>(band * sectors + sector);
      // A better surface elsewhere counts against this one as it counts for the other.
      const double ratio = 2.0 * evidence.of_surface[k][i] - evidence.of_best[i];
      sum = std::max(0.0, sum + ratio);
      scores[k] = std::max(scores[k], sum);
    }
  }
  for (std::size_t k = 0; k < scores.size(); ++k) {
    const bool is_peak = k + 1 == scores.size() || scores[k + 1] <= scores[k];
    if (is_peak && scores[k] >= min_surface_evidence) return distances_m_[k];
  }
  return options_.max_range_m;
}

// Returns the distance at which the appearance of the floor ends; the range if it does not, nullopt
// if fewer than half of the patches up to there look or move like the floor.
std::optional<double> FloorScanner::find_end_of_floor_m(const Evidence& evidence, double limit,
                                                        int sector) const {
  const bool is_appearance_known = std::isfinite(limit);
  int patches = 0;
  int floor_patches = 0;
  int others = 0;
  for (int band = bands - 1; band >= 0; --band) {
    const double near_m = -options_.camera_height_m / slopes_[(band + 1) * patch_size - 1];
    if (near_m >= options_.max_range_m) break;
    const auto i = static_cast<std::size_t>(band * sectors + sector);
    const bool is_floor =
        evidence.of_floor[i] > min_floor_evidence ||
        (is_appearance_known && distance_to_floor(frames_.back().patches[i]) <= limit);
    ++patches;
    floor_patches += is_floor ? 1 : 0;
    others = is_floor || !is_appearance_known ? 0 : others + 1;
    if (others < min_other_patches) continue;
    return -options_.camera_height_m / slopes_[(band + min_other_patches) * patch_size - 1];
  }
  if (2 * floor_patches < patches) return std::nullopt;
  return options_.max_range_m;
}

FloorScan FloorScanner::scan() const {
  FloorScan scan{std::vector<std::optional<double>>(sectors), options_.max_range_m};
  if (frames_.empty()) return scan;
  const auto references = select_references();
  const double limit = floor_limit();
  const Evidence evidence = collect_evidence(references);
  for (int sector = 0; sector < sectors; ++sector) {
    const double surface_m = find_surface_m(evidence, sector);
    auto range_m = find_end_of_floor_m(evidence, limit, sector);
    if (surface_m < options_.max_range_m)
      range_m = std::min(surface_m, range_m.value_or(surface_m));
    scan.range_m[static_cast<std::size_t>(sector)] = range_m;
  }
  return scan;
}

}  // namespace panonav
