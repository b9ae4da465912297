// Calibration files of other programs. Each program's published formula is written here once more,
// in its own frame: x right, y down, z along the optical axis.
#include "panonav/io/camera_calibration.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/camera_file.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

/// Pixel as the programs count: the centre of the first one is (0, 0).
using Projection = std::function<std::array<double, 2>(double x, double y, double z)>;

constexpr double max_error_deg = 0.01;

class Calibrations : public InTemporaryFolder {
 protected:
  [[nodiscard]] CameraFile read(const std::string& text,
                                CameraMount mount = CameraMount::up) const {
    std::ofstream(folder / "calibration") << text;
    return read_camera(folder / "calibration", mount);
  }
  [[nodiscard]] std::string refusal(const std::string& text) const {
    return message_of<FileError>([&] { (void)read(text); });
  }
};

/// Direction of the optical frame in the frame of a robot whose forward is right in the picture.
Direction3 to_robot(double x, double y, double z, CameraMount mount) {
  if (mount == CameraMount::up) return {x, y, z};
  if (mount == CameraMount::down) return {x, -y, -z};
  return {x, y, -z};  // a mirror keeps the azimuth and reverses what is along the axis
}

/// Compares 100 directions within `max_angle_deg` of the axis; those outside of the picture are
/// drawn again.
void expect_projects_as(const Camera& camera, const Projection& project_there, double max_angle_deg,
                        CameraMount mount = CameraMount::up) {
  Random random(1);
  int compared = 0;
  double worst_deg = 0.0;
  for (int attempt = 0; attempt < 10000 && compared < 100; ++attempt) {
    const double angle = radians(random.uniform(0.5, max_angle_deg));
    const double azimuth = random.uniform(-std::numbers::pi, std::numbers::pi);
    const double x = std::sin(angle) * std::cos(azimuth);
    const double y = std::sin(angle) * std::sin(azimuth);
    const double z = std::cos(angle);
    const auto [u, v] = project_there(x, y, z);
    const auto [width, height] = camera.image_size;
    if (!(u > 0 && v > 0 && u < width - 1 && v < height - 1)) continue;
    ++compared;
    const Direction3 expected = to_robot(x, y, z, mount);
    const auto seen = unproject(camera, {u + 0.5, v + 0.5});
    ASSERT_TRUE(seen) << degrees(angle) << " degrees from the axis";
    const double dot = seen->x * expected.x + seen->y * expected.y + seen->z * expected.z;
    const double error = degrees(std::acos(std::min(1.0, dot)));
    worst_deg = std::max(worst_deg, error);
    const auto pixel = project(camera, expected);
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->u_px, u + 0.5, 0.05);
    EXPECT_NEAR(pixel->v_px, v + 0.5, 0.05);
  }
  EXPECT_EQ(compared, 100);
  EXPECT_LE(worst_deg, max_error_deg);
}

Projection kannala_brandt(double fx, double fy, double cx, double cy, std::array<double, 4> k,
                          double alpha = 0.0) {
  return [=](double x, double y, double z) -> std::array<double, 2> {
    const double r = std::hypot(x, y);
    const double t = std::atan2(r, z);
    const double td = t + k[0] * std::pow(t, 3) + k[1] * std::pow(t, 5) + k[2] * std::pow(t, 7) +
                      k[3] * std::pow(t, 9);
    const double px = td * x / r;
    const double py = td * y / r;
    return {fx * (px + alpha * py) + cx, fy * py + cy};
  };
}

Projection mei(double xi, double fx, double fy, double cx, double cy, std::array<double, 4> k,
               double skew = 0.0) {
  return [=](double x, double y, double z) -> std::array<double, 2> {
    const double length = std::hypot(x, y, z);
    const double px = x / (z + xi * length);
    const double py = y / (z + xi * length);
    const double r2 = px * px + py * py;
    const double radial = 1 + k[0] * r2 + k[1] * r2 * r2;
    const double qx = px * radial + 2 * k[2] * px * py + k[3] * (r2 + 2 * px * px);
    const double qy = py * radial + k[2] * (r2 + 2 * py * py) + 2 * k[3] * px * py;
    return {fx * qx + skew * qy + cx, fy * qy + cy};
  };
}

