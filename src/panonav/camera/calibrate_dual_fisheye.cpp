#include "panonav/camera/calibrate_dual_fisheye.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/camera/internal/circle_search.hpp"
#include "panonav/camera/internal/edge_field.hpp"
#include "panonav/camera/internal/lens_fit.hpp"
#include "panonav/camera/internal/lens_pair.hpp"
#include "panonav/camera/internal/patch_matching.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::dual_fisheye {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Fields of view that are tried where none is known: those of lenses on the market.
constexpr std::array<double, 4> fields_of_view_deg{186, 194, 203, 213};
/// Pictures that are turned less than this leave the centres of the lenses open.
constexpr double min_turn_deg = 10.0;
/// Directions in which patches are searched: at first, and for the last fits. Of one picture only
/// the overlap of the lenses serves, and so more directions are searched.
constexpr int coarse_directions = 250, coarse_directions_of_one = 1000;
constexpr int fine_directions = 2000, fine_directions_of_one = 6000;
/// Smallest number of patches with contrast that the last fit needs, and the share of them that
/// must be found again: chance alone finds some 0.1.
constexpr int min_textured = 100;
constexpr double min_inlier_share = 0.3;
/// Largest deviation of an azimuth that is accepted: a column of a panorama of 360.
constexpr double max_azimuth_deviation_deg = 1.0;
/// Smallest deviation of a correlation, in pixels: grids and smoothing allow no better one.
constexpr double correlation_error_px = 0.05;

/// Returns the standard deviations of the parameters before anything is matched: how cameras are
/// made, and how well a user knows turns and rolls.
VectorXd prior_deviations(const std::array<FieldCircle, 2>& circles, int pictures,
                          bool turn_is_known) {
  constexpr double fixed =
      1e-6;  // the first picture's yaw and the left lens's azimuth say where 0 is
  constexpr double unknown_rad = 10.0;
  constexpr double tilt_deg = 0.5;  // of the axis of turns from picture to picture
  VectorXd deviations(rotation_at(pictures));
  for (int lens = 0; lens < 2; ++lens) {
    const double centre_px = 0.015 * circles[lens].radius;
    deviations.segment<lens_size>(lens_at(lens)) << centre_px, centre_px, 0.1, 0.05, 0.02,
        lens == 0 ? fixed : radians(3.0), radians(3.0), radians(3.0);
  }
  for (int p = 0; p < pictures; ++p) {
    const double turn_rad = turn_is_known ? radians(5.0) : unknown_rad;
    deviations.segment<rotation_size>(rotation_at(p)) << (p == 0 ? fixed : turn_rad),
        radians(tilt_deg), radians(tilt_deg);
  }
  return deviations;
}

/// Finds the circles of the lenses in all pictures; empty when a half shows none.
std::optional<std::array<FieldCircle, 2>> find_circles(const std::vector<Image>& grey) {
  std::array<FieldCircle, 2> circles;
  for (int lens = 0; lens < 2; ++lens) {
    const int width = grey[0].width() / 2;
    const int height = grey[0].height();
    const int reduction = std::max(1, std::min(width, height) / 320);
    std::vector<SmoothPlanes> planes;
    std::vector<EdgeField> fields;
    for (const Image& picture : grey) {
      ImageView half = picture.view();
      half.data += lens * width;
      half.width = width;
      planes.push_back(smooth_planes(half, reduction, 1.0));
      fields.push_back(make_edge_field(planes.back()));
    }
    const EdgeField field = average_fields(fields);
    const int coarser = std::max(1, std::min(field.width, field.height) / 64);
    const EdgeField coarse = reduce(field, coarser);
    const double half_side = 0.5 * std::min(coarse.width, coarse.height);
    CircleRange range{0.75 * half_side, 1.2 * half_side, 0.5, Evenness::even};
    std::optional<CircleFit> best;
    for (FieldCircle circle : circle_candidates(coarse, range, 5)) {
      circle = {circle.u * coarser, circle.v * coarser, circle.radius * coarser};
      const CircleRange fine{range.lowest_radius * coarser, range.highest_radius * coarser, 0.5,
                             Evenness::even};
      const auto fit = fit_circle(planes, climb_to_maximum(field, circle, fine));
      if (fit && (!best || fit->support > best->support)) best = fit;
    }
    constexpr double min_support = 0.5;  // of the circumference: the other half may be dark
    if (!best || best->support < min_support) return std::nullopt;
    circles[lens] = {best->circle.u * reduction + lens * width, best->circle.v * reduction,
                     best->circle.radius * reduction};
  }
  return circles;
}

