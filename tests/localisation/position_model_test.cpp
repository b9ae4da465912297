#include "panonav/localisation/position_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/localisation/localiser.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

std::vector<RankedMatch> ranked_matches(const VisualMemory& memory, const PackedSignature& query) {
  return ColumnRanking(memory).rank(
      query, memory.search(query, {.top = PositionModel::max_candidates}).matches);
}

std::optional<PositionEstimate> interpolate(const VisualMemory& memory, const PositionModel& model,
                                            const std::vector<RankedMatch>& matches) {
  return interpolate_position(ColumnRanking(memory), model,
                              ReferenceLayout(memory, model.spacing_m), matches);
}

TEST(InterpolatedPosition, OfAMemorisedViewIsItsPosition) {
  const RememberedRoom place(21, {}, 0.4);
  const PositionModel model = learn_position_model(ColumnRanking(place.memory));
  ASSERT_TRUE(model.learnt);
  for (const ViewId view : place.memory.views()) {
    const auto found = ranked_matches(place.memory, place.memory.packed(view));
    ASSERT_EQ(found[0].match.view, view);
    const auto estimate = interpolate(place.memory, model, found);
    ASSERT_TRUE(estimate);
    EXPECT_NEAR(distance(estimate->position(), place.memory.info(view).pose->position()), 0.0,
                1e-6);
    ASSERT_TRUE(estimate->radius_m);
    EXPECT_GT(*estimate->radius_m, 0.0);
  }
}

TEST(InterpolatedPosition, WeightsSumToOneAndGiveThePosition) {
  const RememberedRoom place(22, {}, 0.4);
  const PositionModel model = learn_position_model(ColumnRanking(place.memory));
  Random random(1);
  for (int i = 0; i < 20; ++i) {
    const Pose2 pose = place.room.between(place.grid, place.step_m, random);
    const PackedSignature query =
        pack(compute_signature(place.room.see(pose)), place.memory.full_scale());
    const auto estimate = interpolate(place.memory, model, ranked_matches(place.memory, query));
    ASSERT_TRUE(estimate);
    double sum = 0.0;
    Point2 mean;
    for (const PositionEstimate::Share& share : estimate->shares) {
      const Point2 p = place.memory.info(share.view).pose->position();
      sum += share.weight;
      mean = {mean.x_m + share.weight * p.x_m, mean.y_m + share.weight * p.y_m};
      EXPECT_LE(distance(p, place.memory.info(estimate->shares[0].view).pose->position()),
                model.neighbourhood_m);
    }
    EXPECT_NEAR(sum, 1.0, 1e-9);
    EXPECT_NEAR(distance(mean, estimate->position()), 0.0, 1e-9);
  }
}

TEST(InterpolatedPosition, BeatsTheNearestReferenceAndItsRadiusHolds95PerCent) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  std::vector<double> nearest_errors;
  std::vector<double> errors;
  int inside = 0;
  for (std::uint64_t seed = 30; seed < 34; ++seed) {
    const RememberedRoom place(seed, {5.0, 4.0, seed % 2 == 0 ? 2 : 8, 0.12}, 0.3);
    const PositionModel model = learn_position_model(ColumnRanking(place.memory));
    Random random(seed, 3);
    for (int i = 0; i < 50; ++i) {
      const Pose2 pose = place.room.between(place.grid, place.step_m, random);
      const PackedSignature query =
          pack(compute_signature(place.room.see(pose, 16, 96, {1.0, 0.01}, random.next())),
               place.memory.full_scale());
      const auto found = ranked_matches(place.memory, query);
      const auto estimate = interpolate(place.memory, model, found);
      ASSERT_TRUE(estimate && estimate->radius_m);
      nearest_errors.push_back(
          distance(place.memory.info(found[0].match.view).pose->position(), pose.position()));
      errors.push_back(distance(estimate->position(), pose.position()));
      inside += errors.back() <= *estimate->radius_m ? 1 : 0;
    }
  }
  EXPECT_LT(order_statistic(errors, 0.5), 0.6 * order_statistic(nearest_errors, 0.5));
  EXPECT_LT(order_statistic(errors, 0.95), order_statistic(nearest_errors, 0.95));
  // 95 % of 200, less three standard errors.
  EXPECT_GE(inside, 180);
}

