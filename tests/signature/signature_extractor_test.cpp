#include "panonav/signature/signature_extractor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

Camera mirror_camera() {
  Camera camera;
  camera.model = EquiangularModel{radians(-60.0), radians(30.0)};
  camera.image_size = {640, 480};
  camera.centre = {322.0, 238.5};
  camera.rim_radius_px = 228.0;
  camera.inner_radius_px = 40.0;
  return camera;
}

/// Blobs of light and dark with noise upon them.
Image blotchy_image(std::uint64_t seed, double contrast = 1.0) {
  Random random(seed);
  const double a = random.uniform(0.01, 0.05);
  const double b = random.uniform(0.01, 0.05);
  Image image(640, 480);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const double value = 100.0 + contrast * (80.0 * std::sin(a * u + 1.0) * std::cos(b * v) +
                                               random.normal(0.0, 10.0));
      image.at(u, v) = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
    }
  }
  return image;
}

double largest_magnitude(const FourierSignature& signature) {
  return *std::ranges::max_element(signature.magnitudes());
}

/// Largest distance of corresponding coefficients in the complex plane.
double largest_difference(const FourierSignature& a, const FourierSignature& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.shape().size(); ++i) {
    largest = std::max(largest, std::abs(std::polar<double>(a.magnitudes()[i], a.phases_rad()[i]) -
                                         std::polar<double>(b.magnitudes()[i], b.phases_rad()[i])));
  }
  return largest;
}

TEST(SignatureExtractor, AgreesWithTheStepsOneByOne) {
  const Camera camera = mirror_camera();
  int combinations = 0;
  for (const UnwarperOptions& cylinder :
       {UnwarperOptions{}, UnwarperOptions{.rows = 7, .columns = 90},
        UnwarperOptions{.rows = 1, .columns = 121}}) {
    const Unwarper unwarper(camera, cylinder);
    for (int bits = 0; bits < 16; ++bits) {
      const bool masked = (bits & 1) != 0 && cylinder.rows > 3;
      const PreprocessingOptions options{.masked_rows_top = masked ? 2 : 0,
                                         .masked_rows_bottom = masked ? 1 : 0,
                                         .edge_channel = (bits & 2) != 0,
                                         .remove_mean = (bits & 4) != 0,
                                         .normalise_gain = (bits & 8) != 0};
      const SignatureExtractor extractor({cylinder.rows, cylinder.columns}, 15, options);
      SignatureExtractor::Workspace workspace;
      EXPECT_EQ(extractor.shape(), (SignatureShape{cylinder.rows, 15}));
      // Twice, the second time with low contrast: nothing of the first image may be left.
      for (const double contrast : {1.0, 0.1}) {
        const Image image = blotchy_image(static_cast<std::uint64_t>(bits) + 1, contrast);
        const FourierSignature expected =
            compute_signature(preprocess(unwarper.unwrap(image.view()), options), 15);
        const FourierSignature found = extractor.signature(unwarper, image.view(), workspace);
        EXPECT_EQ(extractor.signature(unwarper.unwrap(image.view()), workspace), found);
        ASSERT_EQ(found.shape(), expected.shape());
        EXPECT_EQ(found.elevations(), expected.elevations());
        // Removing the mean leaves the rounding of what was there before.
        PreprocessingOptions with_mean = options;
        with_mean.remove_mean = false;
        const double scale = largest_magnitude(
            compute_signature(preprocess(unwarper.unwrap(image.view()), with_mean), 15));
        EXPECT_GT(largest_magnitude(expected), 1e-3 * scale);
        EXPECT_LT(largest_difference(found, expected), 2e-6 * scale) << "options " << bits;
        ++combinations;
      }
    }
  }
  EXPECT_EQ(combinations, 96);
}