class Calibrator {
 public:
  Calibrator(const std::vector<Image>& grey, const std::array<FieldCircle, 2>& circles,
             const DualFisheyeCalibration::Knowledge& known, Executor& executor)
      : grey_(grey),
        circles_(circles),
        known_(known),
        mirror_sign_(known.direction == ColumnDirection::clockwise ? 1.0 : -1.0),
        fine_rad_(1.8 / circles[0].radius),
        coarse_rad_(std::max(radians(0.6), 2 * fine_rad_)),
        matcher_(grey_, mirror_sign_, executor),
        fit_(prior_deviations(circles, static_cast<int>(grey.size()), known.turn_rad.has_value()),
             fine_rad_, mirror_sign_, executor) {}

  std::variant<DualFisheyeCalibration, std::string> run();

 private:
  /// Returns the state in which lenses are as their makers mean them.
  [[nodiscard]] State make_initial_state(double field_of_view_rad) const;
  /// Ends the lenses at their circles.
  [[nodiscard]] bool set_max_angles() {
    return fit_.set_max_angles({circles_[0].radius, circles_[1].radius});
  }
  /// Fits each field of view and keeps the best; returns the reason where none is found.
  [[nodiscard]] std::optional<std::string> fit_fields_of_view();
  /// Fits again on ever finer values; returns the reason where the lenses cannot be closed.
  [[nodiscard]] std::optional<std::string> refine_fit();
  /// Counts the matches into `result`; returns the reason where there are too few.
  [[nodiscard]] std::optional<std::string> count_matches(DualFisheyeCalibration& result) const;
  /// Returns the camera as fitted, with the lenses' gains.
  [[nodiscard]] Camera make_camera() const;
  [[nodiscard]] double azimuth_deviation(const Camera& camera, const MatrixXd& covariance) const;

  const std::vector<Image>& grey_;
  std::array<FieldCircle, 2> circles_;
  DualFisheyeCalibration::Knowledge known_;
  double mirror_sign_;
  double fine_rad_;    ///< about a pixel
  double coarse_rad_;  ///< between the values of the first fits
  PatchMatcher matcher_;
  LensFit fit_;
  Matching last_;
};

State Calibrator::make_initial_state(double field_of_view_rad) const {
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
  state.rotations.resize(grey_.size());
  for (std::size_t p = 0; p < grey_.size(); ++p) {
    state.rotations[p].yaw_rad = known_.turn_rad.value_or(0.0) * static_cast<double>(p);
  }
  return state;
}

std::optional<std::string> Calibrator::fit_fields_of_view() {
  // The field of view decides the distance between the images of both lenses.
  std::vector<double> fields_deg(fields_of_view_deg.begin(), fields_of_view_deg.end());
  if (known_.field_of_view_rad) fields_deg = {degrees(*known_.field_of_view_rad)};
  const int directions = grey_.size() == 1 ? coarse_directions_of_one : coarse_directions;
  LensFit::Parameters best;
  int best_near = -1;
  for (const double field_deg : fields_deg) {
    State prior = make_initial_state(radians(field_deg));
    if (!known_.turn_rad) matcher_.estimate_yaws(prior, coarse_rad_, known_.left_azimuth_rad);
    fit_.restart(prior);
    double most_turned = 0;
    for (const RigRotation& rotation : prior.rotations) {
      most_turned = std::max(most_turned, std::abs(wrap_angle(rotation.yaw_rad)));
    }
    if (grey_.size() > 1 && most_turned < radians(min_turn_deg)) {
      return "the camera was not rotated between the images: 10 degrees are needed, 90 are good";
    }
    fit_.solve(matcher_.match(fit_.state(), coarse_rad_, 10, directions).matches);
    if (!set_max_angles()) continue;
    const Matching again = matcher_.match(fit_.state(), coarse_rad_, 4, directions);
    fit_.solve(again.matches);
    if (again.count_near_expected() > best_near && set_max_angles()) {
      best = fit_.parameters();
      best_near = again.count_near_expected();
    }
  }
  if (best_near < 0) return "the two circles show no common objects";
  fit_.set_parameters(best);
  return std::nullopt;
}

std::optional<std::string> Calibrator::refine_fit() {
  const double middle_rad = std::sqrt(coarse_rad_ * fine_rad_);
  const int directions = grey_.size() == 1 ? fine_directions_of_one : fine_directions;
  for (const double step_rad : {middle_rad, fine_rad_, fine_rad_}) {
    last_ = matcher_.match(fit_.state(), step_rad, 3, directions);
    fit_.solve(last_.matches);
    if (!set_max_angles()) return "the lenses' distortion cannot be determined";
  }
  return std::nullopt;
}

std::optional<std::string> Calibrator::count_matches(DualFisheyeCalibration& result) const {
  result.matches = last_.count_near_expected();
  const bool both_lenses = std::ranges::any_of(last_.matches, [](const Match& match) {
    return match.off_steps <= 1.0 && match.points[0].picture == match.points[1].picture;
  });
  if (last_.textured < min_textured) {
    return "too little structure in the images: " + std::to_string(last_.textured) +
           " patches with contrast; needed: " + std::to_string(min_textured);
  }
  result.inlier_share = static_cast<double>(result.matches) / last_.textured;
  if (result.inlier_share < min_inlier_share || !both_lenses) {
    return "the images do not agree: " + format_number(std::round(100 * result.inlier_share)) +
           " % of the patches are matched, 30 % are needed; take all images at one place, rotate "
           "the camera only about its vertical axis, and check the roll angles of the circles";
  }
  return std::nullopt;
}