// A corner of the room is there twice, as in a building whose rooms are furnished alike.
TEST(InterpolatedPosition, PlacesThatLookAlikeWidenTheRadiusThereAndNowhereElse) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const RememberedRoom place(36, {5.0, 4.0, 6, 0.12}, 0.3);
  constexpr double away_m = 30.0;
  constexpr double corner_m = 1.6;
  VisualMemory memory = place.memory;
  Random random(35, 4);
  int twins = 0;
  for (const Point2 p : place.grid) {
    if (p.x_m > corner_m || p.y_m > corner_m) continue;
    const Point2 beside{p.x_m + 0.1, p.y_m + 0.1};
    if (!place.room.is_free(beside)) continue;
    memory.append(compute_signature(place.room.see({beside.x_m, beside.y_m, 1.0}, 16, 96,
                                                   {1.0, 0.01}, random.next())),
                  {"twin_" + std::to_string(twins++),
                   ReferencePose{beside.x_m + away_m, beside.y_m, 1.0},
                   {}});
  }
  ASSERT_GE(twins, 10);
  const ColumnRanking ranking(memory);
  const PositionModel model = learn_position_model(ranking);
  ASSERT_TRUE(model.learnt && model.ambiguous_from);
  std::vector<double> radii;
  std::vector<double> radii_in_the_corner;
  int inside = 0;
  int queries = 0;
  int unstated = 0;
  for (int i = 0; i < 120; ++i) {
    const Pose2 pose = place.room.between(place.grid, place.step_m, random);
    const bool in_the_corner = pose.x_m < corner_m - 0.3 && pose.y_m < corner_m - 0.3;
    const bool beside = pose.x_m < corner_m + 0.6 && pose.y_m < corner_m + 0.6;
    if (beside && !in_the_corner) continue;
    const auto found = ranked_matches(
        memory, pack(compute_signature(place.room.see(pose, 16, 96, {1.0, 0.01}, random.next())),
                     memory.full_scale()));
    const auto estimate = interpolate(memory, model, found);
    ASSERT_TRUE(estimate);
    if (!estimate->radius_m) {  // behind a box, where few views are
      ++unstated;
      continue;
    }
    (in_the_corner ? radii_in_the_corner : radii).push_back(*estimate->radius_m);
    inside += distance(estimate->position(), pose.position()) <= *estimate->radius_m ? 1 : 0;
    ++queries;
  }
  EXPECT_LE(unstated, 0.1 * queries);
  ASSERT_GE(radii.size(), 40U);
  ASSERT_GE(radii_in_the_corner.size(), 3U);
  EXPECT_LT(quantile(radii, 0.5), 2.0 * place.step_m);
  EXPECT_GT(quantile(radii_in_the_corner, 0.5), 0.9 * away_m);
  EXPECT_GE(inside, 0.9 * queries);
}

