#include "panonav/camera/calibrate_dual_fisheye.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/camera/internal/circle_search.hpp"
#include "panonav/camera/internal/edge_field.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/least_squares.hpp"

namespace panonav {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// How the camera stood when a picture was taken, against the first picture's vertical axis.
struct Stand {
  double yaw_rad = 0.0, roll_rad = 0.0, pitch_rad = 0.0;
};
struct State {
  std::array<FisheyeLens, 2> lenses;
  std::vector<Stand> stands;
};

// Parameters of a lens in the vector of unknowns, then three of each picture.
constexpr int lens_size = 8;
constexpr int stand_size = 3;
int lens_at(int lens) {
  return lens * lens_size;
}
int stand_at(int picture) {
  return 2 * lens_size + picture * stand_size;
}

void add_to(FisheyeLens& lens, int parameter, double change) {
  switch (parameter) {
    case 0:
      lens.centre_u_px += change;
      break;
    case 1:
      lens.centre_v_px += change;
      break;
    case 2:
      lens.focal_length_px *= std::exp(change);
      break;
    case 3:
      lens.k3 += change;
      break;
    case 4:
      lens.k5 += change;
      break;
    case 5:
      lens.azimuth_rad += change;
      break;
    case 6:
      lens.elevation_rad += change;
      break;
    default:
      lens.roll_rad += change;
  }
}
void add_to(Stand& stand, int parameter, double change) {
  (parameter == 0 ? stand.yaw_rad : parameter == 1 ? stand.roll_rad : stand.pitch_rad) += change;
}
State moved(State state, const VectorXd& change) {
  for (int lens = 0; lens < 2; ++lens) {
    for (int i = 0; i < lens_size; ++i) add_to(state.lenses[lens], i, change[lens_at(lens) + i]);
  }
  for (int p = 0; p < static_cast<int>(state.stands.size()); ++p) {
    for (int i = 0; i < stand_size; ++i) add_to(state.stands[p], i, change[stand_at(p) + i]);
  }
  return state;
}

Matrix3d world_from_rig(const Stand& stand) {
  return (Eigen::AngleAxisd(stand.yaw_rad, Vector3d::UnitZ()) *
          Eigen::AngleAxisd(stand.pitch_rad, Vector3d::UnitY()) *
          Eigen::AngleAxisd(stand.roll_rad, Vector3d::UnitX()))
      .toRotationMatrix();
}
Matrix3d rig_from_lens(const FisheyeLens& lens) {
  const LensRotation rotation(lens);
  Matrix3d matrix;
  for (int i = 0; i < 3; ++i) {
    const auto axis =
        rotation.robot_from_lens({i == 0 ? 1.0 : 0.0, i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0});
    matrix.col(i) = Vector3d(axis.x, axis.y, axis.z);
  }
  return matrix;
}

/// One lens in one picture, ready for many rays.
struct Stance {
  Stance(const FisheyeLens& of_lens, const Stand& stand)
      : lens(of_lens), world_from_lens(world_from_rig(stand) * rig_from_lens(of_lens)) {
    // What other parameters see beyond the circle still has a slope.
    lens.max_angle_rad = std::min(std::numbers::pi, 1.1 * lens.max_angle_rad);
  }
  FisheyeLens lens;
  Matrix3d world_from_lens;
};

/// The light of one picture, smoothed to a distance of values.
struct Plane {
  int reduction = 1, width = 0, height = 0;
  const std::vector<float>* values = nullptr;
};

/// One lens in one picture as it is believed to stand.
class View {
 public:
  View(const State& state, int picture, int lens, const Plane& plane, double side)
      : lens_(state.lenses[lens]),
        lens_from_world_(
            (world_from_rig(state.stands[picture]) * rig_from_lens(lens_)).transpose()),
        plane_(plane),
        side_(side) {}

  /// Where the lens sees a direction of the world (image pixels); empty beyond its field of view.
  [[nodiscard]] std::optional<Vector2d> pixel(const Vector3d& in_world) const {
    const Vector3d d = lens_from_world_ * in_world;
    const auto point = project(lens_, {d.x(), d.y(), d.z()});
    if (!point) return std::nullopt;
    return Vector2d(lens_.centre_u_px + side_ * point->right_px, lens_.centre_v_px - point->up_px);
  }
  /// Its grey level there; negative: not seen.
  [[nodiscard]] float value(const Vector3d& in_world) const {
    const auto at = pixel(in_world);
    if (!at) return -1.0F;
    const double u = at->x() / plane_.reduction - 0.5;
    const double v = at->y() / plane_.reduction - 0.5;
    if (!(u >= 0 && v >= 0 && u < plane_.width - 1 && v < plane_.height - 1)) return -1.0F;
    const auto u0 = static_cast<std::size_t>(u);
    const auto v0 = static_cast<std::size_t>(v);
    const auto a = static_cast<float>(u - static_cast<double>(u0));
    const auto b = static_cast<float>(v - static_cast<double>(v0));
    const float* here = plane_.values->data() + v0 * static_cast<std::size_t>(plane_.width) + u0;
    const float* below = here + plane_.width;
    return (1 - b) * ((1 - a) * here[0] + a * here[1]) + b * ((1 - a) * below[0] + a * below[1]);
  }

