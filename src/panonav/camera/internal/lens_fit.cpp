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

/// Residual, in standard deviations, from which on Tukey's weight is 0: 95 % efficiency for
/// Gaussian errors. Outliers are mismatches anywhere in the search window.
constexpr double tukey_scale = 4.685;
/// Number of parameters on which a point depends: those of its lens and of its picture's rotation.
constexpr int parameters_per_point = lens_parameter_count + rotation_parameter_count;

Vector2d residual(const std::vector<PosedLens>& lenses, const Match& match) {
  const Vector3d difference = lenses[match.points[0].view()].ray(match.points[0].pixel) -
                              lenses[match.points[1].view()].ray(match.points[1].pixel);
  return match.whitener * Vector2d(match.east.dot(difference), match.north.dot(difference));
}

/// Returns the index, in the vector of unknowns, of a parameter of a point.
int parameter_index(const ImagePoint& point, int parameter) {
  return parameter < lens_parameter_count
             ? lens_offset(point.lens) + parameter
             : rotation_offset(point.picture) + parameter - lens_parameter_count;
}

}  // namespace

/// The lenses of a state, and copies with each parameter changed by its derivative step, for
/// numerical derivatives.
class LensFit::LinearisedLenses {
 public:
  LinearisedLenses(const State& state, double mirror_sign)
      : here_(make_posed_lenses(state, mirror_sign)), changed_(here_.size()) {
    for (std::size_t view = 0; view < here_.size(); ++view) {
      for (int i = 0; i < parameters_per_point; ++i) {
        FisheyeLens lens = state.lenses[view % 2];
        RigRotation rotation = state.rotations[view / 2];
        i < lens_parameter_count
            ? add_to_parameter(lens, i, derivative_step(i))
            : add_to_parameter(rotation, i - lens_parameter_count, derivative_step(i));
        changed_[view].emplace_back(lens, rotation, mirror_sign);
      }
    }
  }

  /// Adds the residual of a match, with its weight, to the normal equations.
  void add(const Match& match, double deviation_rad, MatrixXd& matrix, VectorXd& right) const {
    const Vector2d difference = residual(here_, match);
    const double t = difference.norm() / (tukey_scale * deviation_rad);
    if (t >= 1) return;
    const double root_weight = (1 - t * t) / deviation_rad;
    Slopes slopes;
    std::array<int, 2 * parameters_per_point> indices{};
    for (int side = 0; side < 2; ++side) {
      const ImagePoint& point = match.points[side];
      const Vector3d unchanged = here_[point.view()].ray(point.pixel);
      for (int i = 0; i < parameters_per_point; ++i) {
        const int column = side * parameters_per_point + i;
        indices[column] = parameter_index(point, i);
        const Vector3d change = (side == 0 ? 1.0 : -1.0) / derivative_step(i) *
                                (changed_[point.view()][i].ray(point.pixel) - unchanged);
        slopes.col(column) =
            match.whitener * Vector2d(match.east.dot(change), match.north.dot(change));
      }
    }
    slopes *= root_weight;
    for (int i = 0; i < 2 * parameters_per_point; ++i) {
      right[indices[i]] -= root_weight * slopes.col(i).dot(difference);
      for (int j = 0; j < 2 * parameters_per_point; ++j) {
        matrix(indices[i], indices[j]) += slopes.col(i).dot(slopes.col(j));
      }
    }
  }

 private:
  std::vector<PosedLens> here_;
  std::vector<std::vector<PosedLens>> changed_;
};

LensFit::LensFit(const VectorXd& prior_deviations, double fine_step_rad, double mirror_sign,
                 Executor& executor)
    : current_{{}, VectorXd::Zero(prior_deviations.size())},
      prior_information_(prior_deviations.size()),
      fine_step_rad_(fine_step_rad),
      mirror_sign_(mirror_sign),
      executor_(executor) {
  for (Eigen::Index i = 0; i < prior_deviations.size(); ++i) {
    prior_information_[i] = 1 / (prior_deviations[i] * prior_deviations[i]);
  }
}

void LensFit::reset_to_prior(const State& prior) {
  current_.prior = prior;
  current_.offset.setZero();
}