// Errors beyond the outermost references are several times those between them; one radius for both
// held 65 % at the edge of a hall.
TEST(InterpolatedPosition, TheRadiusIsWiderAtTheEdgeOfWhatIsRemembered) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  struct Held {
    int queries = 0;
    int inside = 0;
  };
  Held between;
  Held beyond;
  int unstated = 0;
  std::vector<double> radii_between;
  std::vector<double> radii_beyond;
  for (std::uint64_t seed = 41; seed < 45; ++seed) {
    const RememberedRoom place(seed, {8.0, 6.0, 4, 0.12}, 0.4);
    constexpr double edge_m = 5.1;
    VisualMemory memory = place.memory;
    std::vector<Point2> kept;
    for (const Point2 p : place.grid) {
      if (p.x_m <= edge_m + 0.01) kept.push_back(p);
    }
    for (const ViewId view : place.memory.views()) {
      if (memory.info(view).pose->x_m > edge_m + 0.01) memory.remove(view);
    }
    const ColumnRanking ranking(memory);
    const PositionModel model = learn_position_model(ranking);
    Random random(seed, 3);
    for (int i = 0; i < 80; ++i) {
      Pose2 pose = place.room.between(kept, place.step_m, random);
      const bool is_beyond = i % 2 == 0;
      if (is_beyond) pose.x_m = edge_m + random.uniform(0.1, 0.9) * place.step_m;
      if (!place.room.is_free(pose.position())) continue;
      const auto found = ranked_matches(
          memory, pack(compute_signature(place.room.see(pose, 16, 96, {1.0, 0.01}, random.next())),
                       memory.full_scale()));
      const auto estimate = interpolate(memory, model, found);
      ASSERT_TRUE(estimate);
      if (!estimate->radius_m) {  // behind a box, where few views are
        ++unstated;
        continue;
      }
      Held& held = is_beyond ? beyond : between;
      ++held.queries;
      held.inside += distance(estimate->position(), pose.position()) <= *estimate->radius_m;
      (is_beyond ? radii_beyond : radii_between).push_back(*estimate->radius_m);
    }
  }
  EXPECT_GT(quantile(radii_beyond, 0.5), 1.3 * quantile(radii_between, 0.5));
  EXPECT_LE(unstated, 0.05 * (between.queries + beyond.queries));
  ASSERT_GE(beyond.queries, 100);
  EXPECT_GE(between.inside, 0.9 * between.queries);
  EXPECT_GE(beyond.inside, 0.8 * beyond.queries);
}

// Where each place has a double that differs in an eighth of its columns, a query tells the two
// apart, but a view left out is nearer to its double than to its neighbours.
TEST(InterpolatedPosition, ADoubleDoesNotWidenTheRadiusWhereQueriesTellItApart) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const Room room(37, {5.0, 4.0, 6, 0.12});
  constexpr double step_m = 0.3;
  constexpr double away_m = 30.0;
  Random random(37, 4);
  const auto seen = [&](Point2 p) {
    return room.see({p.x_m, p.y_m, 0.0}, 16, 96, {1.0, 0.01}, random.next());
  };
  std::vector<FourierSignature> signatures;
  std::vector<std::optional<ReferencePose>> poses;
  const std::vector<Point2> grid = room.grid(step_m);
  for (const bool twin : {false, true}) {
    for (const Point2 p : grid) {
      Panorama view = seen(p);
      for (int y = 0; twin && y < view.rows(); ++y) {
        for (int x = 0; x < view.columns() / 8; ++x) {
          view.at(y, x) = static_cast<float>((x + 3 * y) % 7) / 7.0F;
        }
      }
      signatures.push_back(compute_signature(view));
      poses.push_back(ReferencePose{p.x_m + (twin ? away_m : 0.0), p.y_m, 0.0});
    }
  }
  const VisualMemory memory = make_memory(signatures, poses);
  const ColumnRanking ranking(memory);
  const PositionModel model = learn_position_model(ranking);
  std::vector<double> radii;
  int inside = 0;
  int unstated = 0;
  for (int i = 0; i < 60 + unstated; ++i) {
    const Point2 p = room.between(grid, step_m, random).position();
    const auto found =
        ranked_matches(memory, pack(compute_signature(seen(p)), memory.full_scale()));
    const auto estimate = interpolate(memory, model, found);
    ASSERT_TRUE(estimate);
    if (!estimate->radius_m) {  // behind a box, where few views are
      ++unstated;
      continue;
    }
    radii.push_back(*estimate->radius_m);
    inside += distance(estimate->position(), p) <= *estimate->radius_m;
  }
  EXPECT_LE(unstated, 6);
  EXPECT_LT(quantile(radii, 0.5), 2.0 * step_m);
  EXPECT_GE(inside, 52);
}

/// Stated bounds of a kind, and how many hold.
struct Bounds {
  int stated = 0;
  int held = 0;
  std::vector<double> bounds_m;
  void add(double bound_m, double error_m) {
    ++stated;
    held += error_m <= bound_m ? 1 : 0;
    bounds_m.push_back(bound_m);
  }
};

