// The real recordings: figures that the project promises, and the figures of interpolation and of
// unknown places.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/localisation/localiser.hpp"
#include "support/recordings.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

struct Part {
  std::vector<FourierSignature> signatures;
  std::vector<std::optional<ReferencePose>> poses;
};

Part part_of(const Recording& recording, const std::function<bool(std::size_t)>& chosen) {
  Part part;
  for (std::size_t i = 0; i < recording.views.size(); ++i) {
    if (!chosen(i)) continue;
    part.signatures.push_back(compute_signature(recording.views[i]));
    part.poses.push_back(recording.poses[i]);
  }
  return part;
}

// Every view of the part, turned and with noise and light that the memory never saw.
std::vector<FourierSignature> disturbed(const Recording& recording,
                                        const std::function<bool(std::size_t)>& chosen) {
  Random random(5);
  std::vector<FourierSignature> views;
  for (std::size_t i = 0; i < recording.views.size(); ++i) {
    if (!chosen(i)) continue;
    Panorama view = rotate_columns(recording.views[i],
                                   static_cast<int>(random.index(recording.views[i].columns())));
    const double light = random.uniform(0.8, 1.2);
    for (float& value : view.values()) {
      value = static_cast<float>(std::clamp(light * value + 0.02 * random.normal(), 0.0, 1.0));
    }
    views.push_back(compute_signature(view));
  }
  return views;
}

double known_share(const Localiser& localiser, const VisualMemory& memory,
                   const std::vector<FourierSignature>& queries) {
  int known = 0;
  for (const auto& query : queries)
    known += localiser.localise(pack(query, memory.full_scale())).known ? 1 : 0;
  return static_cast<double>(known) / static_cast<double>(queries.size());
}

struct PositionErrors {
  std::vector<double> nearest_m, interpolated_m;
  double inside = 0.0;  // share within the stated bound
};

PositionErrors position_errors(const Part& memorised, const Part& queried) {
  const VisualMemory memory = make_memory(memorised.signatures, memorised.poses);
  const Localiser localiser(memory);
  PositionErrors errors;
  int stated = 0;
  for (std::size_t i = 0; i < queried.signatures.size(); ++i) {
    const Place found = localiser.localise(pack(queried.signatures[i], memory.full_scale()));
    const Point2 truth = queried.poses[i]->position();
    errors.nearest_m.push_back(
        distance(memory.info(found.matches[0].view).pose->position(), truth));
    if (!found.position) continue;
    errors.interpolated_m.push_back(distance(found.position->position(), truth));
    if (const auto& radius_m = found.position->radius_m) {
      ++stated;
      errors.inside += errors.interpolated_m.back() <= *radius_m ? 1.0 : 0.0;
    } else if (const auto& along = found.position->along_route) {
      const double x_m = found.position->x_m - truth.x_m;
      const double y_m = found.position->y_m - truth.y_m;
      const double along_m =
          x_m * std::cos(along->direction_rad) + y_m * std::sin(along->direction_rad);
      ++stated;
      errors.inside += std::abs(along_m) <= along->within_m ? 1.0 : 0.0;
    }
  }
  errors.inside /= stated;
  return errors;
}

bool even_column(const Recording& gantry, std::size_t i) {
  return (std::lround(gantry.poses[i]->x_m / 0.1) + std::lround(gantry.poses[i]->y_m / 0.1)) % 2 ==
         0;
}

TEST(SussexRoute, InterpolationBeatsTheNearestReference) {
  const auto route = sussex_route();
  PANONAV_REQUIRE_DATA(route, "sussex_route");
  const auto remainder = [&](std::size_t i, int divisor) {
    return trailing_number(route->files[i]) % divisor;
  };
  const PositionErrors errors =
      position_errors(part_of(*route, [&](std::size_t i) { return remainder(i, 2) == 0; }),
                      part_of(*route, [&](std::size_t i) { return remainder(i, 2) == 1; }));
  ASSERT_EQ(errors.nearest_m.size(), 227U);
  ASSERT_GE(errors.interpolated_m.size(), 216U);
  EXPECT_LE(quantile(errors.nearest_m, 0.5), 0.03);
  EXPECT_LE(quantile(errors.nearest_m, 0.95), 0.09);
  EXPECT_LT(quantile(errors.interpolated_m, 0.5), quantile(errors.nearest_m, 0.5));
  EXPECT_LT(quantile(errors.interpolated_m, 0.95), quantile(errors.nearest_m, 0.95));
  EXPECT_GE(errors.inside, 0.93);
  // The same with five times sparser references, where there is more to gain.
  const PositionErrors sparse =
      position_errors(part_of(*route, [&](std::size_t i) { return remainder(i, 10) == 0; }),
                      part_of(*route, [&](std::size_t i) { return remainder(i, 10) == 5; }));
  EXPECT_LT(quantile(sparse.interpolated_m, 0.5), 0.7 * quantile(sparse.nearest_m, 0.5));
  EXPECT_LT(quantile(sparse.interpolated_m, 0.95), quantile(sparse.nearest_m, 0.95));
}

