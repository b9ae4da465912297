#include "panonav/pipeline/picture_guess.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/panorama/tilt.hpp"
#include "support/mirror_pictures.hpp"

namespace panonav::testing {
namespace {

/// A texture over azimuth and elevation. `turns`: how much of a full turn the width covers.
Image textured_picture(int width, int height, double turns, std::uint64_t seed) {
  Random random(seed, 1);
  std::vector<std::array<double, 4>> waves;
  for (int i = 0; i < 12; ++i) {
    waves.push_back({1.0 + static_cast<double>(random.index(8)), random.uniform(-6.0, 6.0),
                     random.uniform(0.0, 2.0 * std::numbers::pi), random.uniform(5.0, 14.0)});
  }
  Image image(width, height);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const double azimuth = 2.0 * std::numbers::pi * turns * (u + 0.5) / width;
      double value = 120.0;
      for (const auto& [k, by_row, phase, amplitude] : waves) {
        value += amplitude * std::cos(k * azimuth + by_row * v / height + phase);
      }
      image.at(u, v) = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
    }
  }
  return image;
}

PictureGuess guess(const std::vector<Image>& images) {
  Executor executor;
  return guess_pictures(images, executor);
}

TEST(GuessPictures, FindsTheFormsOfOmnidirectionalImages) {
  const PictureGuess sphere = guess({textured_picture(512, 256, 1.0, 1)});
  EXPECT_EQ(sphere.form, PictureForm::sphere);
  ASSERT_TRUE(sphere.source);
  EXPECT_EQ(sphere.source->kind, PictureKind::equirectangular);
  const PictureGuess strip = guess({textured_picture(720, 120, 1.0, 2)});
  EXPECT_EQ(strip.form, PictureForm::strip);
  ASSERT_TRUE(strip.source);
  EXPECT_NEAR(degrees(strip.source->layout.elevations.value().top_rad), 30.0, 1e-9);
  MirrorPicture painted;
  std::vector<Image> rings;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    painted.seed = seed;
    rings.push_back(paint(painted));
  }
  const PictureGuess mirror = guess(rings);
  EXPECT_EQ(mirror.form, PictureForm::mirror);
  ASSERT_TRUE(mirror.source);
  EXPECT_NEAR(mirror.source->camera.value().centre.u_px, painted.centre.u_px, 1.0);
}

TEST(GuessPictures, FindsTwoCircles) {
  Image image = textured_picture(512, 256, 1.0, 3);
  for (int v = 0; v < 256; ++v) {
    for (int u = 0; u < 512; ++u) {
      if (std::hypot(u % 256 - 127.5, v - 127.5) > 127.0) image.at(u, v) = 2;
    }
  }
  EXPECT_EQ(guess({image}).form, PictureForm::two_lenses);
}

TEST(GuessPictures, RefusesImagesThatDoNotShowAllDirections) {
  for (const auto& [width, height, turns] :
       {std::tuple{512, 256, 0.63}, {900, 150, 0.55}, {640, 480, 0.3}, {480, 640, 0.3}}) {
    const PictureGuess refused = guess({textured_picture(width, height, turns, 4)});
    EXPECT_EQ(refused.form, PictureForm::ordinary) << width << " x " << height;
    EXPECT_FALSE(refused.source);
    EXPECT_FALSE(refused.explanation.empty());
  }
  EXPECT_THROW(static_cast<void>(guess({})), ContractError);
}

TEST(GuessPictures, FindsNoSourceWhereTheMirrorMoves) {
  std::vector<Image> rings;
  for (int i = 0; i < 4; ++i) {
    MirrorPicture painted;
    painted.centre.u_px += 14.0 * i;
    painted.seed = static_cast<std::uint64_t>(i + 1);
    rings.push_back(paint(painted));
  }
  const PictureGuess moved = guess(rings);
  EXPECT_FALSE(moved.source) << moved.explanation;
}

