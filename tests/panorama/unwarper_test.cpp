#include "panonav/panorama/unwarper.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/test_cameras.hpp"

namespace panonav::testing {
namespace {

double smooth_world(double azimuth, double elevation) {
  return 0.5 + 0.2 * std::cos(azimuth - 0.3) + 0.1 * std::sin(5.0 * azimuth) +
         0.15 * std::sin(3.0 * elevation);
}

TEST(Unwarper, PutsEveryDirectionWhereItBelongs) {
  const Camera camera = mirror_camera();
  const Image image = render(camera, smooth_world);
  for (const UnwarperOptions& options :
       {UnwarperOptions{}, UnwarperOptions{.rows = 33, .columns = 121},
        UnwarperOptions{.rows = 200, .columns = 1500},
        UnwarperOptions{.rows = 20, .columns = 64, .elevations = ElevationBand{-0.5, 0.3}}}) {
    const Panorama view = Unwarper(camera, options).unwrap(image.view());
    ASSERT_EQ(view.rows(), options.rows);
    ASSERT_EQ(view.columns(), options.columns);
    double worst = 0.0;
    double sum = 0.0;
    for (int y = 0; y < view.rows(); ++y) {
      for (int c = 0; c < view.columns(); ++c) {
        const double error =
            std::abs(view.at(y, c) - smooth_world(view.azimuth_rad(c), view.elevation_rad(y)));
        // The pixels on the border of the mirror are black in part: the outermost row of a fine
        // cylinder shows it.
        if (options.rows < 200 || (y > 2 && y < view.rows() - 3)) worst = std::max(worst, error);
        sum += error;
      }
    }
    EXPECT_LT(worst, 0.02) << options.rows << " rows";
    EXPECT_LT(sum / static_cast<double>(view.values().size()), 0.004);
  }
}

TEST(Unwarper, TakesTheBandThatTheCameraSees) {
  const Camera camera = mirror_camera();
  const Unwarper unwarper(camera);
  EXPECT_EQ(unwarper.elevations(), visible_elevations(camera));
  const Image image = render(camera, smooth_world, 1);
  const Panorama view = unwarper.unwrap(image.view());
  EXPECT_EQ(view.elevations(), visible_elevations(camera));
  ASSERT_TRUE(view.horizon_row());
  EXPECT_LT(std::abs(view.elevation_rad(*view.horizon_row())), radians(90.0) / 80 / 2 + 1e-9);
}

TEST(Unwarper, KeepsAConstantToTheLastRow) {
  const Camera camera = mirror_camera();
  Image image(640, 480);
  for (auto& value : image.pixels()) value = 200;
  for (const UnwarperOptions& options :
       {UnwarperOptions{}, UnwarperOptions{.rows = 1, .columns = 100},
        UnwarperOptions{.rows = 300, .columns = 1024}}) {
    const Panorama view = Unwarper(camera, options).unwrap(image.view());
    for (const float value : view.values()) {
      ASSERT_NEAR(value, 200.0F / 255.0F, 1e-6F);
    }
  }
}

TEST(Unwarper, ReadsNoOtherPixelsThanItFinds) {
  const Camera camera = mirror_camera();
  Random random(3);
  for (const UnwarperOptions& options :
       {UnwarperOptions{}, UnwarperOptions{.rows = 200, .columns = 1500},
        UnwarperOptions{.rows = 4, .columns = 36, .elevations = ElevationBand{-0.1, 0.1}}}) {
    const Unwarper unwarper(camera, options);
    const auto pixels = unwarper.find_read_pixels();
    Image image(640, 480);
    for (auto& value : image.pixels()) value = static_cast<std::uint8_t>(random.index(256));
    ASSERT_GT(pixels.size(), 1000U);
    ASSERT_LT(pixels.size(), 200000U);
    EXPECT_TRUE(std::ranges::is_sorted(pixels));
    Image masked(640, 480);
    for (const std::uint32_t pixel : pixels) masked.pixels()[pixel] = image.pixels()[pixel];
    EXPECT_EQ(unwarper.unwrap(image.view()), unwarper.unwrap(masked.view()));
    // A tenth of the pixels fewer is too few.
    for (std::size_t i = 0; i < pixels.size(); i += 10) masked.pixels()[pixels[i]] ^= 0x80U;
    EXPECT_NE(unwarper.unwrap(image.view()), unwarper.unwrap(masked.view()));
  }
}

TEST(Unwarper, InterpolatesLinearlyWhereTheImageIsNotDenser) {
  // Columns and rows closer than the pixels: one tap per value, in the image itself. By the
  // definition.
  const Camera camera = mirror_camera();
  Random random(1);
  Image image(640, 480);
  for (auto& value : image.pixels()) value = static_cast<std::uint8_t>(random.index(256));
  const UnwarperOptions options{
      .rows = 160, .columns = 2048, .elevations = ElevationBand{-0.9, 0.4}};
  const Panorama view = Unwarper(camera, options).unwrap(image.view());
  double worst = 0.0;
  double sum = 0.0;
  for (int y = 0; y < view.rows(); ++y) {
    for (int c = 0; c < view.columns(); ++c) {
      const auto point =
          project(camera, Direction3::from_angles(view.azimuth_rad(c), view.elevation_rad(y)));
      ASSERT_TRUE(point);
      const double u = point->u_px - 0.5;
      const double v = point->v_px - 0.5;
      const int u0 = static_cast<int>(std::floor(u));
      const int v0 = static_cast<int>(std::floor(v));
      const double a = u - u0;
      const double b = v - v0;
      const double expected = (1 - a) * (1 - b) * image.at(u0, v0) +
                              a * (1 - b) * image.at(u0 + 1, v0) +
                              (1 - a) * b * image.at(u0, v0 + 1) + a * b * image.at(u0 + 1, v0 + 1);
      const double error = std::abs(255.0 * view.at(y, c) - expected);
      worst = std::max(worst, error);
      sum += error;
    }
  }
  // Weights of 7 bit, in an image of noise at full contrast.
  EXPECT_LT(worst, 2.0) << "grey levels";
  EXPECT_LT(sum / static_cast<double>(view.values().size()), 0.35) << "grey levels";
}

TEST(Unwarper, AzimuthsAreRightToAFractionOfAColumn) {
  // Phases of single frequencies, row by row: a shift of all columns would turn them.
  const Camera camera = mirror_camera();
  for (const int k : {1, 4, 14}) {
    const Image image = render(
        camera, [&](double azimuth, double) { return 0.5 + 0.4 * std::cos(k * azimuth + 0.5); });
    const Panorama view = Unwarper(camera).unwrap(image.view());
    double worst = 0.0;
    double mean = 0.0;
    for (int y = 0; y < view.rows(); ++y) {
      std::complex<double> sum;
      for (int c = 0; c < view.columns(); ++c) {
        sum += static_cast<double>(view.at(y, c)) * std::polar(1.0, -k * view.azimuth_rad(c));
      }
      const double shift_rad = angle_difference(std::arg(sum), 0.5) / k;
      worst = std::max(worst, std::abs(shift_rad));
      mean += shift_rad / view.rows();
      EXPECT_GT(2.0 * std::abs(sum) / view.columns(), 0.37);  // and little is blurred away
    }
    EXPECT_LT(worst / (2.0 * std::numbers::pi / 512), 0.1) << "columns, k = " << k;
    EXPECT_LT(std::abs(mean) / (2.0 * std::numbers::pi / 512), 0.02) << "columns, k = " << k;
  }
}

TEST(Unwarper, DoesNotAlias) {
  // A pattern of two pixels' width cannot be held by 64 columns: it must become grey. One tap per
  // value, as a plain look-up takes, would leave contrast.
  const Camera camera = mirror_camera();
  Image image(640, 480);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) image.at(u, v) = ((u / 2 + v / 2) % 2) != 0 ? 255 : 0;
  }
  const Panorama view = Unwarper(camera, {.rows = 10, .columns = 64}).unwrap(image.view());
  double squares = 0.0;
  for (const float value : view.values()) squares += (value - 0.5) * (value - 0.5);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(view.values().size())), 0.03);
}

