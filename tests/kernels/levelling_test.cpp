#include "panonav/kernels/levelling.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav::kernels {
namespace {

/// Azimuths all around and their positions in a tilted panorama.
struct Positions {
  explicit Positions(std::size_t count) : rows(count), columns(count) {
    for (std::size_t i = 0; i < count; ++i) {
      azimuths.push_back(2.0 * std::numbers::pi * static_cast<double>(i) /
                         static_cast<double>(count));
      cosines.push_back(std::cos(azimuths.back()));
      sines.push_back(std::sin(azimuths.back()));
    }
  }
  void compute(const TiltedDirections& directions, Instructions set) {
    tilted_positions(directions, cosines, sines, rows, columns, set);
  }
  std::vector<double> azimuths, cosines, sines;
  std::vector<float> rows, columns;
};

TEST(TiltedPositions, AgreeWithTheirDefinitionOnEveryInstructionSet) {
  Random random(4);
  int checked = 0;
  for (int i = 0; i < 40; ++i) {
    // Up to the poles, and upside down.
    const double roll = i % 4 == 0 ? random.uniform(-3.14, 3.14) : random.uniform(-0.5, 0.5);
    const double pitch = random.uniform(-0.5, 0.5);
    const double elevation = i < 2 ? 0.5 * std::numbers::pi : random.uniform(-1.57, 1.57);
    const TiltedDirections d{std::cos(roll),
                             std::sin(roll),
                             std::cos(pitch),
                             std::sin(pitch),
                             std::cos(elevation),
                             std::sin(elevation),
                             0.7,
                             50.0,
                             40.0};
    Positions plain(61);
    plain.compute(d, Instructions::scalar);
    for (std::size_t n = 0; n < plain.azimuths.size(); ++n) {
      const double x = d.flat * std::cos(plain.azimuths[n]);
      const double y = d.flat * std::sin(plain.azimuths[n]);
      const double x_robot = d.cos_pitch * x - d.sin_pitch * d.z;
      const double z_rolled = d.sin_pitch * x + d.cos_pitch * d.z;
      const double y_robot = d.cos_roll * y + d.sin_roll * z_rolled;
      const double z_robot = d.cos_roll * z_rolled - d.sin_roll * y;
      const double row =
          (d.top_rad - std::atan2(z_robot, std::hypot(x_robot, y_robot))) * d.rows_per_rad - 0.5;
      EXPECT_NEAR(plain.rows[n], row, 1e-5);
      const double turned =
          std::remainder(std::atan2(y_robot, x_robot) - plain.azimuths[n], 2.0 * std::numbers::pi);
      EXPECT_NEAR(std::remainder(plain.columns[n] / 40.0 - turned, 2.0 * std::numbers::pi), 0.0,
                  1e-6);
      EXPECT_LE(std::abs(plain.columns[n]), 40.0 * std::numbers::pi + 1e-4);
      ++checked;
    }
    for (const Instructions set : available_instructions()) {
      Positions others(61);
      others.compute(d, set);
      EXPECT_EQ(others.rows, plain.rows) << name(set);
      EXPECT_EQ(others.columns, plain.columns) << name(set);
    }
  }
  EXPECT_EQ(checked, 40 * 61);
}

TEST(SampleTiltedRow, InterpolatesBetweenFourValuesOnEveryInstructionSet) {
  Random random(5);
  int checked = 0;
  for (const std::size_t columns : {std::size_t{4}, std::size_t{24}, std::size_t{77}}) {
    constexpr std::size_t seen_rows = 6;
    std::vector<float> seen(seen_rows * columns), rows(columns), shifts(columns), plain(columns);
    for (float& value : seen) value = static_cast<float>(random.uniform(0.0, 1.0));
    const auto half = 0.5 * static_cast<double>(columns);
    for (std::size_t c = 0; c < columns; ++c) {
      rows[c] = static_cast<float>(random.uniform(-2.0, 8.0));
      shifts[c] = static_cast<float>(random.uniform(-half, half));
    }
    shifts[0] = static_cast<float>(-half);
    shifts[columns - 1] = static_cast<float>(half);
    sample_tilted_row(seen, rows, shifts, plain, Instructions::scalar);
    for (std::size_t c = 0; c < columns; ++c) {
      const double row = std::clamp(static_cast<double>(rows[c]), 0.0, seen_rows - 1.0);
      const double column = static_cast<double>(c + columns) + static_cast<double>(shifts[c]);
      const auto at = [&](double y, double x) {
        const auto clamped = std::min(static_cast<std::size_t>(y), seen_rows - 1);
        return static_cast<double>(seen[clamped * columns + static_cast<std::size_t>(x) % columns]);
      };
      const double down = row - std::floor(row);
      const double right = column - std::floor(column);
      const auto along = [&](double y) {
        return (1.0 - right) * at(y, column) + right * at(y, column + 1.0);
      };
      EXPECT_NEAR(plain[c], (1.0 - down) * along(row) + down * along(row + 1.0), 2e-5) << c;
      ++checked;
    }
    for (const Instructions set : available_instructions()) {
      std::vector<float> values(columns);
      sample_tilted_row(seen, rows, shifts, values, set);
      EXPECT_EQ(values, plain) << name(set);
    }
  }
  EXPECT_EQ(checked, 4 + 24 + 77);
}

TEST(Levelling, RejectsSpansOfDifferentSizes) {
  std::vector<double> three(3), four(4);
  std::vector<float> of_three(3), of_four(4);
  const auto set = Instructions::scalar;
  EXPECT_THROW(tilted_positions({}, three, four, of_three, of_three, set), ContractError);
  EXPECT_THROW(tilted_positions({}, three, three, of_three, of_four, set), ContractError);
  EXPECT_THROW(sample_tilted_row(of_four, of_three, of_three, of_three, set), ContractError);
  EXPECT_THROW(sample_tilted_row(of_four, of_four, of_four, of_three, set), ContractError);
}

}  // namespace
}  // namespace panonav::kernels