 private:
  FisheyeLens lens_;
  Matrix3d lens_from_world_;
  Plane plane_;
  double side_;
};

/// Parts of the sphere: errors within one, such as those of near things, may have a cause in
/// common.
constexpr int sectors = 24;
constexpr int regions = 4 * sectors;

struct Seen {
  int picture = 0, lens = 0;
  Vector2d pixel;
  [[nodiscard]] int view() const { return 2 * picture + lens; }
};
/// The same thing of the world seen by two lenses, or by one in two pictures.
struct Match {
  std::array<Seen, 2> seen;
  Vector3d east, north;      ///< across the direction
  Eigen::Matrix2d whitener;  ///< 1 across the patch's edges, less along them
  double off_steps = 0.0;    ///< from where the state before expected it
  double log_gain = 0.0;     ///< of the second against the first
  int region = 0;
};

/// Patches are 15 x 15 values; at the finest level about 5 degrees in pictures of 1280 x 640.
constexpr int reach = 7;
constexpr int side_length = 2 * reach + 1;
/// Weaker patches are noise: 8-bit rounding, and what is left of a sensor's noise after smoothing.
constexpr double min_contrast = 3.0;
constexpr double min_correlation = 0.7;

struct Patch {
  int half = 0;
  std::vector<float> values;  ///< negative: not seen
  [[nodiscard]] float at(int x, int y) const {
    return values[static_cast<std::size_t>(y + half) * static_cast<std::size_t>(2 * half + 1) +
                  static_cast<std::size_t>(x + half)];
  }
};
Patch cut(const View& view, const Vector3d& middle, const Vector3d& east, const Vector3d& north,
          double step_rad, int half) {
  Patch patch{half, {}};
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) {
      patch.values.push_back(view.value(middle + step_rad * (x * east + y * north)));
    }
  }
  return patch;
}

struct Correlation {
  double value = -1.0;
  double log_gain = 0.0;
};
Correlation correlate(const Patch& a, const Patch& b, int dx, int dy) {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const double p = a.at(x, y);
      const double q = b.at(x + dx, y + dy);
      if (p < 0 || q < 0) continue;
      n += 1;
      sa += p;
      sb += q;
      saa += p * p;
      sbb += q * q;
      sab += p * q;
    }
  }
  if (n < 0.5 * side_length * side_length) return {};
  const double va = saa - sa * sa / n;
  const double vb = sbb - sb * sb / n;
  if (!(va > 0 && vb > 0.25 * min_contrast * min_contrast * n)) return {};
  return {(sab - sa * sb / n) / std::sqrt(va * vb),
          std::log(std::max(sb, 1.0) / std::max(sa, 1.0))};
}

/// Contrast across edges and along them; empty where there is too little of it.
std::optional<Eigen::Matrix2d> whitener_of(const Patch& patch) {
  double n = 0, sum = 0, squares = 0;
  Eigen::Matrix2d tensor = Eigen::Matrix2d::Zero();
  for (int y = -reach; y <= reach; ++y) {
    for (int x = -reach; x <= reach; ++x) {
      const double here = patch.at(x, y);
      if (here < 0) continue;
      n += 1;
      sum += here;
      squares += here * here;
      if (x == reach || y == reach || patch.at(x + 1, y) < 0 || patch.at(x, y + 1) < 0) continue;
      const Vector2d slope(patch.at(x + 1, y) - here, patch.at(x, y + 1) - here);
      tensor += slope * slope.transpose();
    }
  }
  if (n < 0.5 * side_length * side_length) return std::nullopt;
  if (squares - sum * sum / n < min_contrast * min_contrast * n) return std::nullopt;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
  solver.computeDirect(tensor);
  const double most = solver.eigenvalues()[1];
  if (!(most > 0)) return std::nullopt;
  const Vector2d roots(std::sqrt(std::max(0.0, solver.eigenvalues()[0] / most)), 1.0);
  const Eigen::Matrix2d axes = solver.eigenvectors();
  return Eigen::Matrix2d(axes * roots.asDiagonal() * axes.transpose());
}