TEST(GantryPlants, InterpolationHalvesTheErrorBetweenReferences) {
  const auto gantry = gantry_plants();
  PANONAV_REQUIRE_DATA(gantry, "gantry_plants");
  // Every second place of the grid is remembered, so that each place asked for lies 0.1 m from up
  // to four references.
  const PositionErrors errors =
      position_errors(part_of(*gantry, [&](std::size_t i) { return even_column(*gantry, i); }),
                      part_of(*gantry, [&](std::size_t i) { return !even_column(*gantry, i); }));
  ASSERT_EQ(errors.nearest_m.size(), 99U);
  ASSERT_GE(errors.interpolated_m.size(), 94U);
  EXPECT_LE(quantile(errors.interpolated_m, 0.5), 0.5 * quantile(errors.nearest_m, 0.5) + 1e-9);
  EXPECT_GE(errors.inside, 0.93);
}

TEST(GantryPlants, AbsoluteHeadingBetweenReferences) {
  const auto gantry = gantry_plants();
  PANONAV_REQUIRE_DATA(gantry, "gantry_plants");
  const Part memorised = part_of(*gantry, [&](std::size_t i) { return even_column(*gantry, i); });
  const Part queried = part_of(*gantry, [&](std::size_t i) { return !even_column(*gantry, i); });
  const VisualMemory memory = make_memory(memorised.signatures, memorised.poses);
  const Localiser localiser(memory);
  std::vector<double> errors;
  for (const auto& query : queried.signatures) {
    const Place found = localiser.localise(pack(query, memory.full_scale()));
    if (found.heading_rad) errors.push_back(std::abs(angle_difference(*found.heading_rad, 0.0)));
  }
  ASSERT_GE(errors.size(), 94U);
  EXPECT_LE(quantile(errors, 0.5), radians(1.7));
  EXPECT_LE(quantile(errors, 0.95), radians(5.0));
}

TEST(IndoorWalk, EveryTurnedImageFindsItselfAndItsTurn) {
  const auto walk = indoor_walk({20, 256});
  PANONAV_REQUIRE_DATA(walk, "indoor_walk_360");
  const Part all = part_of(*walk, [](std::size_t) { return true; });
  const VisualMemory memory = make_memory(all.signatures, all.poses);
  const Localiser localiser(memory);
  Random random(6);
  for (std::size_t i = 0; i < all.signatures.size(); ++i) {
    const double turned_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    const Place found =
        localiser.localise(pack(turn(all.signatures[i], turned_rad), memory.full_scale()));
    EXPECT_EQ(found.matches[0].view, memory.views()[i]);
    EXPECT_NEAR(angle_difference(*found.matches[0].heading_rad, turned_rad), 0.0, radians(0.5));
    EXPECT_TRUE(found.known);
    EXPECT_FALSE(found.position);
  }
}

// Each recording remembers a part of itself; it is asked for the rest of itself, with noise, light
// and turns, and for the two other recordings. All are brought to one shape.
TEST(UnknownPlaces, OtherRecordingsAreRefusedAndOwnOnesKnown) {
  const PanoramaShape shape{20, 120};
  const auto gantry = gantry_plants(shape);
  const auto route = sussex_route(shape);
  const auto walk = indoor_walk(shape);
  PANONAV_REQUIRE_DATA(gantry && route && walk, "gantry_plants, sussex_route and indoor_walk_360");
  const auto all = [](std::size_t) { return true; };
  struct Case {
    const char* name;
    const Recording* recording;
    std::function<bool(std::size_t)> memorised, queried;
  };
  const std::vector<Case> cases = {
      {"gantry_plants", &*gantry, [&](std::size_t i) { return even_column(*gantry, i); },
       [&](std::size_t i) { return !even_column(*gantry, i); }},
      {"sussex_route", &*route,
       [&](std::size_t i) { return trailing_number(route->files[i]) % 2 == 0; },
       [&](std::size_t i) { return trailing_number(route->files[i]) % 2 == 1; }},
      {"sussex_route, sparse", &*route,
       [&](std::size_t i) { return trailing_number(route->files[i]) % 10 == 0; },
       [&](std::size_t i) { return trailing_number(route->files[i]) % 10 == 5; }},
      // Its images stand far apart: its own places are its own images.
      {"indoor_walk_360", &*walk, all, all}};
  for (const Case& c : cases) {
    const Part memorised = part_of(*c.recording, c.memorised);
    const VisualMemory memory = make_memory(memorised.signatures, memorised.poses);
    const Localiser localiser(memory);
    EXPECT_GE(known_share(localiser, memory, part_of(*c.recording, c.queried).signatures), 0.95)
        << c.name;
    EXPECT_GE(known_share(localiser, memory, disturbed(*c.recording, c.queried)), 0.95) << c.name;
    for (const Case& other : cases) {
      if (other.recording == c.recording) continue;
      EXPECT_LE(known_share(localiser, memory, part_of(*other.recording, all).signatures), 0.01)
          << c.name << " asked for " << other.name;
    }
  }
}

}  // namespace
}  // namespace panonav::testing
