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

/// Fields of view of common lenses, which are tried if the caller knows none.
constexpr std::array<double, 4> fields_of_view_deg{186, 194, 203, 213};
/// Smallest yaw that one of several pictures must have relative to the first; with less, the
/// centres of the lenses cannot be determined.
constexpr double min_turn_deg = 10.0;
/// Numbers of directions in which patches are matched, in the first and in the last fits. A single
/// picture has matches only in the overlap of the lenses, so it needs more directions.
constexpr int coarse_directions = 250, single_picture_coarse_directions = 1000;
constexpr int fine_directions = 2000, single_picture_fine_directions = 6000;
/// Smallest number of patches with contrast in the last fit, and the smallest share of them that
/// must be matched; chance matches about 0.1.
constexpr int min_textured = 100;
constexpr double min_inlier_share = 0.3;
/// Largest accepted standard deviation of an azimuth: one column of a panorama with 360 columns.
constexpr double max_azimuth_deviation_deg = 1.0;
/// Lower bound of the standard deviation of a match, in pixels, due to sampling and smoothing.
constexpr double correlation_error_px = 0.05;

/// Returns the prior standard deviations of the parameters, from the tolerances of cameras and the
/// accuracy of yaws and rolls entered by a user.
VectorXd prior_deviations(const std::array<FieldCircle, 2>& circles, int pictures,
                          bool turn_is_known) {
  constexpr double fixed =
      1e-6;  // the first picture's yaw and the left lens's azimuth say where 0 is
  constexpr double unknown_rad = 10.0;
  constexpr double tilt_deg = 0.5;  // of the axis of turns from picture to picture
  VectorXd deviations(rotation_offset(pictures));
  for (int lens = 0; lens < 2; ++lens) {
    const double centre_px = 0.015 * circles[lens].radius;
    deviations.segment<lens_parameter_count>(lens_offset(lens)) << centre_px, centre_px, 0.1, 0.05,
        0.02, lens == 0 ? fixed : radians(3.0), radians(3.0), radians(3.0);
  }
  for (int p = 0; p < pictures; ++p) {
    const double turn_rad = turn_is_known ? radians(5.0) : unknown_rad;
    deviations.segment<rotation_parameter_count>(rotation_offset(p)) << (p == 0 ? fixed : turn_rad),
        radians(tilt_deg), radians(tilt_deg);
  }
  return deviations;
}