struct Matching {
  std::vector<Match> matches;
  int textured = 0;
  /// Matches within one step of where they were expected, of all that is textured.
  [[nodiscard]] int near() const {
    return static_cast<int>(
        std::ranges::count_if(matches, [](const Match& match) { return match.off_steps <= 1.0; }));
  }
};

class Calibrator {
 public:
  Calibrator(std::span<const ImageView> pictures, const DualFisheyeKnowledge& known,
             Executor& executor)
      : pictures_(pictures), known_(known), executor_(executor) {
    side_ = known.direction == ColumnDirection::clockwise ? 1.0 : -1.0;
  }

  std::variant<DualFisheyeCalibration, DualFisheyeRefusal> run();

 private:
  /// The circles of the lenses in all pictures; empty when a half shows none.
  [[nodiscard]] std::optional<std::array<FieldCircle, 2>> find_circles() const;
  [[nodiscard]] State start(double field_of_view_rad) const;
  void find_turns(State& state) const;
  /// Values about `step_rad` apart; computed once for each reduction.
  const std::vector<SmoothPlanes>& planes(int reduction);
  [[nodiscard]] Matching match(const State& state, double step_rad, int search, int directions);
  [[nodiscard]] State state() const { return moved(prior_, offset_); }
  [[nodiscard]] Vector3d ray(const Stance& stance, const Vector2d& pixel) const;
  /// Of both lenses in all pictures.
  [[nodiscard]] std::vector<Stance> stances(const State& state) const;
  [[nodiscard]] Vector2d residual(const std::vector<Stance>& stances, const Match& match) const;
  /// Information of the matches about all parameters; `right`: where the cost falls.
  [[nodiscard]] MatrixXd normal(const State& state, const std::vector<Match>& matches,
                                VectorXd& right) const;
  [[nodiscard]] double cost(const VectorXd& offset, const std::vector<Match>& matches) const;
  class Problem;
  void solve(const std::vector<Match>& matches);
  /// Ends the lenses at their circles; false where the radius does not grow up to there.
  [[nodiscard]] bool close_lenses();
  /// Of all parameters, with what residuals of one region have in common (White's sandwich with
  /// clusters).
  [[nodiscard]] MatrixXd covariance(const std::vector<Match>& matches) const;
  [[nodiscard]] double azimuth_deviation(const Camera& camera, const MatrixXd& covariance) const;

  std::span<const ImageView> pictures_;
  DualFisheyeKnowledge known_;
  Executor& executor_;
  double side_ = 1.0;
  std::array<FieldCircle, 2> circles_;
  State prior_;
  VectorXd offset_;  ///< of all parameters from the prior's
  VectorXd prior_information_;
  double deviation_rad_ = 0.01;  ///< of a match
  double fine_rad_ = 0.0;        ///< about a pixel
  std::vector<Image> grey_;
  std::vector<std::pair<int, std::vector<SmoothPlanes>>> planes_;
};

std::optional<std::array<FieldCircle, 2>> Calibrator::find_circles() const {
  std::array<FieldCircle, 2> circles;
  for (int lens = 0; lens < 2; ++lens) {
    const int width = grey_[0].width() / 2;
    const int height = grey_[0].height();
    const int reduction = std::max(1, std::min(width, height) / 320);
    std::vector<SmoothPlanes> planes;
    std::vector<EdgeField> fields;
    for (const Image& picture : grey_) {
      ImageView half = picture.view();
      half.data += lens * width;
      half.width = width;
      planes.push_back(smooth_planes(half, reduction, 1.0));
      fields.push_back(edge_field(planes.back()));
    }
    const EdgeField field = mean_field(fields);
    const int coarser = std::max(1, std::min(field.width, field.height) / 64);
    const EdgeField coarse = reduced(field, coarser);
    const double half_side = 0.5 * std::min(coarse.width, coarse.height);
    CircleRange range{0.75 * half_side, 1.2 * half_side, 0.5, Evenness::even};
    std::optional<CircleFit> best;
    for (FieldCircle circle : circle_candidates(coarse, range, 5)) {
      circle = {circle.u * coarser, circle.v * coarser, circle.radius * coarser};
      const CircleRange fine{range.lowest_radius * coarser, range.highest_radius * coarser, 0.5,
                             Evenness::even};
      const auto fit = fit_circle(planes, climb(field, circle, fine));
      if (fit && (!best || fit->support > best->support)) best = fit;
    }
    constexpr double min_support = 0.5;
    if (!best || best->support < min_support) return std::nullopt;
    circles[lens] = {best->circle.u * reduction + lens * width, best->circle.v * reduction,
                     best->circle.radius * reduction};
  }
  return circles;
}