TEST(Unwarper, ATurnOfTheRobotTurnsTheColumns) {
  const Camera camera = mirror_camera();
  const double turned_rad = 2.0 * std::numbers::pi * 100 / 512;
  const Unwarper unwarper(camera);
  const Image image_here = render(camera, smooth_world);
  const Image image_there = render(camera, [&](double azimuth, double elevation) {
    return smooth_world(azimuth + turned_rad, elevation);
  });
  const Panorama here = unwarper.unwrap(image_here.view());
  const Panorama there = unwarper.unwrap(image_there.view());
  const Panorama expected = rotate_columns(here, 100);
  double squares = 0.0;
  double guard = 0.0;
  for (std::size_t i = 0; i < here.values().size(); ++i) {
    squares += std::pow(there.values()[i] - expected.values()[i], 2.0);
    guard += std::pow(there.values()[i] - here.values()[i], 2.0);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(here.values().size())), 0.004);
  EXPECT_GT(std::sqrt(guard / static_cast<double>(here.values().size())), 0.1);
}

TEST(Unwarper, UnseenDirectionsTakeTheNearestRowSeen) {
  // The frame cuts the mirror above and below, and the band reaches beyond rim and inner radius.
  Camera camera = mirror_camera();
  camera.image_size.height = 400;
  camera.centre.v_px = 200.0;
  const UnwarperOptions options{
      .rows = 60, .columns = 256, .elevations = ElevationBand{radians(-80.0), radians(50.0)}};
  const Unwarper unwarper(camera, options);
  // Grey depends on azimuth alone, so the nearest row seen has the right value.
  const auto world = [](double azimuth, double) { return 0.5 + 0.3 * std::cos(azimuth); };
  const Image image = render(camera, world);
  const Panorama view = unwarper.unwrap(image.view());
  int unseen = 0;
  int cut_by_the_frame = 0;
  for (int y = 0; y < 60; ++y) {
    for (int c = 0; c < 256; ++c) {
      const bool expected =
          project(camera, Direction3::from_angles(view.azimuth_rad(c), view.elevation_rad(y)))
              .has_value();
      // A value whose middle is not seen may have taps that are.
      if (expected) {
        EXPECT_TRUE(unwarper.is_visible(y, c));
      }
      unseen += !unwarper.is_visible(y, c);
      cut_by_the_frame +=
          !unwarper.is_visible(y, c) && std::abs(view.elevation_rad(y)) < radians(28.0);
      EXPECT_NEAR(view.at(y, c), world(view.azimuth_rad(c), 0.0), 0.03) << y << " " << c;
    }
  }
  EXPECT_GT(unseen, 3000);
  EXPECT_GT(cut_by_the_frame, 100);
}