TEST_F(Calibrations, KalibrEquidistant) {
  const auto file = read(
      "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n"
      "  distortion_coeffs: [0.0034823894022493434, 0.0007150348452162257,\n"
      "    -0.0020532361418706202, 0.00020293673591811182]\n"
      "  distortion_model: equidistant\n"
      "  intrinsics: [190.97847715128717, 190.9733070521226, 254.93170605935475, "
      "256.8974428996504]\n"
      "  resolution: [512, 512]\n  rostopic: /cam0/image_raw\n"
      "  T_cam_imu:\n  - [-0.99, 0.02, 0.0, 0.04]\n  - - 0.1\n    - 0.2\n");
  EXPECT_EQ(file.format, "Kalibr (pinhole-equi)");
  EXPECT_EQ(file.camera.image_size, (ImageSize{512, 512}));
  const auto formula =
      kannala_brandt(190.97847715128717, 190.9733070521226, 254.93170605935475, 256.8974428996504,
                     {0.0034823894022493434, 0.0007150348452162257, -0.0020532361418706202,
                      0.00020293673591811182});
  expect_projects_as(file.camera, formula, 112);
  const double top_deg = degrees(visible_elevations(file.camera).top_rad);
  EXPECT_NEAR(top_deg, 90.0, 1e-6);
  EXPECT_NEAR(degrees(visible_elevations(file.camera).bottom_rad), 90 - 77, 2.0);
}

TEST_F(Calibrations, KalibrOmniOfAllMounts) {
  const std::string text =
      "cam0:\n  camera_model: omni\n  intrinsics: [1.3, 700.5, 702.25, 639.5, 481.0]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [-0.21, 0.14, 0.0012, -0.0021]\n"
      "  resolution: [1280, 960]\n";
  for (const auto mount : {CameraMount::up, CameraMount::down, CameraMount::mirror}) {
    const auto file = read(text, mount);
    EXPECT_EQ(file.format, "Kalibr (omni-radtan)");
    expect_projects_as(file.camera,
                       mei(1.3, 700.5, 702.25, 639.5, 481.0, {-0.21, 0.14, 0.0012, -0.0021}), 95,
                       mount);
  }
}

TEST_F(Calibrations, KalibrDoubleSphereAndExtendedUnified) {
  const std::string head =
      "cam0:\n  distortion_model: none\n  distortion_coeffs: []\n"
      "  resolution: [752, 480]\n";
  const auto ds =
      read(head + "  camera_model: ds\n  intrinsics: [-0.19, 0.6, 156.0, 156.5, 374, 240.5]\n");
  EXPECT_EQ(ds.format, "Kalibr (ds-none)");
  expect_projects_as(
      ds.camera,
      [](double x, double y, double z) -> std::array<double, 2> {
        const double xi = -0.19;
        const double a = 0.6;
        const double d1 = std::hypot(x, y, z);
        const double d2 = std::hypot(x, y, xi * d1 + z);
        const double depth = a * d2 + (1 - a) * (xi * d1 + z);
        return {156.0 * x / depth + 374, 156.5 * y / depth + 240.5};
      },
      100);
  const auto eucm =
      read(head + "  camera_model: eucm\n  intrinsics: [0.61, 1.08, 190, 190.2, 376.1, 239]\n");
  expect_projects_as(
      eucm.camera,
      [](double x, double y, double z) -> std::array<double, 2> {
        const double d = std::sqrt(1.08 * (x * x + y * y) + z * z);
        const double depth = 0.61 * d + 0.39 * z;
        return {190 * x / depth + 376.1, 190.2 * y / depth + 239};
      },
      95);
}

TEST_F(Calibrations, OpenCvFisheyeWithSkew) {
  const std::string text =
      "%YAML:1.0\n---\nimage_width: 1280\nimage_height: 960\n"
      "K: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ 3.31e+02, 6.62e-01, 6.402e+02, 0.,\n       3.305e+02, 4.791e+02, 0., 0., 1. ]\n"
      "D: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n"
      "   data: [ -2.1e-02, 3.5e-03, -1.2e-03, 2.0e-04 ]\n";
  const auto file = read(text);
  EXPECT_EQ(file.format, "OpenCV (fisheye)");
  const auto formula =
      kannala_brandt(331, 330.5, 640.2, 479.1, {-2.1e-2, 3.5e-3, -1.2e-3, 2e-4}, 0.662 / 331);
  expect_projects_as(file.camera, formula, 105);
  // The same in the words of camera_info of ROS.
  const auto ros = read(
      "image_width: 1280\nimage_height: 960\ncamera_name: up\ncamera_matrix:\n  rows: 3\n  cols: "
      "3\n"
      "  data: [331, 0.662, 640.2, 0, 330.5, 479.1, 0, 0, 1]\ndistortion_model: equidistant\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 4\n  data: [-0.021, 0.0035, -0.0012, "
      "0.0002]\n");
  expect_projects_as(ros.camera, formula, 105);
}