State Calibrator::start(double field_of_view_rad) const {
  State state;
  for (int i = 0; i < 2; ++i) {
    FisheyeLens& lens = state.lenses[i];
    lens.centre_u_px = circles_[i].u;
    lens.centre_v_px = circles_[i].v;
    lens.focal_length_px = circles_[i].radius / (0.5 * field_of_view_rad);
    lens.max_angle_rad = 0.5 * field_of_view_rad;
    lens.azimuth_rad = known_.left_azimuth_rad + std::numbers::pi * i;
    lens.roll_rad = i == 0 ? known_.left_roll_rad : known_.right_roll_rad;
  }
  state.stands.resize(pictures_.size());
  for (std::size_t p = 0; p < pictures_.size(); ++p) {
    state.stands[p].yaw_rad = known_.turn_rad.value_or(0.0) * static_cast<double>(p);
  }
  return state;
}

const std::vector<SmoothPlanes>& Calibrator::planes(int reduction) {
  for (const auto& [known, planes] : planes_) {
    if (known == reduction) return planes;
  }
  std::vector<SmoothPlanes> planes;
  for (const Image& picture : grey_)
    planes.push_back(smooth_planes(picture.view(), reduction, 0.7));
  return planes_.emplace_back(reduction, std::move(planes)).second;
}

/// The turn of each picture by which its panorama is most like the first one's.
void Calibrator::find_turns(State& state) const {
  constexpr int columns = 360;
  constexpr int rows = 30;
  const auto panorama = [&](int picture) {
    std::vector<float> values;
    const SmoothPlanes& smooth = planes_.front().second[static_cast<std::size_t>(picture)];
    const Plane plane{planes_.front().first, smooth.width, smooth.height, &smooth.channels[0]};
    State level = state;
    level.stands[picture] = {};
    const View left(level, picture, 0, plane, side_);
    const View right(level, picture, 1, plane, side_);
    for (int y = 0; y < rows; ++y) {
      double sum = 0;
      for (int c = 0; c < columns; ++c) {
        const double azimuth = known_.left_azimuth_rad + 2 * std::numbers::pi * c / columns;
        const auto d = Direction3::from_angles(azimuth, radians(2.0 * y - rows));
        const View& view = std::cos(azimuth - known_.left_azimuth_rad) > 0 ? left : right;
        values.push_back(std::max(0.0F, view.value({d.x, d.y, d.z})));
        sum += values.back();
      }
      for (int c = 0; c < columns; ++c) {
        values[static_cast<std::size_t>(y) * columns + c] -= static_cast<float>(sum / columns);
      }
    }
    return values;
  };
  const auto first = panorama(0);
  for (int p = 1; p < static_cast<int>(state.stands.size()); ++p) {
    const auto other = panorama(p);
    double best = -1;
    for (int turn = 0; turn < columns; ++turn) {
      double product = 0;
      for (std::size_t i = 0; i < other.size(); ++i) {
        const std::size_t column = (i % columns + static_cast<std::size_t>(turn)) % columns;
        product += static_cast<double>(other[i]) * first[i / columns * columns + column];
      }
      if (product > best) {
        best = product;
        state.stands[p].yaw_rad = 2 * std::numbers::pi * turn / columns;
      }
    }
  }
}

