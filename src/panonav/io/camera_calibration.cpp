#include "panonav/io/camera_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/internal/yaml_fields.hpp"

namespace panonav {

namespace {

/// Intrinsic parameters as OpenCV defines them: the centre of the first pixel is (0, 0).
struct Intrinsics {
  ImageSize size;
  double fx = 1.0, fy = 1.0, cx = 0.0, cy = 0.0;
  double skew = 0.0;  ///< of the camera matrix, in pixels
};

/// Share of the radius or angle at which a model ends that is used, as it is steep there.
constexpr double domain_share = 0.999;

UnifiedModel::Axis to_axis(CameraMount mount) {
  return mount == CameraMount::up ? UnifiedModel::Axis::up : UnifiedModel::Axis::down;
}

double to_elevation(double angle_rad, CameraMount mount) {
  return mount == CameraMount::up ? std::numbers::pi / 2 - angle_rad
                                  : angle_rad - std::numbers::pi / 2;
}

Camera place_camera(const Intrinsics& k, CameraMount mount) {
  Camera camera;
  camera.image_size = k.size;
  camera.centre = {k.cx + 0.5, k.cy + 0.5};
  camera.affine = {k.fy / k.fx, 0.0, k.skew / k.fx};
  camera.direction =
      mount == CameraMount::down ? ColumnDirection::counter_clockwise : ColumnDirection::clockwise;
  return camera;
}

/// Distance of the farthest corner of the picture from the centre, in the ideal image before
/// distortion.
double find_corner_radius(const Camera& camera) {
  const auto [width, height] = camera.image_size;
  const auto [c, d, e] = camera.affine;
  double radius_px = 0.0;
  for (const double u : {0.0, static_cast<double>(width)}) {
    for (const double v : {0.0, static_cast<double>(height)}) {
      const double right = u - camera.centre.u_px;
      const double down = v - camera.centre.v_px;
      radius_px = std::max(
          radius_px, std::hypot(c * right - e * down, down - d * right) / std::abs(c - d * e));
    }
  }
  return radius_px;
}

/// Reduces the rim until the camera is valid, as models fit the calibrated part of a picture only.
/// Throws FileError if hardly anything remains.
void shrink_rim_until_valid(Camera& camera, const std::filesystem::path& path) {
  constexpr double step = 0.98;
  constexpr double min_share = 0.1;
  const double first_px = camera.rim_radius_px;
  while (true) {
    try {
      validate(camera);
      return;
    } catch (const ContractError& error) {
      camera.rim_radius_px *= step;
      if (!(camera.rim_radius_px > min_share * first_px)) {
        throw FileError(path.string(), error.what());
      }
    }
  }
}

Camera make_fisheye(const Intrinsics& k, std::span<const double> coefficients, CameraMount mount) {
  Camera camera = place_camera(k, mount);
  FisheyeModel model{.focal_length_px = k.fx,
                     .k1 = coefficients[0],
                     .k2 = coefficients[1],
                     .k3 = coefficients[2],
                     .k4 = coefficients[3],
                     .max_angle_rad = std::numbers::pi,
                     .axis = UnifiedModel::Axis::down};
  model.max_angle_rad = find_last_growing_angle(model, std::numbers::pi);
  if (model.max_angle_rad < std::numbers::pi) model.max_angle_rad *= domain_share;
  const auto at_corner = elevation_at(model, find_corner_radius(camera));
  if (at_corner) model.max_angle_rad = *at_corner + std::numbers::pi / 2;
  model.axis = to_axis(mount);
  camera.rim_radius_px = radius_at_angle(model, model.max_angle_rad);
  camera.model = model;
  return camera;
}

/// Sets the distortion, k1, k2, p1, p2 and k3 of the normalised plane, of which the last ones may
/// be missing. Returns a radius of the ideal image beyond all that the picture shows: distortion
/// may move far points inwards.
double set_distortion(Camera& camera, std::span<const double> distortion) {
  constexpr double distorted_corner_factor = 3.0;
  std::ranges::copy(distortion.first(std::min(distortion.size(), camera.distortion.size())),
                    camera.distortion.begin());
  const bool is_distorted = camera.distortion != Camera{}.distortion;
  return find_corner_radius(camera) * (is_distorted ? distorted_corner_factor : 1.0);
}

/// `distortion`: as `set_distortion`.
Camera make_omni(const Intrinsics& k, double xi, std::span<const double> distortion,
                 CameraMount mount) {
  Camera camera = place_camera(k, mount);
  camera.model = UnifiedModel{xi, k.fx, to_axis(mount)};
  camera.rim_radius_px = set_distortion(camera, distortion);
  if (xi > 1.0) {
    camera.rim_radius_px =
        std::min(camera.rim_radius_px, domain_share * k.fx / std::sqrt(xi * xi - 1.0));
  }
  return camera;
}

/// Makes a camera of the angle from the axis at each radius, by a fitted polynomial.
Camera make_fitted(const Intrinsics& k, const std::function<double(double)>& angle_at,
                   double max_radius_px, CameraMount mount, const std::filesystem::path& path) {
  constexpr double step = 0.97;
  constexpr double min_share = 0.2;
  const double max_residual_rad = radians(0.002);
  Camera camera = place_camera(k, mount);
  const double first_px = std::min(find_corner_radius(camera), max_radius_px);
  for (double rim_px = first_px; rim_px > min_share * first_px; rim_px *= step) {
    auto fit = fit_polynomial(
        [&](double radius_px) { return to_elevation(angle_at(radius_px), mount); }, rim_px);
    if (!(fit.residual_rad <= max_residual_rad)) continue;
    camera.model = std::move(fit.model);
    camera.rim_radius_px = rim_px;
    return camera;
  }
  throw FileError(path.string(),
                  "its model differs from every polynomial by more than 0.002 degrees; allowed: "
                  "models that a polynomial of 16 coefficients represents");
}

/// Angle from the axis at a radius, of the extended unified model (Khomutenko et al. 2016).
double compute_eucm_angle(double alpha, double beta, double r) {
  const double r2 = r * r;
  const double mz = (1 - beta * alpha * alpha * r2) /
                    (alpha * std::sqrt(1 - (2 * alpha - 1) * beta * r2) + 1 - alpha);
  return std::atan2(r, mz);
}

/// The same of the double sphere model (Usenko et al. 2018).
double compute_double_sphere_angle(double xi, double alpha, double r) {
  const double r2 = r * r;
  const double mz =
      (1 - alpha * alpha * r2) / (alpha * std::sqrt(1 - (2 * alpha - 1) * r2) + 1 - alpha);
  const double factor = (mz * xi + std::sqrt(mz * mz + (1 - xi * xi) * r2)) / (mz * mz + r2);
  return std::atan2(factor * r, factor * mz - xi);
}

/// Largest radius of both models, in units of the focal length; infinite for alpha <= 0.5.
double find_max_radius(double alpha, double beta) {
  if (alpha <= 0.5) return std::numeric_limits<double>::infinity();
  return domain_share / std::sqrt(beta * (2 * alpha - 1));
}

/// Makes a camera that looks forward. `distortion`: as `set_distortion`.
Camera make_pinhole(const Intrinsics& k, std::span<const double> distortion) {
  Camera camera = place_camera(k, CameraMount::up);
  camera.model = PinholeModel{.focal_length_px = k.fx};
  const double rim_px = set_distortion(camera, distortion);
  if (camera.distortion != Camera{}.distortion) camera.rim_radius_px = rim_px;
  return camera;
}

ImageSize to_size(const YamlFields& yaml, const std::string& name, double width, double height) {
  const auto is_size = [](double value) {
    return value == std::floor(value) && value >= 1 && value <= 100000;
  };
  if (!is_size(width) || !is_size(height)) {
    yaml.fail(name, to_text(width) + " x " + to_text(height), "whole numbers from 1 to 100000");
  }
  return {static_cast<int>(width), static_cast<int>(height)};
}

void check_focal_lengths(const YamlFields& yaml, const std::string& name, const Intrinsics& k) {
  if (k.fx > 0 && k.fy > 0) return;
  yaml.fail(name, to_text(k.fx) + ", " + to_text(k.fy), "focal lengths above 0");
}

CalibratedCamera read_kalibr(const std::filesystem::path& path, const YamlFields& yaml,
                             CameraMount mount) {
  std::vector<std::string> cameras;
  for (const std::string& name : yaml.top_names()) {
    if (yaml.has(name + ".camera_model")) cameras.push_back(name);
  }
  if (cameras.size() != 1) {
    std::string list;
    for (const auto& name : cameras) list += (list.empty() ? "" : ", ") + to_readable_line(name);
    throw FileError(path.string(), "contains the cameras " + list +
                                       "; allowed: one; copy its part to a file of its own");
  }
  const std::string prefix = cameras.front() + ".";
  const std::string model = yaml.text(prefix + "camera_model").value_or("");
  const std::string distortion = yaml.text(prefix + "distortion_model").value_or("none");
  const std::string short_name = distortion == "equidistant" ? "equi" : distortion;
  const std::string format = "Kalibr (" + to_readable_line(model + "-" + short_name) + ")";
  const std::size_t before = model == "omni" ? 1 : model == "ds" || model == "eucm" ? 2 : 0;
  const bool is_pinhole = model == "pinhole" && (short_name == "radtan" || short_name == "none");
  const bool is_known = is_pinhole || (model == "pinhole" && short_name == "equi") ||
                        (model == "omni" && (short_name == "radtan" || short_name == "none")) ||
                        (before == 2 && short_name == "none");
  if (!is_known) {
    yaml.fail(prefix + "camera_model", model + "-" + short_name,
              "pinhole-radtan, pinhole-none, pinhole-equi, omni-radtan, omni-none, ds-none, "
              "eucm-none");
  }
  const auto n = yaml.numbers(prefix + "intrinsics", before + 4);
  const auto size = yaml.numbers(prefix + "resolution", 2);
  const Intrinsics k{to_size(yaml, prefix + "resolution", size[0], size[1]), n[before],
                     n[before + 1], n[before + 2], n[before + 3]};
  check_focal_lengths(yaml, prefix + "intrinsics", k);
  std::vector<double> coefficients(4, 0.0);
  if (short_name != "none") coefficients = yaml.numbers(prefix + "distortion_coeffs", 4);
  if (is_pinhole) return {format, make_pinhole(k, coefficients)};
  if (model == "pinhole") return {format, make_fisheye(k, coefficients, mount)};
  if (model == "omni") return {format, make_omni(k, n[0], coefficients, mount)};
  const double beta = model == "eucm" ? n[1] : 1.0;
  const double alpha = model == "eucm" ? n[0] : n[1];
  if (!(alpha >= 0 && alpha <= 1 && beta > 0) || (model == "ds" && std::abs(n[0]) > 1)) {
    yaml.fail(prefix + "intrinsics", to_text(n[0]) + ", " + to_text(n[1]),
              model == "ds" ? "xi in -1 .. 1, alpha in 0 .. 1" : "alpha in 0 .. 1, beta above 0");
  }
  const auto angle_at = [&](double radius_px) {
    return model == "eucm" ? compute_eucm_angle(alpha, beta, radius_px / k.fx)
                           : compute_double_sphere_angle(n[0], alpha, radius_px / k.fx);
  };
  return {format, make_fitted(k, angle_at, k.fx * find_max_radius(alpha, beta), mount, path)};
}

/// Reads OpenCV's FileStorage and the camera_info files of ROS.
CalibratedCamera read_opencv(const YamlFields& yaml, CameraMount mount) {
  const auto find = [&yaml](std::vector<std::string> names) {
    std::vector<std::string> all;
    for (const std::string& name : names) {
      all.push_back(name + ".data");
      all.push_back(name);
    }
    return yaml.find_name(all);
  };
  const std::string matrix = find({"camera_matrix", "K", "cameraMatrix", "intrinsic_matrix"});
  const auto m = yaml.numbers(matrix, 9);
  const std::string width = yaml.find_name({"image_width", "width", "image_size", "imageSize"});
  const auto size = yaml.numbers(width);
  const std::string height = yaml.find_name({"image_height", "height"});
  const Intrinsics k{size.size() == 2 ? to_size(yaml, width, size[0], size[1])
                                      : to_size(yaml, width, yaml.numbers(width, 1)[0],
                                                yaml.numbers(height, 1)[0]),
                     m[0],
                     m[4],
                     m[2],
                     m[5],
                     m[1]};
  check_focal_lengths(yaml, matrix, k);
  const std::string coefficients =
      find({"distortion_coefficients", "D", "distCoeffs", "dist_coeffs", "distortion_coeffs"});
  const auto d = yaml.numbers(coefficients);
  const std::string xi = find({"xi"});
  if (yaml.has(xi)) {
    return {"OpenCV (omnidir)",
            make_omni(k, yaml.numbers(xi, 1)[0], yaml.numbers(coefficients, 4), mount)};
  }
  const std::string model =
      yaml.text(yaml.find_name({"distortion_model", "camera_model", "model"})).value_or("");
  const bool is_named_fisheye = model == "equidistant" || model == "fisheye" ||
                                yaml.text("fisheye_model").value_or("0") == "1";
  if (!is_named_fisheye && (d.size() != 4 || !model.empty())) {
    const auto is_zero = [](double value) { return value == 0.0; };
    if (d.size() > 5 && !std::ranges::all_of(std::span(d).subspan(5), is_zero)) {
      yaml.fail(coefficients, std::to_string(d.size()) + " numbers",
                "k1, k2, p1, p2 and k3 (plumb_bob); further ones must be 0");
    }
    return {"OpenCV (pinhole)", make_pinhole(k, d)};
  }
  return {"OpenCV (fisheye)", make_fisheye(k, yaml.numbers(coefficients, 4), mount)};
}

CalibratedCamera read_stella(const YamlFields& yaml, CameraMount mount) {
  const std::string model = yaml.text("Camera.model").value_or("");
  const std::string format = "stella_vslam (" + to_readable_line(model) + ")";
  const auto number = [&](const std::string& name) {
    return yaml.numbers("Camera." + name, 1).front();
  };
  const ImageSize size = to_size(yaml, "Camera.cols", number("cols"), number("rows"));
  if (model == "equirectangular") {
    Camera camera;
    camera.model = EquirectangularModel{};
    camera.image_size = size;
    return {format, camera};
  }
  if (model != "fisheye" && model != "perspective") {
    yaml.fail("Camera.model", model.empty() ? "missing" : model,
              "perspective, fisheye, equirectangular");
  }
  const Intrinsics k{size, number("fx"), number("fy"), number("cx"), number("cy")};
  check_focal_lengths(yaml, "Camera.fx", k);
  if (model == "perspective") {
    return {format, make_pinhole(k, std::vector{number("k1"), number("k2"), number("p1"),
                                                number("p2"), number("k3")})};
  }
  return {
      format,
      make_fisheye(k, std::vector{number("k1"), number("k2"), number("k3"), number("k4")}, mount)};
}

/// Removes and returns the first line that is neither empty nor a comment; empty at the end.
std::string_view take_data_line(std::string_view& text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first != line.npos && line[first] != '#') return line;
  }
  return {};
}