TEST_F(Calibrations, OpenCvOmnidir) {
  for (const char* xi : {"xi: 1.1\n",
                         "xi: !!opencv-matrix\n   rows: 1\n   cols: 1\n   dt: d\n"
                         "   data: [ 1.1 ]\n"}) {
    const auto file = read(
        "%YAML:1.0\n---\nimage_width: 800\nimage_height: 600\n"
        "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
        "   data: [ 400., 0.8, 399.5, 0., 401., 299., 0., 0., 1. ]\n"
        "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 4\n   dt: d\n"
        "   data: [ -0.11, 0.03, 0.0005, 0.0007 ]\n" +
        std::string(xi));
    EXPECT_EQ(file.format, "OpenCV (omnidir)");
    expect_projects_as(file.camera, mei(1.1, 400, 401, 399.5, 299, {-0.11, 0.03, 5e-4, 7e-4}, 0.8),
                       95);
  }
}

TEST_F(Calibrations, StellaNestedAndFlat) {
  const auto formula = kannala_brandt(285.7, 285.9, 420.1, 399.2, {-0.007, 0.04, -0.038, 0.006});
  for (const bool is_flat : {false, true}) {
    std::string text = is_flat ? "# Camera\n" : "Camera:\n";
    for (const char* line :
         {"model: \"fisheye\"", "fx: 285.7", "fy: 285.9", "cx: 420.1", "cy: 399.2", "k1: -0.007",
          "k2: 0.04", "k3: -0.038", "k4: 0.006", "cols: 848", "rows: 800 # pixels"}) {
      text += std::string(is_flat ? "Camera." : "  ") + line + "\n";
    }
    const auto file = read(text);
    EXPECT_EQ(file.format, "stella_vslam (fisheye)");
    expect_projects_as(file.camera, formula, 90);
  }
  const auto sphere = read("Camera:\n  model: equirectangular\n  cols: 1920\n  rows: 960\n");
  ASSERT_TRUE(std::holds_alternative<EquirectangularModel>(sphere.camera.model));
  const auto seen = unproject(sphere.camera, {1440.0, 240.0});
  EXPECT_NEAR(degrees(seen->azimuth_rad()), -90.0, 1e-9);  // right of the middle
  EXPECT_NEAR(degrees(seen->elevation_rad()), 45.0, 1e-9);
}

const std::string ocam_text =
    "#polynomial coefficients for the DIRECT mapping function\n\n"
    "5 -3.035e+02 0.0e+00 9.1e-04 -8.3e-07 1.9e-09 \n\n"
    "#polynomial coefficients for the inverse mapping function\n\n"
    "3 450.0 -300.0 20.0 \n\n#center: \"row\" and \"column\", starting from 0 (C convention)\n\n"
    "383.25 513.5\n\n#affine parameters \"c\", \"d\", \"e\"\n\n1.0007 -0.0012 0.0009\n\n"
    "#image size: \"height\" and \"width\"\n\n768 1024\n";

TEST_F(Calibrations, OCamCalibRowsAndColumns) {
  for (const auto mount : {CameraMount::up, CameraMount::down, CameraMount::mirror}) {
    const auto file = read(ocam_text, mount);
    EXPECT_EQ(file.format, "OCamCalib");
    EXPECT_EQ(file.camera.image_size, (ImageSize{1024, 768}));
    // cam2world of its C code: x along rows, y along columns, z away from the scene.
    Random random(2);
    int compared = 0;
    while (compared < 100) {
      const double row = random.uniform(0, 767);
      const double column = random.uniform(0, 1023);
      const double determinant = 1.0007 - -0.0012 * 0.0009;
      const double x = (row - 383.25 + 0.0012 * (column - 513.5)) / determinant;
      const double y = (-0.0009 * (row - 383.25) + 1.0007 * (column - 513.5)) / determinant;
      const double r = std::hypot(x, y);
      const double z = -303.5 + r * r * (9.1e-4 + r * (-8.3e-7 + r * 1.9e-9));
      const double length = std::hypot(x, y, z);
      const Direction3 expected = to_robot(y / length, x / length, -z / length, mount);
      const auto seen = unproject(file.camera, {column + 0.5, row + 0.5});
      ASSERT_TRUE(seen);
      ++compared;
      EXPECT_LE(degrees(std::abs(seen->elevation_rad() - expected.elevation_rad())), max_error_deg);
      EXPECT_LE(degrees(std::abs(angle_difference(seen->azimuth_rad(), expected.azimuth_rad()))),
                max_error_deg);
    }
  }
}