Matching Calibrator::match(const State& state, double step_rad, int search, int directions) {
  const int reduction =
      std::max(1, static_cast<int>(std::lround(state.lenses[0].focal_length_px * step_rad)));
  const auto& smooth = planes(reduction);
  const int count = static_cast<int>(pictures_.size());
  std::vector<View> views;
  for (int p = 0; p < count; ++p) {
    const Plane plane{reduction, smooth[p].width, smooth[p].height, &smooth[p].channels[0]};
    for (int lens = 0; lens < 2; ++lens) views.emplace_back(state, p, lens, plane, side_);
  }
  std::vector<std::array<int, 2>> pairs;  // of views
  for (int p = 0; p < count; ++p) {
    pairs.push_back({2 * p, 2 * p + 1});
    if (count == 1 || (count == 2 && p == 1)) continue;
    const int next = (p + 1) % count;
    for (const int a : {0, 1}) {
      for (const int b : {0, 1}) pairs.push_back({2 * p + a, 2 * next + b});
    }
  }
  const auto directions_size = static_cast<std::size_t>(directions);
  std::vector<Matching> found(directions_size);
  executor_.for_chunks(directions_size, 1, [&](std::size_t begin, std::size_t, std::size_t) {
    // Evenly over the sphere (Fibonacci), but for the poles: floor or stand, and the hand above.
    const double z = 0.94 * (1 - (2.0 * static_cast<double>(begin) + 1) / directions);
    const double azimuth = std::numbers::pi * (3 - std::sqrt(5.0)) * static_cast<double>(begin);
    const double flat = std::sqrt(1 - z * z);
    const Vector3d w(flat * std::cos(azimuth), flat * std::sin(azimuth), z);
    const Vector3d east(-std::sin(azimuth), std::cos(azimuth), 0);
    const Vector3d north = w.cross(east);
    const double turns = azimuth / (2 * std::numbers::pi);
    const int region = static_cast<int>((turns - std::floor(turns)) * sectors) % sectors +
                       sectors * static_cast<int>(2 * (z + 1));
    std::vector<std::optional<Patch>> areas(views.size());
    const auto area = [&](int view) -> const Patch& {
      if (!areas[view]) areas[view] = cut(views[view], w, east, north, step_rad, reach + search);
      return *areas[view];
    };
    for (const auto& [a, b] : pairs) {
      const auto pixel = views[a].pixel(w);
      if (!pixel || !views[b].pixel(w)) continue;
      const auto whitener = whitener_of(area(a));
      if (!whitener) continue;
      std::vector<Correlation> at;
      int best = 0;
      const int width = 2 * search + 1;
      for (int i = 0; i < width * width; ++i) {
        at.push_back(correlate(area(a), area(b), i % width - search, i / width - search));
        if (at.back().value > at[best].value) best = i;
      }
      if (at[best].value < -0.5) continue;
      ++found[begin].textured;
      const int x = best % width;
      const int y = best / width;
      if (at[best].value < min_correlation || x == 0 || y == 0 || x == width - 1 ||
          y == width - 1) {
        continue;
      }
      const auto vertex = [&](int stride) {  // of the parabola through three values
        const double low = at[best - stride].value;
        const double high = at[best + stride].value;
        const double bend = low + high - 2 * at[best].value;
        return bend < 0 ? std::clamp(0.5 * (low - high) / bend, -0.5, 0.5) : 0.0;
      };
      const double dx = x - search + vertex(1);
      const double dy = y - search + vertex(width);
      const auto other = views[b].pixel(w + step_rad * (dx * east + dy * north));
      if (!other) continue;
      found[begin].matches.push_back({{Seen{a / 2, a % 2, *pixel}, Seen{b / 2, b % 2, *other}},
                                      east,
                                      north,
                                      *whitener,
                                      std::hypot(dx, dy),
                                      at[best].log_gain,
                                      region});
    }
  });
  Matching all;
  for (Matching& part : found) {
    all.textured += part.textured;
    std::ranges::move(part.matches, std::back_inserter(all.matches));
  }
  return all;
}

Vector3d Calibrator::ray(const Stance& stance, const Vector2d& pixel) const {
  const FisheyeLens& lens = stance.lens;
  const double right = side_ * (pixel.x() - lens.centre_u_px);
  const double up = lens.centre_v_px - pixel.y();
  const double radius = std::hypot(right, up);
  const double angle = angle_at(lens, radius);
  const double scale = radius > 0 ? std::sin(angle) / radius : 0.0;
  return stance.world_from_lens * Vector3d(std::cos(angle), -right * scale, up * scale);
}

std::vector<Stance> Calibrator::stances(const State& state) const {
  std::vector<Stance> result;
  for (const Stand& stand : state.stands) {
    for (const FisheyeLens& lens : state.lenses) result.emplace_back(lens, stand);
  }
  return result;
}

Vector2d Calibrator::residual(const std::vector<Stance>& stances, const Match& match) const {
  const Vector3d apart = ray(stances[match.seen[0].view()], match.seen[0].pixel) -
                         ray(stances[match.seen[1].view()], match.seen[1].pixel);
  return match.whitener * Vector2d(match.east.dot(apart), match.north.dot(apart));
}

/// Tukey's weights: outliers are mismatches, anywhere in the area that was searched.
constexpr double tukey = 4.685;