/// A room of upright edges, seen by an upright camera.
Panorama upright_edges(std::uint64_t seed) {
  Random random(seed, 2);
  const ElevationBand band{radians(-50.0), radians(50.0)};
  Panorama panorama(160, 512, band);
  float grey = 0.5F;
  for (int c = 0; c < panorama.columns(); ++c) {
    if (random.uniform(0.0, 1.0) < 0.1) grey = static_cast<float>(random.uniform(0.1, 0.9));
    for (int y = 0; y < panorama.rows(); ++y) panorama.at(y, c) = grey;
  }
  return panorama;
}

constexpr ElevationBand kept_band{radians(-25.0), radians(25.0)};

/// Images of as many rooms, taken by cameras with these tilts.
std::vector<Panorama> take_images(const std::vector<Tilt>& tilts) {
  std::vector<Panorama> images;
  for (std::size_t i = 0; i < tilts.size(); ++i) {
    images.push_back(level_panorama(upright_edges(i + 1), tilts[i], 80, kept_band));
  }
  return images;
}

std::optional<Lean> lean_of(const std::vector<Panorama>& images) {
  Executor executor;
  return estimate_lean(images, executor);
}

TEST(EstimateLean, IsThatOfATiltedCamera) {
  for (const double lean_deg : {6.0, 12.0}) {
    const Tilt tilt{radians(lean_deg) * 0.8, radians(lean_deg) * 0.6};
    const auto mounted = lean_of(take_images(std::vector<Tilt>(12, tilt)));
    ASSERT_TRUE(mounted) << lean_deg;
    EXPECT_TRUE(mounted->is_common);
    EXPECT_NEAR(degrees(mounted->rad), lean_deg, lean_deg / 3.0);
    std::vector<Tilt> swaying;
    for (int i = 0; i < 12; ++i) {
      swaying.push_back(
          {radians(lean_deg) * std::cos(2.0 * i), radians(lean_deg) * std::sin(2.0 * i)});
    }
    const auto held = lean_of(take_images(swaying));
    ASSERT_TRUE(held) << lean_deg;
    EXPECT_FALSE(held->is_common);
    EXPECT_NEAR(degrees(held->rad), lean_deg, lean_deg / 3.0);
  }
}

// A lean is stated only if it is significant: not for upright cameras, and not where nothing is
// upright.
TEST(EstimateLean, IsNoneForUprightCamerasAndForNoise) {
  EXPECT_FALSE(lean_of(take_images(std::vector<Tilt>(12))));
  int stated = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed, 7);
    std::vector<Panorama> images;
    for (int i = 0; i < 8; ++i) {
      Panorama noise(32, 128, kept_band);
      for (float& value : noise.values()) value = static_cast<float>(random.uniform(0.0, 1.0));
      images.push_back(std::move(noise));
    }
    stated += lean_of(images) ? 1 : 0;
  }
  EXPECT_LE(stated, 1);
}

TEST(EstimateLean, NeedsEdgesElevationsAndSeveralImages) {
  EXPECT_FALSE(lean_of(std::vector<Panorama>(12, Panorama(80, 512, kept_band))));
  EXPECT_FALSE(lean_of(std::vector<Panorama>(12, Panorama(80, 512, std::nullopt))));
  EXPECT_FALSE(lean_of(take_images(std::vector<Tilt>(7, Tilt{0.2, 0.0}))));
}

TEST(CountCarrierRows, CountsRowsThatLookTheSameEverywhere) {
  Random random(1, 3);
  std::vector<Panorama> panoramas;
  for (int i = 0; i < 12; ++i) {
    Panorama panorama(40, 64, std::nullopt);
    for (float& value : panorama.values()) value = static_cast<float>(random.uniform(0.0, 1.0));
    for (int y = 33; y < 40; ++y) {
      for (int c = 0; c < 64; ++c) {
        panorama.at(y, c) = 0.5F + 0.3F * static_cast<float>(std::sin(0.3 * c + y));
      }
    }
    panoramas.push_back(panorama);
  }
  EXPECT_EQ(count_carrier_rows(panoramas), 7);
  EXPECT_EQ(count_carrier_rows(std::vector<Panorama>(12, panoramas[0])), 40);
  EXPECT_EQ(count_carrier_rows(std::span(panoramas).first(7)), 0) << "too few to tell";
}

}  // namespace
}  // namespace panonav::testing