// The share that holds is at least 90 %, and the 95 % interval (Wilson) of it reaches down to 98 %:
// the bounds are not wider than they need to be.
void expect_calibrated(const Bounds& bounds, const char* what) {
  const double n = bounds.stated;
  const double share = bounds.held / n;
  constexpr double z = 1.96;
  const double low = (share + z * z / (2.0 * n) -
                      z * std::sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n))) /
                     (1.0 + z * z / n);
  std::printf("%s: %d of %d, median %.3f m\n", what, bounds.held, bounds.stated,
              quantile(bounds.bounds_m, 0.5));
  EXPECT_GE(share, 0.9) << what << ": " << bounds.held << " of " << bounds.stated;
  EXPECT_LE(low, 0.98) << what << ": " << bounds.held << " of " << bounds.stated;
}

PackedSignature take_query(const Room& room, const VisualMemory& memory, const Pose2& pose,
                           Random& random) {
  return pack(compute_signature(room.see(pose, 16, 96, {1.0, 0.01}, random.next())),
              memory.full_scale());
}

// A radius of half the diagonal of a square of the grid would tell no more than the best match.
TEST(StatedBounds, InGridsTheRadiusHoldsAndIsFinerThanTheGrid) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  constexpr double half_diagonal_steps = 0.7071;
  Bounds all;
  std::vector<double> errors_m;
  std::vector<double> radii_steps;
  for (std::uint64_t seed = 60; seed < 68; ++seed) {
    const RememberedRoom place(seed, {seed % 2 == 0 ? 5.0 : 7.0, 4.0, seed % 3 == 0 ? 8 : 2, 0.12},
                               seed < 64 ? 0.3 : 0.4);
    const Localiser localiser(place.memory);
    Random random(seed, 3);
    for (int i = 0; i < 50; ++i) {
      const Pose2 pose = place.room.between(place.grid, place.step_m, random);
      const Place found = localiser.localise(take_query(place.room, place.memory, pose, random));
      if (!found.position) continue;
      EXPECT_FALSE(found.position->along_route);
      if (!found.position->radius_m) continue;
      errors_m.push_back(distance(found.position->position(), pose.position()));
      all.add(*found.position->radius_m, errors_m.back());
      radii_steps.push_back(*found.position->radius_m / place.step_m);
    }
  }
  std::printf("grids: %d of %d, median error %.3f m, radius %.3f m\n", all.held, all.stated,
              quantile(errors_m, 0.5), quantile(all.bounds_m, 0.5));
  EXPECT_GE(all.stated, 340);
  EXPECT_GE(all.held, 0.92 * all.stated);
  EXPECT_LT(quantile(radii_steps, 0.5), half_diagonal_steps);
}

// Memorises a straight drive along x, 7.2 m long.
VisualMemory remember_drive(const Room& room, double y_m, double step_m, Random& random) {
  std::vector<FourierSignature> signatures;
  std::vector<std::optional<ReferencePose>> poses;
  for (double x_m = 0.4; x_m < 7.6; x_m += step_m) {
    if (!room.is_free({x_m, y_m})) continue;
    signatures.push_back(
        compute_signature(room.see({x_m, y_m, 0.0}, 16, 96, {1.0, 0.01}, random.next())));
    poses.push_back(ReferencePose{x_m, y_m, 0.0});
  }
  return make_memory(signatures, poses);
}