/// Returns the numbers of a line; empty if anything else is in it.
std::vector<double> read_number_line(std::string_view line) {
  std::vector<double> numbers;
  for (const std::string& word : split_words(line)) {
    double value = 0.0;
    const auto digits = std::string_view(word).substr(word.starts_with('+') ? 1 : 0);
    if (!read_number(digits, value) || !std::isfinite(value)) return {};
    numbers.push_back(value);
  }
  return numbers;
}

/// True if the line begins with the number of the numbers that follow, as polynomials of OCamCalib
/// do.
bool has_count(const std::vector<double>& line) {
  return line.size() >= 2 && line[0] == static_cast<double>(line.size() - 1);
}

CalibratedCamera read_ocamcalib(const std::filesystem::path& path, std::string_view text,
                                CameraMount mount) {
  constexpr std::size_t line_count = 5;
  std::vector<std::vector<double>> lines;
  while (lines.size() < line_count) lines.push_back(read_number_line(take_data_line(text)));
  if (!has_count(lines[0]) || !has_count(lines[1]) || lines[2].size() != 2 ||
      lines[3].size() != 3 || lines[4].size() != 2) {
    throw FileError(path.string(),
                    "is not complete; allowed, as OCamCalib writes: lines of the polynomial and of "
                    "its inverse (each with its number of coefficients first), row and column of "
                    "the centre, c d e, height and width");
  }
  const auto is_size = [](double value) {
    return value == std::floor(value) && value >= 1 && value <= 100000;
  };
  if (!is_size(lines[4][0]) || !is_size(lines[4][1])) {
    throw FileError(path.string(), "the image size is " + to_text(lines[4][0]) + ", " +
                                       to_text(lines[4][1]) +
                                       "; allowed: height and width, whole numbers to 100000");
  }
  // Its x axis follows the rows and its z axis points away from the scene in front of a lens, to
  // which its polynomial gives negative values.
  const double sign = mount == CameraMount::up ? 1.0 : -1.0;
  PolynomialModel model;
  for (std::size_t i = 1; i < lines[0].size(); ++i) {
    model.coefficients.push_back(sign * lines[0][i]);
  }
  Camera camera = place_camera({{static_cast<int>(lines[4][1]), static_cast<int>(lines[4][0])},
                                1.0,
                                1.0,
                                lines[2][1],
                                lines[2][0]},
                               mount);
  camera.affine = {lines[3][0], lines[3][1], lines[3][2]};
  camera.model = std::move(model);
  camera.rim_radius_px = find_corner_radius(camera);
  return {"OCamCalib", camera};
}

}  // namespace