TEST(Unwarper, ReadsStridesAndColour) {
  const Camera camera = mirror_camera();
  const Image grey = render(camera, smooth_world, 1);
  const Unwarper unwarper(camera, {.rows = 30, .columns = 200});
  const Panorama expected = unwarper.unwrap(grey.view());
  Image wide(700, 480);
  Image colour(640, 480, 3);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      wide.at(u, v) = grey.at(u, v);
      for (int channel = 0; channel < 3; ++channel) colour.at(u, v, channel) = grey.at(u, v);
    }
  }
  ImageView part = wide.view();
  part.width = 640;
  EXPECT_EQ(unwarper.unwrap(part), expected);
  EXPECT_EQ(unwarper.unwrap(colour.view()), expected);
}

TEST(Unwarper, BlocksAreTheRowsOfTheWhole) {
  const Camera camera = mirror_camera();
  const Image image = render(camera, smooth_world, 1);
  Unwarper::Workspace workspace;
  for (const int rows : {1, 4, 7, 80}) {
    const Unwarper unwarper(camera, {.rows = rows, .columns = 90});
    const Panorama whole = unwarper.unwrap(image.view());
    int next = 0;
    unwarper.unwrap_blocks(
        image.view(), workspace, [&](int first_row, std::span<const float> values) {
          ASSERT_EQ(first_row, next);
          ASSERT_EQ(values.size() % 90, 0U);
          const auto expected =
              whole.values().subspan(static_cast<std::size_t>(first_row) * 90, values.size());
          EXPECT_TRUE(std::ranges::equal(values, expected));
          next += static_cast<int>(values.size() / 90);
        });
    EXPECT_EQ(next, rows);
  }
}