MatrixXd LensFit::compute_normal_equations(const State& state, const std::vector<Match>& matches,
                                           VectorXd& right) const {
  const LinearisedLenses linearised(state, mirror_sign_);
  struct Part {
    MatrixXd matrix;
    VectorXd right;
  };
  constexpr std::size_t chunk = 256;
  std::vector<Part> parts((matches.size() + chunk - 1) / chunk);
  executor_.for_each_chunk(
      matches.size(), chunk, [&](std::size_t begin, std::size_t end, std::size_t number) {
        Part& part = parts[number];
        part.matrix = MatrixXd::Zero(current_.offset.size(), current_.offset.size());
        part.right = VectorXd::Zero(current_.offset.size());
        for (std::size_t m = begin; m < end; ++m) {
          linearised.add(matches[m], deviation_rad_, part.matrix, part.right);
        }
      });
  MatrixXd matrix = prior_information_.asDiagonal();
  right = -prior_information_.cwiseProduct(current_.offset);
  for (const Part& part : parts) {
    matrix += part.matrix;
    right += part.right;
  }
  return matrix;
}

double LensFit::cost(const VectorXd& offset, const std::vector<Match>& matches) const {
  const std::vector<PosedLens> here =
      make_posed_lenses(apply_change(current_.prior, offset), mirror_sign_);
  double sum = 0.5 * offset.dot(prior_information_.cwiseProduct(offset));
  for (const Match& match : matches) {
    const double t = std::min(1.0, residual(here, match).norm() / (tukey_scale * deviation_rad_));
    const double inner = 1 - t * t;
    sum += tukey_scale * tukey_scale / 6 * (1 - inner * inner * inner);
  }
  return sum;
}

void LensFit::update_deviation(const std::vector<Match>& matches) {
  std::vector<double> lengths;
  const std::vector<PosedLens> here = make_posed_lenses(state(), mirror_sign_);
  for (const Match& match : matches) lengths.push_back(residual(here, match).norm());
  constexpr double median_length = 1.1774;  // of a Gaussian in the plane, in deviations
  deviation_rad_ =
      std::max(0.02 * fine_step_rad_, upper_median_in_place(std::span(lengths)) / median_length);
}

/// The least-squares problem that `minimise` solves.
class LensFit::Problem {
 public:
  Problem(LensFit& fit, const std::vector<Match>& matches) : fit_(fit), matches_(matches) {}
  bool linearise(DenseEquations<Eigen::Dynamic>& equations) {
    fit_.update_deviation(matches_);
    equations.matrix = fit_.compute_normal_equations(fit_.state(), matches_, equations.right);
    before_ = fit_.current_.offset;
    return true;
  }
  [[nodiscard]] double cost() const { return fit_.cost(fit_.current_.offset, matches_); }
  void move(const VectorXd& change) { fit_.current_.offset = before_ + change; }
  void undo() { fit_.current_.offset = before_; }
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
  const State current_state = state();
  for (int i = 0; i < 2; ++i) {
    FisheyeLens lens = current_state.lenses[i];
    // Excludes the last percent of the radius, the blurred edge of the circle.
    const double end_px = 0.99 * radii_px[i];
    constexpr double step_rad = 0.02;
    double angle = 0;
    while (angle < std::numbers::pi && radius_at(lens, angle) < end_px) {
      if (radius_at(lens, angle + step_rad) <= radius_at(lens, angle)) return false;
      angle += step_rad;
    }
    if (angle >= std::numbers::pi) return false;
    lens.max_angle_rad = angle;
    current_.prior.lenses[i].max_angle_rad = angle_at(lens, end_px);
  }
  return true;
}

MatrixXd LensFit::covariance(const std::vector<Match>& matches) const {
  const State current_state = state();
  VectorXd right;
  const MatrixXd inverse = compute_normal_equations(current_state, matches, right).inverse();
  const VectorXd prior_gradient = -prior_information_.cwiseProduct(current_.offset);
  MatrixXd spread = prior_information_.asDiagonal();
  for (int region = 0; region < regions; ++region) {
    std::vector<Match> part;
    std::ranges::copy_if(matches, std::back_inserter(part),
                         [&](const Match& match) { return match.region == region; });
    static_cast<void>(compute_normal_equations(current_state, part, right));
    right -= prior_gradient;
    spread += right * right.transpose();
  }
  return inverse * spread * inverse;
}

}  // namespace panonav::dual_fisheye