/// Pixel of a point in front of a distorted pinhole camera, as OpenCV's documentation defines it.
PixelPoint project_as_opencv(double x, double y, const std::array<double, 5>& d) {
  const double r2 = x * x + y * y;
  const double radial = 1 + d[0] * r2 + d[1] * r2 * r2 + d[4] * r2 * r2 * r2;
  const double u = x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x);
  const double v = y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y;
  return {458.0 * u + 367.0 + 0.5, 457.0 * v + 248.0 + 0.5};
}

TEST_F(Calibrations, PerspectiveCamerasOfFourProgramsAgreeWithOpenCv) {
  const std::string matrix = "[458., 0., 367., 0., 457., 248., 0., 0., 1.]\n";
  const std::string coefficients = "[-0.28, 0.07, 0.0001, 1e-05, 0.002]\n";
  struct Written {
    std::string text;
    double k3;
  };
  const std::vector<Written> files{
      {"cam0:\n  camera_model: pinhole\n  intrinsics: [458, 457, 367, 248]\n"
       "  distortion_model: radtan\n  distortion_coeffs: [-0.28, 0.07, 0.0001, 1e-05]\n"
       "  resolution: [752, 480]\n",
       0.0},
      {"%YAML:1.0\n---\nimage_width: 752\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n"
       "  data: " +
           matrix + "distortion_coefficients: !!opencv-matrix\n  data: " + coefficients,
       0.002},
      {"image_width: 752\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: " +
           matrix +
           "distortion_model: plumb_bob\ndistortion_coefficients:\n  data: " + coefficients,
       0.002},
      {"Camera:\n  model: perspective\n  cols: 752\n  rows: 480\n  fx: 458.0\n  fy: 457.0\n"
       "  cx: 367.0\n  cy: 248.0\n  k1: -0.28\n  k2: 0.07\n  p1: 0.0001\n  p2: 1e-05\n"
       "  k3: 0.002\n",
       0.002}};
  for (const auto& [text, k3] : files) {
    const Camera of_program = read(text).camera;
    write_camera(folder / "again.toml", {of_program, std::nullopt});
    const Camera camera = read_camera(folder / "again.toml").camera;
    EXPECT_EQ(camera, of_program);
    for (const double x : {-0.7, -0.2, 0.0, 0.4, 0.75}) {  // to the right
      for (const double y : {-0.5, 0.0, 0.45}) {           // down
        const auto pixel = project(camera, {1.0, -x, -y});
        const PixelPoint expected = project_as_opencv(x, y, {-0.28, 0.07, 0.0001, 1e-05, k3});
        ASSERT_TRUE(pixel) << text;
        EXPECT_NEAR(pixel->u_px, expected.u_px, 1e-9);
        EXPECT_NEAR(pixel->v_px, expected.v_px, 1e-9);
        const auto seen = unproject(camera, *pixel);
        ASSERT_TRUE(seen);
        EXPECT_NEAR(-seen->y / seen->x, x, 1e-9);
        EXPECT_NEAR(-seen->z / seen->x, y, 1e-9);
      }
    }
    // Far off the picture the polynomial turns back into it.
    EXPECT_FALSE(project(camera, {1.0, -2.2, 0.0}));
  }
  EXPECT_TRUE(
      contains(refusal("image_width: 752\nimage_height: 480\ncamera_matrix:\n  data: " + matrix +
                       "distortion_model: rational_polynomial\ndistortion_coefficients:\n"
                       "  data: [0, 0, 0, 0, 0, 0.1, 0, 0]\n"),
               "further ones must be 0"));
}

