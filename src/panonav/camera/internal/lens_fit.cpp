#include "panonav/camera/internal/lens_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <span>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/least_squares.hpp"

namespace panonav::dual_fisheye {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/// Tukey's weights: outliers are mismatches, anywhere in the area that was searched. In standard
/// deviations; 95 % efficient for Gaussian errors.
constexpr double tukey = 4.685;
/// Parameters on which a point depends: those of its lens and of its picture's rotation.
constexpr int own = lens_size + rotation_size;

Vector2d residual(const std::vector<PosedLens>& lenses, const Match& match) {
  const Vector3d apart = lenses[match.points[0].view()].ray(match.points[0].pixel) -
                         lenses[match.points[1].view()].ray(match.points[1].pixel);
  return match.whitener * Vector2d(match.east.dot(apart), match.north.dot(apart));
}

/// Returns the index of a point's parameter among all.
int parameter_index(const ImagePoint& point, int parameter) {
  return parameter < lens_size ? lens_at(point.lens) + parameter
                               : rotation_at(point.picture) + parameter - lens_size;
}

}  // namespace

/// The lenses of a state, and those with each parameter changed a little.
class LensFit::Linearised {
 public:
  Linearised(const State& state, double mirror_sign)
      : here_(make_posed_lenses(state, mirror_sign)), changed_(here_.size()) {
    for (std::size_t view = 0; view < here_.size(); ++view) {
      for (int i = 0; i < own; ++i) {
        FisheyeLens lens = state.lenses[view % 2];
        RigRotation rotation = state.rotations[view / 2];
        i < lens_size ? add_to(lens, i, get_derivative_step(i))
                      : add_to(rotation, i - lens_size, get_derivative_step(i));
        changed_[view].emplace_back(lens, rotation, mirror_sign);
      }
    }
  }

  /// Adds the residual of a match, with its weight, to the normal equations.
  void add(const Match& match, double deviation_rad, MatrixXd& matrix, VectorXd& right) const {
    const Vector2d apart = residual(here_, match);
    const double t = apart.norm() / (tukey * deviation_rad);
    if (t >= 1) return;
    const double root_weight = (1 - t * t) / deviation_rad;
    Slopes slopes;
    std::array<int, 2 * own> places{};
    for (int side = 0; side < 2; ++side) {
      const ImagePoint& point = match.points[side];
      const Vector3d unchanged = here_[point.view()].ray(point.pixel);
      for (int i = 0; i < own; ++i) {
        const int column = side * own + i;
        places[column] = parameter_index(point, i);
        const Vector3d change = (side == 0 ? 1.0 : -1.0) / get_derivative_step(i) *
                                (changed_[point.view()][i].ray(point.pixel) - unchanged);
        slopes.col(column) =
            match.whitener * Vector2d(match.east.dot(change), match.north.dot(change));
      }
    }
    slopes *= root_weight;
    for (int i = 0; i < 2 * own; ++i) {
      right[places[i]] -= root_weight * slopes.col(i).dot(apart);
      for (int j = 0; j < 2 * own; ++j) {
        matrix(places[i], places[j]) += slopes.col(i).dot(slopes.col(j));
      }
    }
  }

 private:
  std::vector<PosedLens> here_;
  std::vector<std::vector<PosedLens>> changed_;
};

LensFit::LensFit(const VectorXd& prior_deviations, double fine_rad, double mirror_sign,
                 Executor& executor)
    : at_{{}, VectorXd::Zero(prior_deviations.size())},
      prior_information_(prior_deviations.size()),
      fine_rad_(fine_rad),
      mirror_sign_(mirror_sign),
      executor_(executor) {
  for (Eigen::Index i = 0; i < prior_deviations.size(); ++i) {
    prior_information_[i] = 1 / (prior_deviations[i] * prior_deviations[i]);
  }
}

void LensFit::restart(const State& prior) {
  at_.prior = prior;
  at_.offset.setZero();
}

