#include "panonav/kernels/column_profiles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <tuple>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

constexpr std::size_t columns = matched_reference_columns;
constexpr std::size_t view_size = std::size_t{profile_view_stride} * matched_bands;

/// Random components of some bands, and the waves of 64 components.
struct Components {
  std::vector<float> real, imaginary, cosines, sines;

  explicit Components(Random& random)
      : real(64 * matched_bands),
        imaginary(64 * matched_bands),
        cosines(64 * profile_wave_stride),
        sines(64 * profile_wave_stride) {
    for (auto* part : {&real, &imaginary}) {
      for (float& value : *part) value = static_cast<float>(random.normal(0.0, 20.0));
    }
    for (std::size_t k = 0; k < 64; ++k) {
      for (std::size_t c = 0; c <= columns / 4; ++c) {
        const double angle = 2.0 * std::numbers::pi * static_cast<double>(k * c) / columns;
        cosines[k * profile_wave_stride + c] = static_cast<float>(std::cos(angle));
        sines[k * profile_wave_stride + c] = static_cast<float>(std::sin(angle));
      }
    }
  }
  [[nodiscard]] BandWaves waves(int components, int bands) const {
    return {real.data(), imaginary.data(), cosines.data(), sines.data(), components, bands};
  }
};

float value_at(const std::vector<float>& view, std::size_t band, std::size_t column) {
  return view[band * profile_view_stride + column];
}

TEST(ColumnProfilesKernel, AveragesRowsInBandsOnEveryInstructionSet) {
  Random random(3);
  int checked = 0;
  for (const auto& [rows, components, bands] :
       {std::tuple{80, 15, 16}, {83, 4, 16}, {7, 1, 5}, {3, 2, 1}}) {
    const auto size = static_cast<std::size_t>(rows * components);
    std::vector<std::uint8_t> magnitudes(size), phases(size);
    for (auto* bytes : {&magnitudes, &phases}) {
      for (std::uint8_t& byte : *bytes) byte = static_cast<std::uint8_t>(random.index(256));
    }
    std::vector<std::uint32_t> used;
    for (std::uint32_t y = 0; y < static_cast<std::uint32_t>(rows); ++y) {
      if (y % 10 != 4) used.push_back(y);
    }
    const std::size_t values = 16 * static_cast<std::size_t>(components);
    for (const Instructions set : available_instructions()) {
      std::vector<float> real(values), imaginary(values);
      average_bands(magnitudes, phases, static_cast<std::size_t>(rows), used, bands, real,
                    imaginary, set);
      for (std::size_t k = 0; k < static_cast<std::size_t>(components); ++k) {
        for (std::size_t b = 0; b < static_cast<std::size_t>(bands); ++b) {
          const std::size_t begin = b * used.size() / static_cast<std::size_t>(bands);
          const std::size_t end = (b + 1) * used.size() / static_cast<std::size_t>(bands);
          float cosines = 0.0F;
          float sines = 0.0F;
          for (std::size_t i = begin; i < end; ++i) {
            const std::size_t at = k * static_cast<std::size_t>(rows) + used[i];
            const auto cosine = [](int phase) {
              return static_cast<float>(std::cos(std::numbers::pi * (phase % 256) / 128.0));
            };
            cosines += static_cast<float>(magnitudes[at]) * cosine(phases[at]);
            sines += static_cast<float>(magnitudes[at]) * cosine(phases[at] + 192);
          }
          const float scale = (k == 0 ? 0.5F : 1.0F) / static_cast<float>(end - begin);
          EXPECT_EQ(real[16 * k + b], cosines * scale) << name(set);
          EXPECT_EQ(imaginary[16 * k + b], sines * scale) << name(set);
          ++checked;
        }
      }
    }
  }
  EXPECT_GE(checked, 15 * 16 + 4 * 16 + 5 + 2);
  std::vector<std::uint8_t> bytes(6);
  std::vector<float> values(16);
  const std::vector<std::uint32_t> all{0, 1, 2};
  const std::vector<std::uint32_t> beyond{0, 1, 3};
  const auto average = [&](std::size_t rows, std::span<const std::uint32_t> used, int bands) {
    average_bands(bytes, bytes, rows, used, bands, values, values, Instructions::scalar);
  };
  EXPECT_THROW(average(3, all, 2), ContractError);     // two components
  EXPECT_THROW(average(6, beyond, 4), ContractError);  // more bands than rows
  EXPECT_THROW(average(4, all, 1), ContractError);     // half a component
  EXPECT_THROW(average(3, beyond, 1), ContractError);
  EXPECT_NO_THROW(average(6, beyond, 3));
}

