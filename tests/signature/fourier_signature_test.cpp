#include "panonav/signature/fourier_signature.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "support/random_views.hpp"

namespace panonav::testing {
namespace {

std::complex<double> coefficient(const FourierSignature& signature, int row, int k) {
  return std::polar(static_cast<double>(signature.magnitude(row, k)),
                    static_cast<double>(signature.phase_rad(row, k)));
}

TEST(FourierSignature, IsTheDiscreteFourierTransformOfEveryRow) {
  for (const int columns : {8, 90, 121, 512}) {
    Random random(static_cast<std::uint64_t>(columns));
    const Panorama view = random_panorama(random, 5, columns);
    const int components = std::min(columns / 2, 20);
    const FourierSignature signature = compute_signature(view, components);
    EXPECT_EQ(signature.shape(), (SignatureShape{5, components}));
    for (int y = 0; y < 5; ++y) {
      for (int k = 0; k < components; ++k) {
        std::complex<double> expected;
        for (int c = 0; c < columns; ++c) {
          expected += 2.0 / columns * view.at(y, c) *
                      std::polar(1.0, -2.0 * std::numbers::pi * k * c / columns);
        }
        EXPECT_LT(std::abs(coefficient(signature, y, k) - expected), 3e-6);
      }
    }
  }
}

TEST(FourierSignature, SynthesisGivesTheRowBack) {
  // I(phi) ~ a_0 / 2 + sum_k A_k cos(k phi + psi_k) is exact for rows without higher frequencies.
  const int columns = 64;
  Random random(3);
  const FourierSignature waves = random_signature(random, {4, 12});
  Panorama view(4, columns, std::nullopt);
  for (int y = 0; y < 4; ++y) {
    for (int c = 0; c < columns; ++c) {
      double value = waves.magnitude(y, 0) / 2.0;
      for (int k = 1; k < 12; ++k) {
        value += waves.magnitude(y, k) * std::cos(k * view.azimuth_rad(c) + waves.phase_rad(y, k));
      }
      view.at(y, c) = static_cast<float>(value);
    }
  }
  const FourierSignature found = compute_signature(view, 20);
  for (int y = 0; y < 4; ++y) {
    for (int k = 0; k < 20; ++k) {
      const std::complex<double> expected = k < 12 ? coefficient(waves, y, k) : 0.0;
      EXPECT_LT(std::abs(coefficient(found, y, k) - expected), 3e-6) << "row " << y << ", k " << k;
    }
  }
}

TEST(FourierSignature, HoldsParseval) {
  // Mean square of a row = (a_0 / 2)^2 + sum of A_k^2 / 2 (+ the component at half the columns,
  // absent here).
  const int columns = 65;
  Random random(4);
  const Panorama view = random_panorama(random, 3, columns);
  const FourierSignature signature = compute_signature(view, columns / 2);
  for (int y = 0; y < 3; ++y) {
    double square = 0.0;
    std::complex<double> last;  // k = 32 is beyond columns / 2 - 1: by the definition
    for (int c = 0; c < columns; ++c) {
      square += static_cast<double>(view.at(y, c)) * view.at(y, c) / columns;
      last += 2.0 / columns * view.at(y, c) *
              std::polar(1.0, -2.0 * std::numbers::pi * 32 * c / columns);
    }
    double sum = std::norm(last) / 2.0 + std::pow(signature.magnitude(y, 0) / 2.0, 2.0);
    for (int k = 1; k < signature.components(); ++k)
      sum += std::pow(signature.magnitude(y, k), 2.0) / 2.0;
    EXPECT_GT(square, 0.1);
    EXPECT_NEAR(sum, square, 1e-5 * square);
  }
}

TEST(FourierSignature, TurningColumnsIsTurningPhases) {
  // [M04 eq. 1]: magnitudes stay, phases move by k times the turn.
  Random random(5);
  for (const int columns : {90, 512}) {
    const Panorama view = random_panorama(random, 7, columns);
    const FourierSignature here = compute_signature(view);
    const FourierSignature other = compute_signature(random_panorama(random, 7, columns));
    for (int trial = 0; trial < 20; ++trial) {
      const int turned =
          1 + static_cast<int>(random.index(static_cast<std::uint64_t>(columns) - 1));
      const FourierSignature there = compute_signature(rotate_columns(view, turned));
      EXPECT_LT(dissimilarity_l1(here, there), 1e-4);
      const FourierSignature predicted = turn(here, 2.0 * std::numbers::pi * turned / columns);
      for (int y = 0; y < 7; ++y) {
        for (int k = 0; k < 15; ++k) {
          EXPECT_LT(std::abs(coefficient(there, y, k) - coefficient(predicted, y, k)), 3e-6);
        }
      }
    }
    EXPECT_GT(dissimilarity_l1(here, other), 1.0);  // guard: other views do differ
  }
}

TEST(FourierSignature, TurnsAddUp) {
  Random random(6);
  const FourierSignature view = random_signature(random, {3, 15});
  const FourierSignature twice = turn(turn(view, 2.5), -4.0);
  const FourierSignature once = turn(view, -1.5);
  for (int y = 0; y < 3; ++y) {
    for (int k = 0; k < 15; ++k) {
      EXPECT_EQ(twice.magnitude(y, k), view.magnitude(y, k));
      EXPECT_LT(std::abs(angle_difference(twice.phase_rad(y, k), once.phase_rad(y, k))), 1e-5);
    }
  }
  EXPECT_THROW(static_cast<void>(turn(view, std::numeric_limits<double>::quiet_NaN())),
               ContractError);
}

TEST(FourierSignature, FewerComponentsAreAPrefix) {
  Random random(7);
  const Panorama view = random_panorama(random, 6, 120);
  const FourierSignature all = compute_signature(view, 40);
  const FourierSignature few = compute_signature(view, 9);
  for (std::size_t i = 0; i < few.shape().size(); ++i) {
    EXPECT_NEAR(few.magnitudes()[i], all.magnitudes()[i], 1e-6);
  }
}

TEST(FourierSignature, TableMadeOnceGivesTheSame) {
  Random random(8);
  const Panorama view = random_panorama(random, 4, 96);
  EXPECT_EQ(compute_signature(view, kernels::RowTransform(96, 15)), compute_signature(view, 15));
  EXPECT_THROW(static_cast<void>(compute_signature(view, kernels::RowTransform(90, 15))),
               ContractError);
}

TEST(FourierSignature, KeepsElevationsAndNegativeMeans) {
  const ElevationBand band{-0.4, 0.6};
  Panorama view(2, 16, band);
  for (float& value : view.values()) value = -0.25F;
  const FourierSignature signature = compute_signature(view, 4);
  EXPECT_EQ(signature.elevations(), band);
  EXPECT_NEAR(signature.magnitude(1, 0), 0.5F, 1e-6F);
  EXPECT_NEAR(std::abs(signature.phase_rad(1, 0)), std::numbers::pi, 1e-6);
  const FourierSignature turned = turn(signature, 1.0);
  EXPECT_EQ(turned.phase_rad(1, 0), signature.phase_rad(1, 0));
}

TEST(FourierSignature, RefusesBrokenInvariants) {
  const auto make = [](SignatureShape shape, std::vector<float> magnitudes,
                       std::vector<float> phases) {
    return FourierSignature(shape, std::move(magnitudes), std::move(phases), std::nullopt);
  };
  EXPECT_NO_THROW(make({1, 2}, {1, 2}, {0, -3}));
  EXPECT_THROW(make({0, 2}, {}, {}), ContractError);
  EXPECT_THROW(make({1, 0}, {}, {}), ContractError);
  EXPECT_THROW(make({1, 2}, {1}, {0, 0}), ContractError);
  EXPECT_THROW(make({1, 2}, {1, 2}, {0}), ContractError);
  EXPECT_THROW(make({1, 2}, {1, -2}, {0, 0}), ContractError);
  EXPECT_THROW(make({1, 2}, {1, std::numeric_limits<float>::quiet_NaN()}, {0, 0}), ContractError);
  EXPECT_THROW(make({1, 2}, {1, std::numeric_limits<float>::infinity()}, {0, 0}), ContractError);
  EXPECT_THROW(make({1, 2}, {1, 2}, {0, 3.2F}), ContractError);
  EXPECT_THROW(make({1, 2}, {1, 0}, {0, 1}), ContractError);
  EXPECT_THROW(static_cast<void>(compute_signature(Panorama(2, 16, std::nullopt), 9)),
               ContractError);
  EXPECT_THROW(static_cast<void>(compute_signature(Panorama(2, 16, std::nullopt), 0)),
               ContractError);
}

TEST(PackedSignature, IsWithinHalfAStepBothWays) {
  Random random(9);
  const float full_scale = 0.9F;
  for (int trial = 0; trial < 20; ++trial) {
    const FourierSignature signature =
        turn(random_signature(random, {11, 15}), random.uniform(-3, 3));
    const PackedSignature packed = pack(signature, full_scale);
    const FourierSignature back = unpack(packed, full_scale, std::nullopt);
    int saturated = 0;
    for (int y = 0; y < 11; ++y) {
      for (int k = 0; k < 15; ++k) {
        if (signature.magnitude(y, k) > full_scale) {
          EXPECT_EQ(back.magnitude(y, k), full_scale);
          ++saturated;
        } else {
          EXPECT_NEAR(back.magnitude(y, k), signature.magnitude(y, k), full_scale / 510 * 1.0001);
        }
        EXPECT_LE(std::abs(angle_difference(back.phase_rad(y, k), signature.phase_rad(y, k))),
                  std::numbers::pi / 256 * 1.0001);
      }
    }
    EXPECT_GT(saturated, 0);
    EXPECT_LT(saturated, 60);
    EXPECT_EQ(pack(back, full_scale), packed);
  }
}

TEST(PackedSignature, EveryByteSurvives) {
  PackedSignature packed{{256, 2}, std::vector<std::uint8_t>(512), std::vector<std::uint8_t>(512)};
  for (int i = 0; i < 256; ++i) {
    packed.magnitudes[i] = static_cast<std::uint8_t>(i);
    packed.magnitudes[256 + i] = 7;
    packed.phases[256 + i] = static_cast<std::uint8_t>(i);
  }
  for (const float full_scale : {1e-3F, 0.7F, 1.0F, 2.0F, 40.0F}) {
    EXPECT_EQ(pack(unpack(packed, full_scale, std::nullopt), full_scale), packed) << full_scale;
  }
}

TEST(PackedSignature, TakesNineteenKilobits) {
  // [M03 table 1]
  Random random(10);
  const PackedSignature packed = pack(random_signature(random, {80, 15}), 1.0F);
  EXPECT_EQ((packed.magnitudes.size() + packed.phases.size()) * 8, 19200U);
}

TEST(PackedSignature, ForgetsThePhaseOfWhatIsPackedAsNothing) {
  const FourierSignature faint({1, 2}, {1e-5F, 0.5F}, {0.0F, 2.0F}, std::nullopt);
  const PackedSignature packed = pack(turn(faint, 0.0), 1.0F);
  EXPECT_EQ(packed.magnitudes[0], 0);
  const FourierSignature faint_wave({1, 2}, {0.5F, 1e-5F}, {0.0F, 2.0F}, std::nullopt);
  EXPECT_EQ(pack(faint_wave, 1.0F).phases[1], 0);
  EXPECT_EQ(unpack(pack(faint_wave, 1.0F), 1.0F, std::nullopt).phase_rad(0, 1), 0.0F);
}

TEST(PackedSignature, RefusesBadScalesAndSizes) {
  Random random(11);
  const FourierSignature signature = random_signature(random, {2, 3});
  for (const float bad : {0.0F, -1.0F, std::numeric_limits<float>::infinity(),
                          std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_THROW(static_cast<void>(pack(signature, bad)), ContractError);
    EXPECT_THROW(static_cast<void>(unpack(pack(signature, 1.0F), bad, std::nullopt)),
                 ContractError);
  }
  PackedSignature cut = pack(signature, 1.0F);
  cut.phases.pop_back();
  EXPECT_THROW(static_cast<void>(unpack(cut, 1.0F, std::nullopt)), ContractError);
}

}  // namespace
}  // namespace panonav::testing
