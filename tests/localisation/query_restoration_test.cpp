#include "panonav/localisation/internal/query_restoration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/localisation/localiser.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

constexpr ElevationBand band{radians(-30.0), radians(40.0)};
constexpr int rows = 40;
constexpr int columns = 192;
constexpr double step_m = 0.5;

/// A room seen by a robot that tilts, or whose camera is out of focus.
class DisturbedRoom {
 public:
  explicit DisturbedRoom(std::uint64_t seed) : room_(seed, {}), grid_(room_.grid(step_m)) {}

  [[nodiscard]] VisualMemory remember() const {
    std::vector<FourierSignature> signatures;
    std::vector<std::optional<ReferencePose>> poses;
    for (const Point2 p : grid_) {
      signatures.push_back(compute_signature(see({p.x_m, p.y_m, 0.0})));
      poses.emplace_back(ReferencePose{p.x_m, p.y_m, 0.0});
    }
    return make_memory(signatures, poses);
  }
  [[nodiscard]] Pose2 draw_pose(Random& random) const {
    return room_.between(grid_, step_m, random);
  }
  [[nodiscard]] Panorama see(const Pose2& pose) const {
    return room_.panorama(pose, rows, columns, band);
  }
  /// Sees with a tilt that `level_panorama` undoes but for terms of the second order.
  [[nodiscard]] Panorama see_tilted(const Pose2& pose, const Tilt& tilt) const {
    constexpr ElevationBand wide{radians(-44.0), radians(54.0)};
    return level_panorama(room_.panorama(pose, 2 * rows, columns, wide),
                          {-tilt.roll_rad, -tilt.pitch_rad}, rows, band);
  }
  [[nodiscard]] Panorama see_blurred(const Pose2& pose, double blur_rad) const {
    const Panorama sharp = see(pose);
    Panorama blurred(rows, columns, band);
    const double row_rad = (band.top_rad - band.bottom_rad) / rows;
    const double column_rad = 2.0 * std::numbers::pi / columns;
    Panorama along(rows, columns, band);
    const auto weigh = [&](double offset_rad) {
      return static_cast<float>(std::exp(-0.5 * offset_rad * offset_rad / (blur_rad * blur_rad)));
    };
    const int reach = static_cast<int>(3.0 * blur_rad / std::min(row_rad, column_rad));
    float row_sum = 0.0F;
    float column_sum = 0.0F;
    for (int d = -reach; d <= reach; ++d) {
      row_sum += weigh(d * row_rad);
      column_sum += weigh(d * column_rad);
    }
    for (int y = 0; y < rows; ++y) {
      for (int c = 0; c < columns; ++c) {
        for (int d = -reach; d <= reach; ++d) {
          along.at(y, c) +=
              weigh(d * column_rad) / column_sum * sharp.at(y, (c + d + columns) % columns);
        }
      }
    }
    for (int y = 0; y < rows; ++y) {
      for (int c = 0; c < columns; ++c) {
        for (int d = -reach; d <= reach; ++d) {
          blurred.at(y, c) +=
              weigh(d * row_rad) / row_sum * along.at(std::clamp(y + d, 0, rows - 1), c);
        }
      }
    }
    return blurred;
  }

 private:
  Room room_;
  std::vector<Point2> grid_;
};

struct Answers {
  int known = 0;
  int right = 0;  ///< known, and at most half a step from the true position
};

Answers localise_all(const Localiser& localiser, const VisualMemory& memory,
                     const DisturbedRoom& room, int count,
                     const std::function<Panorama(const Pose2&, Random&)>& see) {
  Random random(8);
  Answers answers;
  for (int i = 0; i < count; ++i) {
    const Pose2 pose = room.draw_pose(random);
    const Place found =
        localiser.localise(pack(compute_signature(see(pose, random)), memory.full_scale()));
    answers.known += found.known ? 1 : 0;
    if (found.position && distance(found.position->position(), pose.position()) <= 0.5 * step_m)
      ++answers.right;
  }
  return answers;
}

Tilt draw_tilt(Random& random) {
  const double direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
  return {radians(5.0) * std::cos(direction_rad), radians(5.0) * std::sin(direction_rad)};
}

TEST(QueryRestoration, KnowsOwnPlacesOfATiltedRobotAndNoOthers) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  constexpr int count = 40;
  const DisturbedRoom room(81);
  const DisturbedRoom other(82);
  const VisualMemory memory = room.remember();
  const Localiser localiser(memory);
  const auto see_in = [](const DisturbedRoom& seen) {
    return [&seen](const Pose2& pose, Random& random) {
      return seen.see_tilted(pose, draw_tilt(random));
    };
  };
  const Answers own = localise_all(localiser, memory, room, count, see_in(room));
  EXPECT_GE(own.known, 36);
  EXPECT_GE(own.right, 33);
  // A query of chosen components is compared as it was taken.
  const Localiser unrestored(memory, {.components = memory.shape().components});
  EXPECT_LT(localise_all(unrestored, memory, room, count, see_in(room)).right, own.right - 5);
  EXPECT_EQ(localise_all(localiser, memory, other, count, see_in(other)).known, 0);
}

TEST(QueryRestoration, KnowsOwnPlacesOfACameraOutOfFocusAndNoOthers) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  constexpr int count = 40;
  const DisturbedRoom room(83);
  const DisturbedRoom other(84);
  const VisualMemory memory = room.remember();
  const Localiser localiser(memory);
  const auto see_in = [](const DisturbedRoom& seen) {
    return [&seen](const Pose2& pose, Random&) { return seen.see_blurred(pose, radians(4.0)); };
  };
  const Answers own = localise_all(localiser, memory, room, count, see_in(room));
  EXPECT_GE(own.known, 36);
  EXPECT_GE(own.right, 33);
  EXPECT_EQ(localise_all(localiser, memory, other, count, see_in(other)).known, 0);
}