MatrixXd Calibrator::normal(const State& state, const std::vector<Match>& matches,
                            VectorXd& right) const {
  const auto size = offset_.size();
  constexpr int own = lens_size + stand_size;
  const std::vector<Stance> here = stances(state);
  // With each of their parameters changed a little, and where it stands among all.
  std::vector<std::vector<Stance>> changed(here.size());
  const auto step = [](int parameter) { return parameter < 2 ? 1e-3 : 1e-6; };
  const auto place = [](const Seen& seen, int parameter) {
    return parameter < lens_size ? lens_at(seen.lens) + parameter
                                 : stand_at(seen.picture) + parameter - lens_size;
  };
  for (std::size_t view = 0; view < here.size(); ++view) {
    for (int i = 0; i < own; ++i) {
      FisheyeLens lens = state.lenses[view % 2];
      Stand stand = state.stands[view / 2];
      i < lens_size ? add_to(lens, i, step(i)) : add_to(stand, i - lens_size, step(i));
      changed[view].emplace_back(lens, stand);
    }
  }
  struct Part {
    MatrixXd matrix;
    VectorXd right;
  };
  constexpr std::size_t chunk = 256;
  std::vector<Part> parts((matches.size() + chunk - 1) / chunk);
  executor_.for_chunks(
      matches.size(), chunk, [&](std::size_t begin, std::size_t end, std::size_t number) {
        Part& part = parts[number];
        part.matrix = MatrixXd::Zero(size, size);
        part.right = VectorXd::Zero(size);
        for (std::size_t m = begin; m < end; ++m) {
          const Match& match = matches[m];
          const Vector2d apart = residual(here, match);
          const double t = apart.norm() / (tukey * deviation_rad_);
          if (t >= 1) continue;
          const double root_weight = (1 - t * t) / deviation_rad_;
          Eigen::Matrix<double, 2, 2 * own> slopes;
          std::array<int, 2 * own> places{};
          for (int side = 0; side < 2; ++side) {
            const Seen& seen = match.seen[side];
            const Vector3d unchanged = ray(here[seen.view()], seen.pixel);
            for (int i = 0; i < own; ++i) {
              const int column = side * own + i;
              places[column] = place(seen, i);
              const Vector3d change = (side == 0 ? 1.0 : -1.0) / step(i) *
                                      (ray(changed[seen.view()][i], seen.pixel) - unchanged);
              slopes.col(column) =
                  match.whitener * Vector2d(match.east.dot(change), match.north.dot(change));
            }
          }
          slopes *= root_weight;
          for (int i = 0; i < 2 * own; ++i) {
            part.right[places[i]] -= root_weight * slopes.col(i).dot(apart);
            for (int j = 0; j < 2 * own; ++j) {
              part.matrix(places[i], places[j]) += slopes.col(i).dot(slopes.col(j));
            }
          }
        }
      });
  MatrixXd matrix = prior_information_.asDiagonal();
  right = -prior_information_.cwiseProduct(offset_);
  for (const Part& part : parts) {
    matrix += part.matrix;
    right += part.right;
  }
  return matrix;
}

double Calibrator::cost(const VectorXd& offset, const std::vector<Match>& matches) const {
  const std::vector<Stance> here = stances(moved(prior_, offset));
  double sum = 0.5 * offset.dot(prior_information_.cwiseProduct(offset));
  for (const Match& match : matches) {
    const double t = std::min(1.0, residual(here, match).norm() / (tukey * deviation_rad_));
    const double inner = 1 - t * t;
    sum += tukey * tukey / 6 * (1 - inner * inner * inner);
  }
  return sum;
}

/// All parameters as `minimise` sees them.
class Calibrator::Problem {
 public:
  Problem(Calibrator& calibrator, const std::vector<Match>& matches)
      : calibrator_(calibrator), matches_(matches), trial_(calibrator.offset_) {}

  bool linearise(DenseEquations<Eigen::Dynamic>& equations) {
    const State now = calibrator_.state();
    std::vector<double> lengths;
    const std::vector<Stance> here = calibrator_.stances(now);
    for (const Match& match : matches_) {
      lengths.push_back(calibrator_.residual(here, match).norm());
    }
    // The median length of a Gaussian in the plane is 1.18 deviations.
    calibrator_.deviation_rad_ =
        std::max(0.02 * calibrator_.fine_rad_, upper_median_in_place(std::span(lengths)) / 1.1774);
    equations.matrix = calibrator_.normal(now, matches_, equations.right);
    return true;
  }
  [[nodiscard]] double cost() const { return calibrator_.cost(trial_, matches_); }
  void move(const VectorXd& change) { trial_ = calibrator_.offset_ + change; }
  void accept() { calibrator_.offset_ = trial_; }
  void undo() { trial_ = calibrator_.offset_; }

 private:
  Calibrator& calibrator_;
  const std::vector<Match>& matches_;
  VectorXd trial_;
};

void Calibrator::solve(const std::vector<Match>& matches) {
  if (matches.empty()) return;
  Problem problem(*this, matches);
  DenseEquations<Eigen::Dynamic> equations;
  // The cost is counted in variances: a hundredth moves no parameter by a tenth of its deviation.
  static_cast<void>(
      minimise(problem, equations, {.max_steps = 20, .damping = 1e-3, .min_decrease = 0.01}));
}