TEST_F(Calibrations, FaultsNameTheField) {
  const std::string good =
      "cam0:\n  camera_model: pinhole\n  intrinsics: [190, 190, 255, 257]\n"
      "  distortion_model: equidistant\n  distortion_coeffs: [0, 0, 0, 0]\n"
      "  resolution: [512, 512]\n";
  EXPECT_EQ(refusal(good), "no error");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return refusal(text);
  };
  EXPECT_TRUE(contains(with("[190, 190, 255, 257]", "[190, 190]"),
                       "cam0.intrinsics is 2 numbers; allowed: 4 numbers"));
  EXPECT_TRUE(contains(with("190, 190", "0, 190"), "allowed: focal lengths above 0"));
  EXPECT_TRUE(contains(with("190, 190", "x, 190"), "cam0.intrinsics is x; allowed: finite"));
  EXPECT_TRUE(contains(with("[512, 512]", "[512, 0.5]"), "cam0.resolution"));
  EXPECT_TRUE(contains(with("  resolution: [512, 512]\n", ""), "cam0.resolution is missing"));
  EXPECT_TRUE(contains(with("257]", "257"), "allowed"));
  EXPECT_TRUE(contains(with("255, 257", "9255, 257"), "centre.u_px"));
  EXPECT_TRUE(
      contains(refusal(good + "cam1:\n" + good.substr(6)), "contains the cameras cam0, cam1"));
  EXPECT_TRUE(contains(refusal("a:\n  b: 1\n"), "no calibration of a camera"));
  EXPECT_TRUE(contains(refusal("cam0:\nhello\n"), "line 2 is not YAML"));
  EXPECT_TRUE(contains(refusal(ocam_text.substr(0, 200)), "is not complete"));
}

TEST_F(Calibrations, ExportsReadBackAsTheSameCamera) {
  const auto fisheye = read(
      "Camera.model: fisheye\nCamera.fx: 285\nCamera.fy: 286\nCamera.cx: 420\n"
      "Camera.cy: 399\nCamera.k1: -0.007\nCamera.k2: 0.01\nCamera.k3: 0\n"
      "Camera.k4: 0\nCamera.cols: 848\nCamera.rows: 800\n");
  const auto omni = read(
      "cam0:\n  camera_model: omni\n  intrinsics: [0.9, 300, 301, 320, 240]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [-0.1, 0.02, 1e-3, 0]\n"
      "  resolution: [640, 480]\n");
  Camera mirror;  // as calibrate makes it where the profile is known
  mirror.model = HyperboloidalModel{};
  mirror.image_size = {640, 480};
  mirror.centre = {321.0, 239.0};
  mirror.rim_radius_px = 230.0;
  mirror.inner_radius_px = 40.0;
  for (const auto format : {ExportFormat::kalibr, ExportFormat::opencv}) {
    for (const Camera& camera : {fisheye.camera, omni.camera, mirror}) {
      const auto path = folder / "exported.yaml";
      const double residual_rad = write_calibration(path, camera, format);
      EXPECT_LE(degrees(residual_rad), 0.05);
      const bool is_mirror = std::holds_alternative<HyperboloidalModel>(camera.model);
      EXPECT_EQ(residual_rad == 0.0, !is_mirror);
      const Camera back =
          read_camera(path, is_mirror ? CameraMount::mirror : CameraMount::up).camera;
      Random random(3);
      int compared = 0;
      while (compared < 100) {
        const PixelPoint pixel{random.uniform(0, camera.image_size.width),
                               random.uniform(0, camera.image_size.height)};
        const auto expected = unproject(camera, pixel);
        if (!expected) continue;
        ++compared;
        const auto seen = unproject(back, pixel);
        ASSERT_TRUE(seen);
        EXPECT_LE(std::abs(seen->elevation_rad() - expected->elevation_rad()), residual_rad + 1e-6);
        EXPECT_NEAR(angle_difference(seen->azimuth_rad(), expected->azimuth_rad()), 0.0, 1e-6);
      }
    }
  }
  Camera sphere;
  sphere.model = EquirectangularModel{};
  sphere.image_size = {640, 320};
  EXPECT_TRUE(contains(message_of<ContractError>([&] {
                         (void)write_calibration(folder / "x.yaml", sphere, ExportFormat::kalibr);
                       }),
                       "model is equirectangular"));
  EXPECT_FALSE(std::filesystem::exists(folder / "x.yaml"));
}

}  // namespace
}  // namespace panonav::testing