TEST(QueryRestoration, FindsTheTiltAndTheBlurAndLeavesUndisturbedQueriesAlone) {
  const DisturbedRoom room(86);
  const VisualMemory memory = room.remember();
  const ColumnRanking ranking(memory);
  const auto restore = [&](const Panorama& view) {
    const PackedSignature query = pack(compute_signature(view), memory.full_scale());
    return restore_query({query}, memory,
                         ranking.rank(query, memory.search(query, {.top = 10}).matches));
  };
  int count = 0;
  for (std::size_t i = 0; i < memory.size(); i += memory.size() / 8) {
    const ReferencePose& there = *memory.info(memory.views()[i]).pose;
    const Pose2 pose{there.x_m, there.y_m, 0.7};
    EXPECT_TRUE(restore(room.see({there.x_m, there.y_m, 0.0})).empty());
    const auto blurred = restore(room.see_blurred(pose, radians(4.0)));
    ASSERT_FALSE(blurred.empty());
    EXPECT_NEAR(degrees(blurred.front().blur_rad), 4.0, 1.7);
    EXPECT_EQ(blurred.front().tilt, Tilt{});
    const Tilt tilt{radians(4.0), radians(-3.0)};
    const auto level = restore(room.see_tilted(pose, tilt));
    ASSERT_FALSE(level.empty());
    EXPECT_EQ(level.front().blur_rad, 0.0);
    EXPECT_NEAR(degrees(level.front().tilt.roll_rad), 4.0, 1.5);
    EXPECT_NEAR(degrees(level.front().tilt.pitch_rad), -3.0, 1.5);
    ++count;
  }
  EXPECT_GE(count, 8);
}

TEST(QueryRestoration, BlursSignaturesAsALensBlursPanoramas) {
  const DisturbedRoom room(85);
  Random random(1);
  for (int i = 0; i < 5; ++i) {
    const Pose2 pose = room.draw_pose(random);
    const FourierSignature expected = compute_signature(room.see_blurred(pose, radians(3.0)));
    const FourierSignature sharp = compute_signature(room.see(pose));
    const float full_scale = *std::ranges::max_element(sharp.magnitudes());
    const PackedSignature found = blur(pack(sharp, full_scale), radians(3.0), band);
    const FourierSignature blurred = unpack(found, full_scale, band);
    double error = 0.0;
    double energy = 0.0;
    for (int k = 1; k < expected.components(); ++k) {
      for (int y = 0; y < rows; ++y) {
        const auto a = std::polar(expected.magnitude(y, k), expected.phase_rad(y, k));
        error += std::norm(a - std::polar(blurred.magnitude(y, k), blurred.phase_rad(y, k)));
        energy += std::norm(a);
      }
    }
    EXPECT_LT(error, 1e-3 * energy);
  }
}

TEST(QueryRestoration, BlursProfilesAsItBlursSignatures) {
  const DisturbedRoom room(87);
  Random random(2);
  for (int i = 0; i < 5; ++i) {
    const FourierSignature sharp = compute_signature(room.see(room.draw_pose(random)));
    const PackedSignature view = pack(sharp, *std::ranges::max_element(sharp.magnitudes()));
    for (const double blur_rad : {radians(1.0), radians(4.0)}) {
      const ColumnProfiles expected(blur(view, blur_rad, band));
      const ColumnProfiles found(view, ProfileBlur(rows, band, blur_rad));
      const ColumnProfiles unblurred(view);
      EXPECT_EQ(found.used_bands(), expected.used_bands());
      double error = 0.0;
      double change = 0.0;
      for (std::size_t j = 0; j < expected.values().size(); ++j) {
        error += std::abs(found.values()[j] - expected.values()[j]);
        change += std::abs(unblurred.values()[j] - expected.values()[j]);
      }
      // Signatures are rounded once more: less than a step of the profiles on average.
      EXPECT_LT(error, static_cast<double>(expected.values().size())) << blur_rad;
      EXPECT_LT(error, 0.7 * change) << blur_rad;
    }
    const ProfileBlur other_rows(rows / 2, band, radians(1.0));
    EXPECT_THROW(ColumnProfiles(view, other_rows), ContractError);
  }
}

TEST(QueryRestoration, MovesFeaturesAsItLevelsPanoramas) {
  constexpr Tilt tilt{radians(4.0), radians(-3.0)};
  for (const int column : {10, 60, 100, 150}) {
    Panorama seen(rows, columns, band);
    seen.at(20, column) = 1.0F;
    const Panorama level = level_panorama(seen, tilt);
    const auto brightest = std::ranges::max_element(level.values()) - level.values().begin();
    const LocalFeatures moved = level_features(
        {{rows, columns}, band, {{static_cast<std::uint16_t>(column), 20, {}}}}, tilt);
    ASSERT_EQ(moved.features.size(), 1U);
    EXPECT_NEAR(moved.features[0].row, static_cast<double>(brightest / columns), 1.0);
    EXPECT_NEAR(moved.features[0].column, static_cast<double>(brightest % columns), 1.0);
  }
  // Near the upper edge, the tilt moves some features out of the view.
  EXPECT_TRUE(level_features({{rows, columns}, band, {{0, rows - 1, {}}}}, {0.0, radians(5.0)})
                  .features.empty());
}

}  // namespace
}  // namespace panonav::testing