TEST(ColumnProfilesKernel, ReconstructsTheSumOfWavesOnEveryInstructionSet) {
  Random random(1);
  const Components spectra(random);
  int checked = 0;
  for (const auto& [components, bands] : {std::pair{15, 16}, {1, 16}, {64, 16}, {8, 5}, {15, 1}}) {
    std::vector<float> plain(view_size);
    reconstruct_bands(spectra.waves(components, bands), plain, Instructions::scalar);
    for (const Instructions set : available_instructions()) {
      std::vector<float> view(view_size);
      reconstruct_bands(spectra.waves(components, bands), view, set);
      for (std::size_t b = 0; b < static_cast<std::size_t>(bands); ++b) {
        for (std::size_t c = 0; c < columns; ++c) {
          EXPECT_EQ(value_at(view, b, c), value_at(plain, b, c)) << name(set);
          double expected = 0.0;
          for (std::size_t k = 0; k < static_cast<std::size_t>(components); ++k) {
            const double angle = 2.0 * std::numbers::pi * static_cast<double>(k * c) / columns;
            expected +=
                static_cast<double>(spectra.real[k * matched_bands + b]) * std::cos(angle) -
                static_cast<double>(spectra.imaginary[k * matched_bands + b]) * std::sin(angle);
          }
          ASSERT_NEAR(static_cast<double>(value_at(view, b, c)), expected, 1e-3) << name(set);
          ++checked;
        }
      }
    }
  }
  EXPECT_GE(checked, 1000);
}

TEST(ColumnProfilesKernel, DividesColumnsByTheirContrastOnEveryInstructionSet) {
  Random random(2);
  int checked = 0;
  for (const bool is_of_each_column : {true, false}) {
    std::vector<float> view(view_size);
    for (float& value : view) value = static_cast<float>(random.normal(5.0, 3.0));
    const int bands = is_of_each_column ? 16 : 2;
    const ColumnContrast contrast{is_of_each_column, 0.2F, 40.0F};
    std::vector<std::uint8_t> plain(2048, 7);
    std::vector<float> without_means = view;
    subtract_column_means(without_means, bands, Instructions::scalar);
    ASSERT_TRUE(quantise_columns(without_means, bands, contrast, plain, Instructions::scalar));
    double square = 0.0;
    std::vector<double> square_of_column(columns);
    for (std::size_t c = 0; c < columns; ++c) {
      double mean = 0.0;
      for (std::size_t b = 0; b < static_cast<std::size_t>(bands); ++b) {
        const auto value = static_cast<double>(value_at(without_means, b, c));
        mean += value;
        square_of_column[c] += value * value / bands;
      }
      EXPECT_NEAR(mean, 0.0, 1e-4);
      square += square_of_column[c] / columns;
    }
    for (const Instructions set : available_instructions()) {
      std::vector<float> same = view;
      std::vector<std::uint8_t> values(2048, 7);
      subtract_column_means(same, bands, set);
      EXPECT_EQ(same, without_means) << name(set);
      ASSERT_TRUE(quantise_columns(same, bands, contrast, values, set));
      EXPECT_EQ(values, plain) << name(set);
      for (std::size_t b = 0; b < static_cast<std::size_t>(bands); ++b) {
        for (std::size_t c = 0; c < columns; ++c) {
          const double divisor = is_of_each_column
                                     ? std::sqrt(square_of_column[c]) + 0.2 * std::sqrt(square)
                                     : std::sqrt(square);
          const double steps = 40.0 * static_cast<double>(value_at(same, b, c)) / divisor;
          EXPECT_NEAR(values[b * columns + c], 128.0 + std::clamp(steps, -127.0, 127.0), 0.501);
          ++checked;
        }
      }
    }
    EXPECT_EQ(plain.back(), is_of_each_column ? plain.back() : 7);  // bands that are not used
  }
  EXPECT_GE(checked, 1000);
}

TEST(ColumnProfilesKernel, ReportsAViewWithoutContrast) {
  for (const Instructions set : available_instructions()) {
    const std::vector<float> flat(view_size);
    std::vector<std::uint8_t> values(2048, 7);
    EXPECT_FALSE(quantise_columns(flat, 16, {true, 0.2F, 40.0F}, values, set));
    EXPECT_EQ(values, std::vector<std::uint8_t>(2048, 7));
  }
}

TEST(ColumnProfilesKernel, RefusesOtherSizes) {
  Random random(3);
  const Components spectra(random);
  std::vector<float> view(view_size), shorter(view_size - 1);
  std::vector<std::uint8_t> values(2048), fewer(2047);
  const Instructions set = Instructions::scalar;
  EXPECT_THROW(reconstruct_bands(spectra.waves(15, 16), shorter, set), ContractError);
  EXPECT_THROW(reconstruct_bands(spectra.waves(15, 17), view, set), ContractError);
  EXPECT_THROW(subtract_column_means(shorter, 16, set), ContractError);
  EXPECT_THROW((void)quantise_columns(view, 16, {}, fewer, set), ContractError);
}

}  // namespace
}  // namespace panonav::kernels