/// Finds the circles of both lenses from all pictures together; nullopt if either half shows none.
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
      planes.push_back(make_smooth_planes(half, reduction, 1.0));
      fields.push_back(make_edge_field(planes.back()));
    }
    const EdgeField field = average_fields(fields);
    const int coarser = std::max(1, std::min(field.width, field.height) / 64);
    const EdgeField coarse = reduce(field, coarser);
    const double half_side = 0.5 * std::min(coarse.width, coarse.height);
    CircleRange range{0.75 * half_side, 1.2 * half_side, 0.5, EdgeAveraging::even};
    std::optional<CircleFit> best;
    for (FieldCircle circle : circle_candidates(coarse, range, 5)) {
      circle = {circle.u * coarser, circle.v * coarser, circle.radius * coarser};
      const CircleRange fine{range.min_radius * coarser, range.max_radius * coarser, 0.5,
                             EdgeAveraging::even};
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
             const DualFisheyeCalibration::Knowledge& knowledge, Executor& executor)
      : grey_(grey),
        circles_(circles),
        knowledge_(knowledge),
        mirror_sign_(knowledge.direction == ColumnDirection::clockwise ? 1.0 : -1.0),
        fine_step_rad_(1.8 / circles[0].radius),
        coarse_step_rad_(std::max(radians(0.6), 2 * fine_step_rad_)),
        matcher_(grey_, mirror_sign_, executor),
        fit_(prior_deviations(circles, static_cast<int>(grey.size()),
                              knowledge.turn_rad.has_value()),
             fine_step_rad_, mirror_sign_, executor) {}

  std::variant<DualFisheyeCalibration, std::string> calibrate();

 private:
  /// Returns ideal lenses with this field of view, centred on their circles, and the yaws known
  /// from the user.
  [[nodiscard]] State make_initial_state(double field_of_view_rad) const;
  /// Sets the field of view of each lens to the radius of its circle; false if the fitted radius
  /// does not grow up to there.
  [[nodiscard]] bool set_max_angles() {
    return fit_.set_max_angles({circles_[0].radius, circles_[1].radius});
  }
  /// Fits from each candidate field of view and keeps the best; returns the reason if all fail.
  [[nodiscard]] std::optional<std::string> fit_fields_of_view();
  /// Repeats matching and fit at ever finer resolution; returns the reason if the distortion cannot
  /// be determined.
  [[nodiscard]] std::optional<std::string> refine_fit();
  /// Stores the numbers of matches in `result`; returns the reason if there are too few.
  [[nodiscard]] std::optional<std::string> record_and_check_matches(
      DualFisheyeCalibration& result) const;
  /// Makes the camera from the fit; estimates the gains from the matches between lenses.
  [[nodiscard]] Camera make_camera() const;
  [[nodiscard]] double azimuth_deviation(const Camera& camera, const MatrixXd& covariance) const;

  const std::vector<Image>& grey_;
  std::array<FieldCircle, 2> circles_;
  DualFisheyeCalibration::Knowledge knowledge_;
  double mirror_sign_;
  double fine_step_rad_;    ///< angle between samples in the last fits: about a pixel
  double coarse_step_rad_;  ///< angle between samples in the first fits
  PatchMatcher matcher_;
  LensFit fit_;
  Matching last_matching_;
};

State Calibrator::make_initial_state(double field_of_view_rad) const {
  State state;
  for (int i = 0; i < 2; ++i) {
    FisheyeLens& lens = state.lenses[i];
    lens.centre_u_px = circles_[i].u;
    lens.centre_v_px = circles_[i].v;
    lens.focal_length_px = circles_[i].radius / (0.5 * field_of_view_rad);
    lens.max_angle_rad = 0.5 * field_of_view_rad;
    lens.azimuth_rad = knowledge_.left_azimuth_rad + std::numbers::pi * i;
    lens.roll_rad = i == 0 ? knowledge_.left_roll_rad : knowledge_.right_roll_rad;
  }
  state.rotations.resize(grey_.size());
  for (std::size_t p = 0; p < grey_.size(); ++p) {
    state.rotations[p].yaw_rad = knowledge_.turn_rad.value_or(0.0) * static_cast<double>(p);
  }
  return state;
}

std::optional<std::string> Calibrator::fit_fields_of_view() {
  // The number of matches selects the field of view, on which the positions of matches in the
  // overlap depend.
  std::vector<double> fields_deg(fields_of_view_deg.begin(), fields_of_view_deg.end());
  if (knowledge_.field_of_view_rad) fields_deg = {degrees(*knowledge_.field_of_view_rad)};
  const int directions = grey_.size() == 1 ? single_picture_coarse_directions : coarse_directions;
  LensFit::Parameters best;
  int best_match_count = -1;
  for (const double field_deg : fields_deg) {
    State prior = make_initial_state(radians(field_deg));
    if (!knowledge_.turn_rad)
      matcher_.estimate_yaws(prior, coarse_step_rad_, knowledge_.left_azimuth_rad);
    fit_.reset_to_prior(prior);
    double max_yaw_rad = 0;
    for (const RigRotation& rotation : prior.rotations) {
      max_yaw_rad = std::max(max_yaw_rad, std::abs(wrap_angle(rotation.yaw_rad)));
    }
    if (grey_.size() > 1 && max_yaw_rad < radians(min_turn_deg)) {
      return "the camera was not rotated between the images: 10 degrees are needed, 90 are good";
    }
    fit_.solve(matcher_.match(fit_.state(), coarse_step_rad_, 10, directions).matches);
    if (!set_max_angles()) continue;
    const Matching second_matching = matcher_.match(fit_.state(), coarse_step_rad_, 4, directions);
    fit_.solve(second_matching.matches);
    if (second_matching.count_near_expected() > best_match_count && set_max_angles()) {
      best = fit_.parameters();
      best_match_count = second_matching.count_near_expected();
    }
  }
  if (best_match_count < 0) return "the two circles show no common objects";
  fit_.set_parameters(best);
  return std::nullopt;
}