Camera Calibrator::make_camera() const {
  DualFisheyeModel model{fit_.state().lenses, 0.0};
  std::vector<double> log_gains;  // of the right lens against the left one
  for (const Match& match : last_.matches) {
    if (match.off_steps <= 1.0 && match.points[0].picture == match.points[1].picture) {
      log_gains.push_back(match.log_gain);
    }
  }
  const double ratio = std::exp(upper_median_in_place(std::span(log_gains)));
  model.lenses[0].gain = std::min(1.0, 1 / ratio);
  model.lenses[1].gain = std::min(1.0, ratio);
  for (FisheyeLens& lens : model.lenses) {
    lens.azimuth_rad = wrap_angle(lens.azimuth_rad);
    lens.roll_rad = wrap_angle(lens.roll_rad);
  }
  Camera camera;
  camera.model = model;
  camera.image_size = grey_[0].size();
  camera.direction = known_.direction;
  return camera;
}

double Calibrator::azimuth_deviation(const Camera& camera, const MatrixXd& covariance) const {
  constexpr int azimuths = 90;  // every fourth degree of the horizon
  const State now = fit_.state();
  MatrixXd slopes = MatrixXd::Zero(azimuths, covariance.rows());
  for (int i = 0; i < azimuths; ++i) {
    const auto direction = Direction3::from_angles(2 * std::numbers::pi * i / azimuths, 0.0);
    const auto pixel = project(camera, direction);
    if (!pixel) continue;
    const int lens = panonav::lens_at(camera, *pixel);
    const auto azimuth = [&](const FisheyeLens& seen_by) {
      const Vector3d d =
          PosedLens(seen_by, {}, mirror_sign_).ray(Vector2d(pixel->u_px, pixel->v_px));
      return std::atan2(d.y(), d.x());
    };
    for (int j = 0; j < lens_size; ++j) {
      FisheyeLens changed = now.lenses[lens];
      add_to(changed, j, get_derivative_step(j));
      slopes(i, lens_at(lens) + j) =
          angle_difference(azimuth(changed), azimuth(now.lenses[lens])) / get_derivative_step(j);
    }
  }
  slopes.rowwise() -= slopes.colwise().mean().eval();
  return std::sqrt((slopes * covariance * slopes.transpose()).diagonal().maxCoeff());
}

std::variant<DualFisheyeCalibration, std::string> Calibrator::run() {
  DualFisheyeCalibration result;
  if (auto reason = fit_fields_of_view()) return std::move(*reason);
  if (auto reason = refine_fit()) return std::move(*reason);
  if (auto reason = count_matches(result)) return std::move(*reason);
  result.camera = make_camera();
  for (const RigRotation& rotation : fit_.state().rotations) {
    result.turns_rad.push_back(wrap_angle(rotation.yaw_rad));
  }
  try {
    validate(result.camera);
    static_cast<void>(visible_elevations(result.camera));
  } catch (const ContractError& error) {
    return std::string("what is found is not a camera: ") + error.what();
  }
  result.residual_rad = fit_.deviation_rad();
  result.azimuth_deviation_rad =
      std::hypot(correlation_error_px * fine_rad_,
                 azimuth_deviation(result.camera, fit_.covariance(last_.matches)));
  if (!(degrees(result.azimuth_deviation_rad) <= max_azimuth_deviation_deg)) {
    return "the images leave azimuths uncertain by " +
           format_number(0.1 * std::round(10 * degrees(result.azimuth_deviation_rad))) +
           " degrees, at most 1 is allowed; add images with rotations of 60 to 120 degrees about "
           "the vertical";
  }
  return result;
}

}  // namespace
}  // namespace panonav::dual_fisheye

namespace panonav {

std::variant<DualFisheyeCalibration, std::string> calibrate_dual_fisheye(
    std::span<const ImageView> pictures, const DualFisheyeCalibration::Knowledge& known,
    Executor& executor) {
  require(!pictures.empty(), "number of images", 0, "at least 1");
  for (const ImageView& picture : pictures) {
    require(picture.size() == pictures[0].size(), "image width", picture.width, "all of one size");
    require(std::min(picture.width / 2, picture.height) >= 64, "image height", picture.height,
            "at least 64 px, and 128 px wide");
  }
  std::vector<Image> grey;
  for (const ImageView& picture : pictures) grey.push_back(to_grey(picture));
  const auto circles = dual_fisheye::find_circles(grey);
  if (!circles) return "no circle of a lens in each half of the images";
  return dual_fisheye::Calibrator(grey, *circles, known, executor).run();
}

}  // namespace panonav