// Views left out of a drive are never beside it. The radius must grow sideways all the same,
// because it is the distance at which views of the memory differ as much as the query from its best
// match.
TEST(StatedBounds, BesideADriveTheRadiusGrowsAndHolds) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  constexpr double y_m = 2.0;
  Bounds on;
  Bounds beside;
  int answers = 0;
  int within_radius = 0;
  int within_ellipse = 0;
  std::vector<double> near_radii_m;
  std::vector<double> far_radii_m;
  for (std::uint64_t seed = 70; seed < 78; ++seed) {
    const Room room(seed, {8.0, 4.0, seed % 2 == 0 ? 2 : 5, 0.12});
    const double step_m = seed < 74 ? 0.1 : 0.2;
    Random random(seed, 3);
    const VisualMemory memory = remember_drive(room, y_m, step_m, random);
    const Localiser localiser(memory);
    for (int i = 0; i < 90; ++i) {
      const bool is_on = i % 3 == 0;
      const double off_m = is_on ? 0.0 : random.uniform(0.1, 0.5) * (i % 2 == 0 ? 1.0 : -1.0);
      const Pose2 pose{random.uniform(0.5, 7.5), y_m + off_m, random.uniform(-3.0, 3.0)};
      if (!room.is_free(pose.position()) || !room.is_free({pose.x_m, y_m})) continue;
      const Place found = localiser.localise(take_query(room, memory, pose, random));
      if (!found.position) continue;
      const Point2 error{found.position->x_m - pose.x_m, found.position->y_m - pose.y_m};
      ASSERT_TRUE(found.position->radius_m);
      ++answers;
      within_radius += std::hypot(error.x_m, error.y_m) <= *found.position->radius_m ? 1 : 0;
      if (std::abs(off_m) <= 0.1) near_radii_m.push_back(*found.position->radius_m);
      if (std::abs(off_m) >= 0.4) far_radii_m.push_back(*found.position->radius_m);
      const auto [xx, xy, yy] = found.position->covariance();
      constexpr double square_95 = 5.991;  // chi squared, two degrees of freedom
      within_ellipse += yy * error.x_m * error.x_m - 2.0 * xy * error.x_m * error.y_m +
                                    xx * error.y_m * error.y_m <=
                                square_95 * (xx * yy - xy * xy)
                            ? 1
                            : 0;
      if (!found.position->along_route) continue;
      EXPECT_NEAR(found.position->along_route->direction_rad, 0.0, 1e-6);
      EXPECT_NEAR(std::sqrt(xx), found.position->along_route->within_m / 1.96, 1e-6);
      EXPECT_NEAR(std::sqrt(yy), *found.position->radius_m / 1.96, 1e-6);
      EXPECT_NEAR(xy, 0.0, 1e-3);
      (is_on ? on : beside).add(found.position->along_route->within_m, std::abs(error.x_m));
    }
  }
  std::printf(
      "radius holds for %d, ellipse for %d of %d; median %.3f m on the drive, %.3f m beside\n",
      within_radius, within_ellipse, answers, quantile(near_radii_m, 0.5),
      quantile(far_radii_m, 0.5));
  EXPECT_GE(within_radius, 0.92 * answers);
  EXPECT_GE(within_ellipse, 0.92 * answers);
  EXPECT_GT(quantile(far_radii_m, 0.5), 2.0 * quantile(near_radii_m, 0.5));
  EXPECT_GE(on.stated + beside.stated, 9 * answers / 10);
  EXPECT_GE(beside.stated, 100);
  expect_calibrated(on, "on drives");
  expect_calibrated(beside, "beside drives");
}

TEST(ReferenceLayout, TellsAreasEdgesLinesAndBendsApart) {
  const auto layout_of = [](const std::vector<Point2>& positions, Point2 at) {
    const Room room(24, {});
    const FourierSignature view = compute_signature(room.see({1.0, 1.0, 0.0}));
    std::vector<std::optional<ReferencePose>> poses;
    for (const Point2 p : positions) poses.push_back(ReferencePose{p.x_m, p.y_m, {}});
    const VisualMemory memory =
        make_memory(std::vector<FourierSignature>(positions.size(), view), poses);
    return ReferenceLayout(memory, 1.0).around({at, {}});
  };
  std::vector<Point2> grid;
  std::vector<Point2> drive;
  std::vector<Point2> corner;
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 9; ++j) grid.push_back({1.0 * i, 1.0 * j});
    drive.push_back({0.6 * i, 0.8 * i});
    // A robot that stands still adds no area.
    for (int n = 0; n < 5; ++n) drive.push_back({2.4 + 0.01 * n, 3.2 + 0.01 * n});
    corner.push_back({std::min(1.0 * i, 4.0), std::max(0.0, 1.0 * i - 4.0)});
  }
  using Kind = LocalLayout::Kind;
  EXPECT_EQ(layout_of(grid, {4.0, 4.0}).kind, Kind::area);
  EXPECT_EQ(layout_of(grid, {0.0, 4.0}).kind, Kind::edge);
  EXPECT_EQ(layout_of(grid, {0.0, 0.0}).kind, Kind::edge);
  EXPECT_EQ(layout_of(drive, {2.4, 3.2}).kind, Kind::line);
  EXPECT_NEAR(layout_of(drive, {2.4, 3.2}).direction_rad, std::atan2(0.8, 0.6), 1e-2);
  EXPECT_EQ(layout_of(drive, {0.0, 0.0}).kind, Kind::line);
  EXPECT_EQ(layout_of(corner, {4.0, 0.0}).kind, Kind::other);
  EXPECT_EQ(layout_of(corner, {0.0, 0.0}).kind, Kind::line);
}