TEST(SignatureExtractor, AgreesWithTheDefinitionInDoublePrecision) {
  // Interpolation and transform by their definitions, on a cylinder as fine as the image, where
  // each value is one interpolation between four pixels. The bound is that of 7-bit weights,
  // averaged over a row.
  const Camera camera = mirror_camera();
  const UnwarperOptions cylinder{
      .rows = 150, .columns = 1536, .elevations = ElevationBand{radians(-50), radians(20)}};
  const Image image = blotchy_image(9);
  SignatureExtractor::Workspace workspace;
  const FourierSignature found =
      SignatureExtractor({cylinder.rows, cylinder.columns}, 15,
                         {.remove_mean = false, .normalise_gain = false})
          .signature(Unwarper(camera, cylinder), image.view(), workspace);
  const Panorama angles(150, 1536, cylinder.elevations);
  double worst = 0.0;
  for (int y = 0; y < 150; y += 7) {
    std::vector<std::complex<double>> sums(15);
    for (int c = 0; c < 1536; ++c) {
      const auto point =
          project(camera, Direction3::from_angles(angles.azimuth_rad(c), angles.elevation_rad(y)));
      ASSERT_TRUE(point);
      const double u = point->u_px - 0.5;
      const double v = point->v_px - 0.5;
      const int u0 = static_cast<int>(std::floor(u));
      const int v0 = static_cast<int>(std::floor(v));
      const double a = u - u0;
      const double b = v - v0;
      const double value =
          ((1 - a) * (1 - b) * image.at(u0, v0) + a * (1 - b) * image.at(u0 + 1, v0) +
           (1 - a) * b * image.at(u0, v0 + 1) + a * b * image.at(u0 + 1, v0 + 1)) /
          255.0;
      for (int k = 0; k < 15; ++k)
        sums[k] += 2.0 / 1536 * value * std::polar(1.0, -k * angles.azimuth_rad(c));
    }
    for (int k = 0; k < 15; ++k) {
      worst = std::max(worst, std::abs(sums[k] - std::polar<double>(found.magnitude(y, k),
                                                                    found.phase_rad(y, k))));
    }
  }
  EXPECT_LT(worst, 2e-4);
  EXPECT_GT(largest_magnitude(found), 0.3);
}

TEST(SignatureExtractor, AWorkspaceKeepsNothingOfThePictureBefore) {
  const Unwarper unwarper(mirror_camera(), {.rows = 20, .columns = 128});
  const SignatureExtractor extractor({20, 128});
  SignatureExtractor::Workspace workspace;
  const Image image = blotchy_image(3);
  const Image other = blotchy_image(4);
  const FourierSignature expected = extractor.signature(unwarper, image.view(), workspace);
  EXPECT_NE(extractor.signature(unwarper, other.view(), workspace), expected);
  EXPECT_EQ(extractor.signature(unwarper, image.view(), workspace), expected);
  SignatureExtractor::Workspace fresh;
  EXPECT_EQ(extractor.signature(unwarper, image.view(), fresh), expected);
}

TEST(SignatureExtractor, RefusesBadInput) {
  const Unwarper unwarper(mirror_camera(), {.rows = 4, .columns = 32});
  const PanoramaShape cylinder{4, 32};
  EXPECT_THROW(SignatureExtractor(cylinder, 0), ContractError);
  EXPECT_THROW(SignatureExtractor(cylinder, 17), ContractError);
  EXPECT_THROW(SignatureExtractor({0, 32}), ContractError);
  EXPECT_THROW(SignatureExtractor(cylinder, 15, {.masked_rows_top = 4}), ContractError);
  EXPECT_THROW(SignatureExtractor(cylinder, 15, {.masked_rows_top = -1}), OptionError);
  const SignatureExtractor extractor(cylinder);
  SignatureExtractor::Workspace workspace;
  const auto refused = [&](const Unwarper& by, const Image& image) {
    EXPECT_THROW(static_cast<void>(extractor.signature(by, image.view(), workspace)),
                 ContractError);
  };
  refused(unwarper, Image(64, 48));
  refused(Unwarper(mirror_camera(), {.rows = 5, .columns = 32}), Image(640, 480));
  EXPECT_THROW(static_cast<void>(extractor.signature(Panorama(4, 64, {}), workspace)),
               ContractError);
}

}  // namespace
}  // namespace panonav