std::optional<CalibrationFormat> identify_calibration(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // a byte order mark
  const std::string_view line = take_data_line(text);
  const auto words = split_words(line);
  if (words.empty()) return std::nullopt;
  const bool is_yaml = words.front().starts_with("%YAML") || words.front() == "---" ||
                       (line.find('=') == line.npos && !words.front().starts_with('[') &&
                        !words.front().starts_with('{') && words.front().ends_with(':'));
  if (is_yaml) return CalibrationFormat::yaml;
  if (has_count(read_number_line(line)) && has_count(read_number_line(take_data_line(text)))) {
    return CalibrationFormat::ocamcalib;
  }
  return std::nullopt;
}

CalibratedCamera parse_calibration(const std::filesystem::path& path, std::string_view text,
                                   CalibrationFormat format, CameraMount mount) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  CalibratedCamera result;
  if (format == CalibrationFormat::ocamcalib) {
    result = read_ocamcalib(path, text, mount);
  } else {
    const YamlFields yaml(path, text);
    const auto names = yaml.top_names();
    const bool is_kalibr = std::ranges::any_of(
        names, [&](const std::string& name) { return yaml.has(name + ".camera_model"); });
    if (is_kalibr) {
      result = read_kalibr(path, yaml, mount);
    } else if (yaml.has("Camera.model")) {
      result = read_stella(yaml, mount);
    } else {
      const auto has_matrix = [&](const char* name) {
        return std::ranges::find(names, name) != names.end();
      };
      if (!has_matrix("K") && !has_matrix("camera_matrix") && !has_matrix("cameraMatrix") &&
          !has_matrix("intrinsic_matrix")) {
        throw FileError(path.string(),
                        "is YAML, but no calibration of a camera; allowed: of Kalibr (camera_model "
                        "of a camera), OpenCV or ROS (camera_matrix or K), stella_vslam "
                        "(Camera.model)");
      }
      result = read_opencv(yaml, mount);
    }
  }
  shrink_rim_until_valid(result.camera, path);
  return result;
}

}  // namespace panonav