TEST(PositionModel, OfFewOrUnposedViewsIsTheNearestReference) {
  const RememberedRoom place(23, {}, 0.5);
  std::vector<FourierSignature> views;
  std::vector<std::optional<ReferencePose>> poses;
  for (int i = 0; i < PositionModel::min_views; ++i) {
    views.push_back(place.memory.signature(place.memory.views()[i]));
    poses.push_back(place.memory.info(place.memory.views()[i]).pose);
  }
  poses[3].reset();
  const VisualMemory memory = make_memory(views, poses);
  const PositionModel model = learn_position_model(ColumnRanking(memory));
  EXPECT_FALSE(model.learnt);
  const auto matches_of = [&](std::size_t i) {
    return ranked_matches(memory, memory.packed(memory.views()[i]));
  };
  const auto estimate = interpolate(memory, model, matches_of(1));
  ASSERT_TRUE(estimate);
  EXPECT_EQ(estimate->position(), poses[1]->position());
  EXPECT_FALSE(estimate->radius_m);  // nothing to learn it from
  EXPECT_FALSE(interpolate(memory, model, matches_of(3)));
  EXPECT_FALSE(interpolate(memory, model, {}));
}

TEST(PositionModel, StandsCoincidentAndEqualViews) {
  const Room room(24, {});
  const std::vector<Point2> grid = room.grid(0.5);
  std::vector<FourierSignature> views;
  std::vector<std::optional<ReferencePose>> poses;
  for (int i = 0; i < 30; ++i) {  // a robot that stands still now and then
    const Point2 p = grid[static_cast<std::size_t>(i / 3)];
    views.push_back(compute_signature(room.see({p.x_m, p.y_m, 0.0})));
    poses.push_back(ReferencePose{p.x_m, p.y_m, 0.0});
  }
  const VisualMemory memory = make_memory(views, poses);
  const PositionModel model = learn_position_model(ColumnRanking(memory));
  for (const ViewId view : memory.views()) {
    const auto estimate = interpolate(memory, model, ranked_matches(memory, memory.packed(view)));
    ASSERT_TRUE(estimate);
    EXPECT_NEAR(distance(estimate->position(), memory.info(view).pose->position()), 0.0, 1e-6);
  }
  // All at one place: no spacing, nothing to interpolate.
  for (auto& pose : poses) pose = ReferencePose{1.0, 1.0, 0.0};
  const VisualMemory at_one_place = make_memory(views, poses);
  EXPECT_FALSE(learn_position_model(ColumnRanking(at_one_place)).learnt);
}

TEST(PositionModel, IsTheSameForTheSameSeed) {
  const RememberedRoom place(25, {}, 0.4);
  const PositionModel a = learn_position_model(ColumnRanking(place.memory), {.sampled_views = 15});
  const PositionModel b = learn_position_model(ColumnRanking(place.memory), {.sampled_views = 15});
  EXPECT_EQ(a.sampled_views, 15);
  EXPECT_EQ(a, b);
  EXPECT_EQ(a.neighbourhood_m, b.neighbourhood_m);
  EXPECT_THROW((void)learn_position_model(ColumnRanking(place.memory), {.sampled_views = 0}),
               OptionError);
  EXPECT_THROW((void)ColumnRanking(place.memory, 99), ContractError);
}

}  // namespace
}  // namespace panonav::testing