bool Calibrator::close_lenses() {
  const State now = state();
  for (int i = 0; i < 2; ++i) {
    FisheyeLens lens = now.lenses[i];
    // The last percent is the blurred edge of the circle.
    const double end_px = 0.99 * circles_[i].radius;
    constexpr double step_rad = 0.02;
    double angle = 0;
    while (angle < std::numbers::pi && radius_at(lens, angle) < end_px) {
      if (radius_at(lens, angle + step_rad) <= radius_at(lens, angle)) return false;
      angle += step_rad;
    }
    if (angle >= std::numbers::pi) return false;
    lens.max_angle_rad = angle;
    prior_.lenses[i].max_angle_rad = angle_at(lens, end_px);
  }
  return true;
}

MatrixXd Calibrator::covariance(const std::vector<Match>& matches) const {
  const State now = state();
  VectorXd right;
  const MatrixXd inverse = normal(now, matches, right).inverse();
  const VectorXd of_prior = -prior_information_.cwiseProduct(offset_);
  MatrixXd spread = prior_information_.asDiagonal();
  for (int region = 0; region < regions; ++region) {
    std::vector<Match> part;
    std::ranges::copy_if(matches, std::back_inserter(part),
                         [&](const Match& match) { return match.region == region; });
    static_cast<void>(normal(now, part, right));
    right -= of_prior;
    spread += right * right.transpose();
  }
  return inverse * spread * inverse;
}

double Calibrator::azimuth_deviation(const Camera& camera, const MatrixXd& covariance) const {
  constexpr int azimuths = 90;
  const State now = state();
  MatrixXd slopes = MatrixXd::Zero(azimuths, covariance.rows());
  for (int i = 0; i < azimuths; ++i) {
    const auto direction = Direction3::from_angles(2 * std::numbers::pi * i / azimuths, 0.0);
    const auto pixel = project(camera, direction);
    if (!pixel) continue;
    const int lens = panonav::lens_at(camera, *pixel);
    const auto azimuth = [&](const FisheyeLens& seen_by) {
      const Vector3d d = ray({seen_by, {}}, Vector2d(pixel->u_px, pixel->v_px));
      return std::atan2(d.y(), d.x());
    };
    for (int j = 0; j < lens_size; ++j) {
      FisheyeLens changed = now.lenses[lens];
      const double step = j < 2 ? 1e-3 : 1e-6;
      add_to(changed, j, step);
      slopes(i, lens_at(lens) + j) =
          angle_difference(azimuth(changed), azimuth(now.lenses[lens])) / step;
    }
  }
  slopes.rowwise() -= slopes.colwise().mean().eval();
  return std::sqrt((slopes * covariance * slopes.transpose()).diagonal().maxCoeff());
}