std::optional<std::string> Calibrator::refine_fit() {
  const double middle_step_rad = std::sqrt(coarse_step_rad_ * fine_step_rad_);
  const int directions = grey_.size() == 1 ? single_picture_fine_directions : fine_directions;
  for (const double step_rad : {middle_step_rad, fine_step_rad_, fine_step_rad_}) {
    last_matching_ = matcher_.match(fit_.state(), step_rad, 3, directions);
    fit_.solve(last_matching_.matches);
    if (!set_max_angles()) return "the lenses' distortion cannot be determined";
  }
  return std::nullopt;
}

std::optional<std::string> Calibrator::record_and_check_matches(
    DualFisheyeCalibration& result) const {
  result.matches = last_matching_.count_near_expected();
  const bool both_lenses = std::ranges::any_of(last_matching_.matches, [](const Match& match) {
    return match.offset_steps <= 1.0 && match.points[0].picture == match.points[1].picture;
  });
  if (last_matching_.textured_count < min_textured) {
    return "too little structure in the images: " + std::to_string(last_matching_.textured_count) +
           " patches with contrast; needed: " + std::to_string(min_textured);
  }
  result.inlier_share = static_cast<double>(result.matches) / last_matching_.textured_count;
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
  for (const Match& match : last_matching_.matches) {
    if (match.offset_steps <= 1.0 && match.points[0].picture == match.points[1].picture) {
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
  camera.direction = knowledge_.direction;
  return camera;
}

double Calibrator::azimuth_deviation(const Camera& camera, const MatrixXd& covariance) const {
  constexpr int azimuths = 90;  // every fourth degree of the horizon
  const State state = fit_.state();
  MatrixXd derivatives = MatrixXd::Zero(azimuths, covariance.rows());
  for (int i = 0; i < azimuths; ++i) {
    const auto direction = Direction3::from_angles(2 * std::numbers::pi * i / azimuths, 0.0);
    const auto pixel = project(camera, direction);
    if (!pixel) continue;
    const int lens = panonav::lens_at(camera, *pixel);
    const auto azimuth = [&](const FisheyeLens& fisheye) {
      const Vector3d d =
          PosedLens(fisheye, {}, mirror_sign_).ray(Vector2d(pixel->u_px, pixel->v_px));
      return std::atan2(d.y(), d.x());
    };
    for (int j = 0; j < lens_parameter_count; ++j) {
      FisheyeLens changed = state.lenses[lens];
      add_to_parameter(changed, j, derivative_step(j));
      derivatives(i, lens_offset(lens) + j) =
          angle_difference(azimuth(changed), azimuth(state.lenses[lens])) / derivative_step(j);
    }
  }
  derivatives.rowwise() -= derivatives.colwise().mean().eval();
  return std::sqrt((derivatives * covariance * derivatives.transpose()).diagonal().maxCoeff());
}

std::variant<DualFisheyeCalibration, std::string> Calibrator::calibrate() {
  DualFisheyeCalibration result;
  if (auto reason = fit_fields_of_view()) return std::move(*reason);
  if (auto reason = refine_fit()) return std::move(*reason);
  if (auto reason = record_and_check_matches(result)) return std::move(*reason);
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
      std::hypot(correlation_error_px * fine_step_rad_,
                 azimuth_deviation(result.camera, fit_.covariance(last_matching_.matches)));
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
    std::span<const ImageView> pictures, const DualFisheyeCalibration::Knowledge& knowledge,
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
  return dual_fisheye::Calibrator(grey, *circles, knowledge, executor).calibrate();
}

}  // namespace panonav