TEST(Unwarper, EquirectangularCamerasWrapRound) {
  Camera camera;
  camera.model = EquirectangularModel{};
  camera.image_size = {720, 360};
  camera.direction = ColumnDirection::clockwise;
  camera.forward_column = 0.3;
  const Image image = render(camera, smooth_world);
  const UnwarperOptions options{.rows = 40, .columns = 300, .elevations = ElevationBand{-0.6, 0.7}};
  const Panorama view = Unwarper(camera, options).unwrap(image.view());
  double worst = 0.0;
  for (int y = 0; y < 40; ++y) {
    for (int c = 0; c < 300; ++c) {
      worst = std::max(worst, std::abs(view.at(y, c) -
                                       smooth_world(view.azimuth_rad(c), view.elevation_rad(y))));
    }
  }
  EXPECT_LT(worst, 0.005);
}

/// Returns the largest difference between the unwarped picture of a world and the world times
/// `brightness`. Every value must be seen.
double find_worst_error(const Camera& camera, const Image& image, const UnwarperOptions& options,
                        const std::function<double(double, double)>& world,
                        double brightness = 1.0) {
  const Unwarper unwarper(camera, options);
  const Panorama view = unwarper.unwrap(image.view());
  double worst = 0.0;
  for (int y = 0; y < view.rows(); ++y) {
    for (int c = 0; c < view.columns(); ++c) {
      EXPECT_TRUE(unwarper.is_visible(y, c));
      const double expected = brightness * world(view.azimuth_rad(c), view.elevation_rad(y));
      worst = std::max(worst, std::abs(view.at(y, c) - expected));
    }
  }
  return worst;
}

TEST(Unwarper, TwoLensesAreOnePictureWithoutASeam) {
  const Camera camera = dual_fisheye_camera();
  const auto world = [](double azimuth, double elevation) {  // smooth at the poles, too
    return 0.5 + std::pow(std::cos(elevation), 4) * (smooth_world(azimuth, elevation) - 0.5);
  };
  const Image image = render(camera, world);
  // Coarse, fine (each value a tap of the picture itself) and a band.
  for (const UnwarperOptions& options :
       {UnwarperOptions{.rows = 40, .columns = 128}, UnwarperOptions{.rows = 300, .columns = 1200},
        UnwarperOptions{.rows = 30, .columns = 256, .elevations = ElevationBand{-0.6, 0.7}}}) {
    // The darker lens gives the brightness, whichever of them sees it. Errors are one grey level of
    // the picture, and seven bits of weights.
    EXPECT_LT(find_worst_error(camera, image, options, world, 0.85), 0.012)
        << options.rows << " rows";
  }
}

TEST(Unwarper, PicturesOfARigAreOnePictureWithoutASeam) {
  const Camera camera = rig_camera(4);
  const Image image = render(camera, smooth_world);
  for (const UnwarperOptions& options :
       {UnwarperOptions{.rows = 20, .columns = 128}, UnwarperOptions{.rows = 100, .columns = 900},
        UnwarperOptions{.rows = 30, .columns = 255, .elevations = ElevationBand{-0.4, 0.3}}}) {
    EXPECT_LT(find_worst_error(camera, image, options, smooth_world), 0.02)
        << options.rows << " rows";
  }
  EXPECT_THROW(Unwarper(rig_camera(3), {.elevations = ElevationBand{-0.2, 0.2}}), ContractError)
      << "a part of the azimuth is not seen";
}

TEST(Unwarper, RefusesBadInput) {
  const Camera camera = mirror_camera();
  const Unwarper unwarper(camera, {.rows = 4, .columns = 16});
  const Image other(480, 640);
  EXPECT_THROW(static_cast<void>(unwarper.unwrap(other.view())), ContractError);
  EXPECT_THROW(Unwarper(camera, {.rows = 0}), OptionError);
  EXPECT_THROW(Unwarper(camera, {.columns = 3}), OptionError);
  EXPECT_THROW(Unwarper(camera, {.elevations = ElevationBand{0.3, 0.2}}), ContractError);
  EXPECT_THROW(Unwarper(camera, {.elevations = ElevationBand{std::nan(""), 0.2}}), ContractError);
  // Nothing of this band is seen.
  EXPECT_THROW(Unwarper(camera, {.rows = 4, .columns = 16, .elevations = ElevationBand{1.2, 1.5}}),
               ContractError);
  Camera broken = camera;
  broken.rim_radius_px = 0.0;
  EXPECT_THROW(Unwarper{broken}, ContractError);
}

}  // namespace
}  // namespace panonav::testing