MatrixXd LensFit::normal(const State& state, const std::vector<Match>& matches,
                         VectorXd& right) const {
  const Linearised linearised(state, mirror_sign_);
  struct Part {
    MatrixXd matrix;
    VectorXd right;
  };
  constexpr std::size_t chunk = 256;
  std::vector<Part> parts((matches.size() + chunk - 1) / chunk);
  executor_.for_chunks(matches.size(), chunk,
                       [&](std::size_t begin, std::size_t end, std::size_t number) {
                         Part& part = parts[number];
                         part.matrix = MatrixXd::Zero(at_.offset.size(), at_.offset.size());
                         part.right = VectorXd::Zero(at_.offset.size());
                         for (std::size_t m = begin; m < end; ++m) {
                           linearised.add(matches[m], deviation_rad_, part.matrix, part.right);
                         }
                       });
  MatrixXd matrix = prior_information_.asDiagonal();
  right = -prior_information_.cwiseProduct(at_.offset);
  for (const Part& part : parts) {
    matrix += part.matrix;
    right += part.right;
  }
  return matrix;
}

double LensFit::cost(const VectorXd& offset, const std::vector<Match>& matches) const {
  const std::vector<PosedLens> here =
      make_posed_lenses(apply_change(at_.prior, offset), mirror_sign_);
  double sum = 0.5 * offset.dot(prior_information_.cwiseProduct(offset));
  for (const Match& match : matches) {
    const double t = std::min(1.0, residual(here, match).norm() / (tukey * deviation_rad_));
    const double inner = 1 - t * t;
    sum += tukey * tukey / 6 * (1 - inner * inner * inner);
  }
  return sum;
}

void LensFit::update_deviation(const std::vector<Match>& matches) {
  std::vector<double> lengths;
  const std::vector<PosedLens> here = make_posed_lenses(state(), mirror_sign_);
  for (const Match& match : matches) lengths.push_back(residual(here, match).norm());
  constexpr double median_length = 1.1774;  // of a Gaussian in the plane, in deviations
  deviation_rad_ =
      std::max(0.02 * fine_rad_, upper_median_in_place(std::span(lengths)) / median_length);
}

/// The fit as `minimise` sees it.
class LensFit::Problem {
 public:
  Problem(LensFit& fit, const std::vector<Match>& matches) : fit_(fit), matches_(matches) {}
  bool linearise(DenseEquations<Eigen::Dynamic>& equations) {
    fit_.update_deviation(matches_);
    equations.matrix = fit_.normal(fit_.state(), matches_, equations.right);
    before_ = fit_.at_.offset;
    return true;
  }
  [[nodiscard]] double cost() const { return fit_.cost(fit_.at_.offset, matches_); }
  void move(const VectorXd& change) { fit_.at_.offset = before_ + change; }
  void undo() { fit_.at_.offset = before_; }
  void accept() {}

 private:
  LensFit& fit_;
  const std::vector<Match>& matches_;
  VectorXd before_;
};

void LensFit::solve(const std::vector<Match>& matches) {
  if (matches.empty()) return;
  Problem problem(*this, matches);
  DenseEquations<Eigen::Dynamic> equations;
  minimise(problem, equations, {.max_steps = 20, .damping = 1e-3, .min_decrease = 0.01});
}

bool LensFit::set_max_angles(const std::array<double, 2>& radii_px) {
  const State now = state();
  for (int i = 0; i < 2; ++i) {
    FisheyeLens lens = now.lenses[i];
    // The last percent is the blurred edge of the circle.
    const double end_px = 0.99 * radii_px[i];
    constexpr double step_rad = 0.02;
    double angle = 0;
    while (angle < std::numbers::pi && radius_at(lens, angle) < end_px) {
      if (radius_at(lens, angle + step_rad) <= radius_at(lens, angle)) return false;
      angle += step_rad;
    }
    if (angle >= std::numbers::pi) return false;
    lens.max_angle_rad = angle;
    at_.prior.lenses[i].max_angle_rad = angle_at(lens, end_px);
  }
  return true;
}

MatrixXd LensFit::covariance(const std::vector<Match>& matches) const {
  const State now = state();
  VectorXd right;
  const MatrixXd inverse = normal(now, matches, right).inverse();
  const VectorXd of_prior = -prior_information_.cwiseProduct(at_.offset);
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

}  // namespace panonav::dual_fisheye