std::variant<DualFisheyeCalibration, DualFisheyeRefusal> Calibrator::run() {
  for (const ImageView& picture : pictures_) grey_.push_back(to_grey(picture));
  const auto circles = find_circles();
  if (!circles) {
    return DualFisheyeRefusal{"no circle of a lens in each half of the pictures"};
  }
  circles_ = *circles;
  const auto pictures = static_cast<int>(pictures_.size());
  prior_information_ = VectorXd::Zero(stand_at(pictures));
  const auto know = [&](int parameter, double deviation) {
    prior_information_[parameter] = 1 / (deviation * deviation);
  };
  constexpr double fixed = 1e-6;
  for (int lens = 0; lens < 2; ++lens) {
    const double centre_px = 0.015 * circles_[lens].radius;
    const std::array<double, lens_size> deviations{
        centre_px,    centre_px,   0.1, 0.05, 0.02, lens == 0 ? fixed : radians(3.0),
        radians(3.0), radians(3.0)};
    for (int i = 0; i < lens_size; ++i) know(lens_at(lens) + i, deviations[i]);
  }
  for (int p = 0; p < pictures; ++p) {
    know(stand_at(p), p == 0 ? fixed : known_.turn_rad ? radians(5.0) : 10.0);
    know(stand_at(p) + 1, radians(0.5));
    know(stand_at(p) + 2, radians(0.5));
  }

  // The field of view decides how far apart the lenses' pictures lie: the best of some.
  std::vector<double> fields_deg{186, 194, 203, 213};
  if (known_.field_of_view_rad) fields_deg = {degrees(*known_.field_of_view_rad)};
  struct Attempt {
    State prior;
    VectorXd offset;
    int near = -1;
    int textured = 0;
  } best;
  fine_rad_ = 1.8 / circles_[0].radius;
  const double coarse_rad = std::max(radians(0.6), 2 * fine_rad_);
  const int directions = pictures == 1 ? 1000 : 250;
  for (const double field_deg : fields_deg) {
    prior_ = start(radians(field_deg));
    offset_ = VectorXd::Zero(prior_information_.size());
    static_cast<void>(planes(
        std::max(1, static_cast<int>(std::lround(prior_.lenses[0].focal_length_px * coarse_rad)))));
    if (!known_.turn_rad) find_turns(prior_);
    double most_turned = 0;
    for (const Stand& stand : prior_.stands) {
      most_turned = std::max(most_turned, std::abs(wrap_angle(stand.yaw_rad)));
    }
    if (pictures > 1 && most_turned < radians(10.0)) {
      return DualFisheyeRefusal{
          "the pictures are not turned against each other: 10 degrees are needed, 90 are good"};
    }
    solve(match(state(), coarse_rad, 10, directions).matches);
    if (!close_lenses()) continue;
    const Matching again = match(state(), coarse_rad, 4, directions);
    solve(again.matches);
    if (again.near() > best.near && close_lenses()) {
      best = {prior_, offset_, again.near(), again.textured};
    }
  }
  if (best.near < 0) return DualFisheyeRefusal{"the two circles show nothing in common"};
  prior_ = best.prior;
  offset_ = best.offset;
  Matching last;
  const double middle_rad = std::sqrt(coarse_rad * fine_rad_);
  for (const double step_rad : {middle_rad, fine_rad_, fine_rad_}) {
    last = match(state(), step_rad, 3, pictures == 1 ? 6000 : 2000);
    solve(last.matches);
    if (!close_lenses()) return DualFisheyeRefusal{"the lenses' distortion cannot be told"};
  }

  DualFisheyeCalibration result;
  const State found = state();
  DualFisheyeModel model{found.lenses, 0.0};
  std::vector<double> log_gains;
  for (const Match& match : last.matches) {
    if (match.off_steps > 1.0) continue;
    ++result.matches;
    if (match.seen[0].picture == match.seen[1].picture) log_gains.push_back(match.log_gain);
  }
  constexpr int min_textured = 100;
  if (last.textured < min_textured) {
    return DualFisheyeRefusal{
        "too little structure in the pictures: " + std::to_string(last.textured) +
        " patches with contrast; needed: " + std::to_string(min_textured)};
  }
  result.inlier_share = static_cast<double>(result.matches) / last.textured;
  constexpr double min_share = 0.3;
  if (result.inlier_share < min_share || log_gains.empty()) {
    return DualFisheyeRefusal{
        "the pictures do not agree: " + short_number(std::round(100 * result.inlier_share)) +
        " % of the patches are found again, needed are 30 %; one place, turned about the vertical "
        "only, and circles that lie as the rolls say?"};
  }
  std::ranges::nth_element(log_gains,
                           log_gains.begin() + static_cast<std::ptrdiff_t>(log_gains.size() / 2));
  const double ratio = std::exp(log_gains[log_gains.size() / 2]);
  model.lenses[0].gain = std::min(1.0, 1 / ratio);
  model.lenses[1].gain = std::min(1.0, ratio);
  for (FisheyeLens& lens : model.lenses) {
    lens.azimuth_rad = wrap_angle(lens.azimuth_rad);
    lens.roll_rad = wrap_angle(lens.roll_rad);
  }
  result.camera.model = model;
  result.camera.image_size = grey_[0].size();
  result.camera.direction = known_.direction;
  for (const Stand& stand : found.stands) result.turns_rad.push_back(wrap_angle(stand.yaw_rad));
  try {
    validate(result.camera);
    static_cast<void>(visible_elevations(result.camera));
  } catch (const ContractError& error) {
    return DualFisheyeRefusal{std::string("what is found is no camera: ") + error.what()};
  }
  result.residual_rad = deviation_rad_;
  // No correlation is better than a twentieth of a pixel everywhere: grids and smoothing.
  result.azimuth_deviation_rad =
      std::hypot(0.05 * fine_rad_, azimuth_deviation(result.camera, covariance(last.matches)));
  constexpr double max_deviation_deg = 1.0;
  if (!(degrees(result.azimuth_deviation_rad) <= max_deviation_deg)) {
    return DualFisheyeRefusal{
        "the pictures leave azimuths uncertain by " +
        short_number(0.1 * std::round(10 * degrees(result.azimuth_deviation_rad))) +
        " degrees, allowed is 1; add pictures turned by 60 to 120 degrees about the vertical"};
  }
  return result;
}

}  // namespace

std::variant<DualFisheyeCalibration, DualFisheyeRefusal> calibrate_dual_fisheye(
    std::span<const ImageView> pictures, const DualFisheyeKnowledge& known, Executor& executor) {
  require(!pictures.empty(), "number of pictures", 0, "at least 1");
  for (const ImageView& picture : pictures) {
    require(picture.size() == pictures[0].size(), "picture width", picture.width,
            "all of one size");
    require(std::min(picture.width / 2, picture.height) >= 64, "picture height", picture.height,
            "at least 64 px, and 128 px wide");
  }
  return Calibrator(pictures, known, executor).run();
}

}  // namespace panonav
