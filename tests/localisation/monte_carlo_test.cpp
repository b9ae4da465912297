#include "panonav/localisation/monte_carlo.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/localisation/internal/particle_modes.hpp"
#include "panonav/localisation/internal/position_error.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/simulated_odometry.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

struct Walk {
  std::vector<Pose2> poses;
  std::vector<PackedSignature> views;
  std::vector<Pose2> odometry;  ///< one reading for each pose

  [[nodiscard]] Pose2 step(std::size_t to) const {
    return inverse(odometry[to - 1]) * odometry[to];
  }
};

Walk walk(const RememberedRoom& place, int images, std::uint64_t seed,
          const OdometryNoise& noise = {}, double noise_deviation = 0.01) {
  Random random(seed);
  Walk run;
  const simulation::FreePredicate is_free = [&](Point2 p) { return place.room.is_free(p); };
  run.poses = simulation::random_walk(place.room.between(place.grid, place.step_m, random), is_free,
                                      {.poses = images, .step_m = 0.2}, random);
  for (const Pose2& pose : run.poses) {
    run.views.push_back(
        pack(compute_signature(place.room.see(pose, 16, 96, {1.0, noise_deviation}, random.next())),
             place.memory.full_scale()));
  }
  run.odometry = simulation::simulate_odometry(run.poses, noise, seed);
  return run;
}

/// A filter whose model is learnt from few views: quick, also under a sanitizer.
MonteCarloLocaliser quick_filter(const VisualMemory& memory, const MonteCarloOptions& options = {},
                                 const OdometryNoise& odometry = {}) {
  auto ranking = std::make_shared<const ColumnRanking>(memory);
  const ObservationModel model = learn_observation_model(*ranking, {.sampled_views = 8});
  return {std::move(ranking), model, options, odometry};
}

double error_m(const MonteCarloEstimate& estimate, const Pose2& truth) {
  return estimate.pose ? distance(estimate.pose->position(), truth.position()) : 1e9;
}

TEST(MonteCarlo, FindsItselfFromNothingAndStaysThere) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const RememberedRoom place(71, {}, 0.3);
  const auto ranking = std::make_shared<const ColumnRanking>(place.memory);
  const ObservationModel model = learn_observation_model(*ranking);
  int localised = 0;
  int right = 0;
  int headed = 0;
  int images = 0;
  for (int seed = 1; seed <= 10; ++seed) {
    const Walk run = walk(place, 15, 100 + static_cast<std::uint64_t>(seed));
    MonteCarloLocaliser filter(ranking, model, {.seed = seed});
    for (std::size_t k = 0; k < run.poses.size(); ++k) {
      if (k > 0) filter.move(run.step(k));
      const MonteCarloEstimate found = filter.observe(run.views[k]);
      EXPECT_GE(found.probability, 0.0);
      EXPECT_LE(found.probability, 1.0);
      if (k < 5) continue;
      ++images;
      localised += found.state == LocalisationState::localised ? 1 : 0;
      right += error_m(found, run.poses[k]) < place.step_m ? 1 : 0;
      headed += found.pose && std::abs(angle_difference(found.pose->heading_rad,
                                                        run.poses[k].heading_rad)) < radians(6.0)
                    ? 1
                    : 0;
    }
  }
  EXPECT_GE(images, 80);
  EXPECT_GE(localised, images * 95 / 100);
  EXPECT_GE(right, images * 95 / 100);
  EXPECT_GE(headed, images * 95 / 100);
}

// A robot that stands among views without headings cannot know where it looks.
TEST(MonteCarlo, ReportsAPositionWithoutHeadingWhereViewsHaveNone) {
  const RememberedRoom place(71, {}, 0.3);
  VisualMemory memory = place.memory;
  for (const ViewId view : place.memory.views()) {
    ReferenceInfo info = place.memory.info(view);
    info.pose->heading_rad.reset();
    memory.remove(view);
    memory.append(place.memory.packed(view), info);
  }
  int position_known = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Walk run = walk(place, 1, 200 + seed);
    MonteCarloLocaliser filter = quick_filter(memory);
    MonteCarloLocaliser with_headings = quick_filter(place.memory);
    EXPECT_EQ(with_headings.observe(run.views[0]).state, LocalisationState::localised);
    const MonteCarloEstimate found = filter.observe(run.views[0]);
    if (found.state != LocalisationState::position_known) continue;
    ++position_known;
    EXPECT_FALSE(found.pose);
    ASSERT_TRUE(found.position);
    EXPECT_LT(distance(*found.position, run.poses[0].position()), 2.0 * place.step_m);
    EXPECT_GT(found.modes[0].weight, 0.9);
    EXPECT_GT(found.modes[0].heading_spread_rad, radians(60.0));
  }
  EXPECT_GE(position_known, 4);
}

TEST(MonteCarlo, WeightsSumToOneAndNumbersStayWithinTheirBounds) {
  const RememberedRoom place(72, {}, 0.4);
  MonteCarloLocaliser filter =
      quick_filter(place.memory, {.min_particles = 50, .max_particles = 700});
  EXPECT_EQ(filter.particles().size(), 700U);
  const Walk run = walk(place, 12, 5);
  bool fewer = false;
  for (std::size_t k = 0; k < run.poses.size(); ++k) {
    if (k > 0) filter.move(run.step(k));
    const MonteCarloEstimate found = filter.observe(run.views[k]);
    double sum = 0.0;
    const Particles& particles = filter.particles();
    for (std::size_t i = 0; i < particles.size(); ++i) {
      EXPECT_GE(particles.weight[i], 0.0);
      EXPECT_GE(particles.heading_rad[i], -std::numbers::pi);
      EXPECT_LT(particles.heading_rad[i], std::numbers::pi);
      sum += particles.weight[i];
    }
    EXPECT_NEAR(sum, 1.0, 1e-9);
    EXPECT_GE(filter.particles().size(), 50U);
    EXPECT_LE(filter.particles().size(), 700U);
    EXPECT_GE(found.effective_particles, 1.0 - 1e-9);
    EXPECT_LE(found.effective_particles, found.particles + 1e-6);
    double modes = 0.0;
    for (std::size_t m = 0; m < found.modes.size(); ++m) {
      if (m > 0) {
        EXPECT_LE(found.modes[m].weight, found.modes[m - 1].weight + 1e-12);
      }
      modes += found.modes[m].weight;
    }
    EXPECT_LE(modes, 1.0 + 1e-9);
    fewer |= filter.particles().size() < 200;
  }
  EXPECT_TRUE(fewer);  // a robot that knows where it is needs few
}

TEST(MonteCarlo, SameSeedSameBits) {
  const RememberedRoom place(73, {}, 0.4);
  const Walk run = walk(place, 6, 6);
  const auto bits = [&](int seed) {
    MonteCarloLocaliser filter = quick_filter(place.memory, {.seed = seed});
    for (std::size_t k = 0; k < run.poses.size(); ++k) {
      if (k > 0) filter.move(run.step(k));
      filter.observe(run.views[k]);
    }
    const Particles& held = filter.particles();
    return std::vector{held.x_m, held.y_m, held.heading_rad, held.weight};
  };
  EXPECT_EQ(bits(3), bits(3));
  EXPECT_NE(bits(3), bits(4));
}

// Views that lie elsewhere: an index is opened for each image, and may fail.
TEST(MonteCarlo, ViewsThatAreNotHeldGiveTheSameBitsAndMayComeAndGo) {
  RememberedRoom place(72, {}, 0.4);
  const auto ranking = std::make_shared<const ColumnRanking>(place.memory);
  const ObservationModel model = learn_observation_model(*ranking, {.sampled_views = 8});
  VisualMemory elsewhere = place.memory;
  int opened = 0;
  bool is_reachable = true;
  const auto open_index = [&]() -> std::unique_ptr<ViewIndex> {
    if (!is_reachable) throw FileError("elsewhere", "cannot be reached");
    ++opened;
    return std::make_unique<HeldViewIndex>(elsewhere);
  };
  MonteCarloLocaliser held(ranking, model);
  MonteCarloLocaliser filter(open_index, elsewhere.shape(), model);
  EXPECT_EQ(opened, 1);
  const Walk run = walk(place, 12, 300);
  for (std::size_t k = 0; k < run.poses.size(); ++k) {
    if (k > 0) held.move(run.step(k));
    if (k > 0) filter.move(run.step(k));
    const MonteCarloEstimate expected = held.observe(run.views[k]);
    const MonteCarloEstimate found = filter.observe(run.views[k]);
    EXPECT_EQ(found.pose, expected.pose);
    EXPECT_EQ(found.views_compared, expected.views_compared);
    EXPECT_EQ(filter.particles().weight, held.particles().weight);
  }
  EXPECT_EQ(opened, 1 + static_cast<int>(run.poses.size()));
  const ViewId nearest = filter.find_nearest_view(place.grid[5]);
  EXPECT_EQ(elsewhere.info(nearest).pose->position(), place.grid[5]);

  const MonteCarloEstimate before = filter.estimate();
  is_reachable = false;
  EXPECT_THROW(filter.observe(run.views.back()), FileError);
  EXPECT_THROW(filter.update_views(), FileError);
  EXPECT_EQ(filter.estimate().pose, before.pose);
  is_reachable = true;

  // A view that is gone is not compared, before the filter knows it and after.
  elsewhere.remove(nearest);
  EXPECT_NO_THROW(filter.observe(run.views.back()));
  filter.update_views();
  EXPECT_NE(filter.find_nearest_view(place.grid[5]), nearest);
  EXPECT_EQ(filter.observe(run.views.back()).state, before.state);
  elsewhere = VisualMemory(elsewhere.shape(), elsewhere.full_scale(), elsewhere.elevations());
  EXPECT_THROW(filter.update_views(), ContractError);
  EXPECT_NE(filter.find_nearest_view(place.grid[5]), nearest);
}

TEST(MonteCarlo, IsFoundAgainAfterItWasCarriedAway) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const RememberedRoom place(74, {}, 0.3);
  const auto ranking = std::make_shared<const ColumnRanking>(place.memory);
  const ObservationModel model = learn_observation_model(*ranking);
  const auto images_needed = [&](MonteCarloOptions::Injection injection,
                                 const MonteCarloLocaliser::InjectionRule& rule) {
    std::vector<int> needed;
    for (int seed = 1; seed <= 10; ++seed) {
      const Walk before = walk(place, 6, 200 + static_cast<std::uint64_t>(seed));
      const Walk after = walk(place, 12, 300 + static_cast<std::uint64_t>(seed));
      MonteCarloLocaliser filter(ranking, model, {.injection = injection, .seed = seed});
      filter.set_injection_rule(rule);
      for (std::size_t k = 0; k < before.poses.size(); ++k) {
        if (k > 0) filter.move(before.step(k));
        filter.observe(before.views[k]);
      }
      int last_wrong = -1;
      for (std::size_t k = 0; k < after.poses.size(); ++k) {
        if (k > 0) filter.move(after.step(k));  // nobody tells it of the first one
        if (!(error_m(filter.observe(after.views[k]), after.poses[k]) < place.step_m)) {
          last_wrong = static_cast<int>(k);
        }
      }
      needed.push_back(last_wrong + 2);
    }
    std::ranges::sort(needed);
    return needed;
  };
  // A tenth of the particles around the references whose dissimilarity is within a quarter of the
  // best [M03 section 4.1].
  const MonteCarloLocaliser::InjectionRule topological_rule = [&](const PackedSignature& view,
                                                                  std::size_t particles) {
    MonteCarloLocaliser::InjectedParticles injected;
    injected.count = static_cast<std::size_t>(std::lround(0.1 * static_cast<double>(particles)));
    const auto levels = place.memory.hierarchy(view, 0.25);
    for (const Match& match : levels.back().candidates) injected.around.push_back(match.view);
    return injected;
  };
  const auto explained = images_needed(MonteCarloOptions::Injection::explained, {});
  const auto topological = images_needed(MonteCarloOptions::Injection::none, topological_rule);
  EXPECT_LE(explained[explained.size() / 2], 2);
  EXPECT_LE(explained[explained.size() * 9 / 10 - 1], 8);
  EXPECT_LE(topological[topological.size() / 2], 3);
}

TEST(MonteCarlo, IsLostOutsideAndFoundAgain) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const RememberedRoom place(75, {}, 0.3);
  const RememberedRoom elsewhere(76, {}, 0.5);
  int lost = 0;
  int found_again = 0;
  constexpr int runs = 8;
  for (int seed = 1; seed <= runs; ++seed) {
    const Walk run = walk(place, 20, 400 + static_cast<std::uint64_t>(seed));
    const Walk outside = walk(elsewhere, 10, 500 + static_cast<std::uint64_t>(seed));
    MonteCarloLocaliser filter(place.memory, {.seed = seed});
    for (std::size_t k = 0; k < 8; ++k) {
      if (k > 0) filter.move(run.step(k));
      filter.observe(run.views[k]);
    }
    EXPECT_EQ(filter.estimate().state, LocalisationState::localised);
    MonteCarloEstimate estimate;
    for (std::size_t k = 1; k < outside.poses.size(); ++k) {
      filter.move(outside.step(k));
      // Packed as this memory's views are.
      estimate = filter.observe(
          pack(compute_signature(elsewhere.room.see(outside.poses[k])), place.memory.full_scale()));
    }
    lost += estimate.state == LocalisationState::lost && !estimate.pose ? 1 : 0;
    for (std::size_t k = 8; k < run.poses.size(); ++k) {
      filter.move(run.step(k));
      estimate = filter.observe(run.views[k]);
    }
    found_again += estimate.state == LocalisationState::localised &&
                           error_m(estimate, run.poses.back()) < place.step_m
                       ? 1
                       : 0;
  }
  EXPECT_GE(lost, runs - 1);
  EXPECT_GE(found_again, runs - 1);
}

TEST(MonteCarlo, KnowsItsHeadingAndPlaceWhenTheyAreTold) {
  const RememberedRoom place(77, {}, 0.4);
  const Walk run = walk(place, 2, 7);
  MonteCarloLocaliser filter =
      quick_filter(place.memory, {.min_particles = 300, .max_particles = 300});
  filter.start_globally(0.7);
  for (const double heading_rad : filter.particles().heading_rad) EXPECT_EQ(heading_rad, 0.7);
  filter.start_at(run.poses[0], 0.05, 0.02);
  EXPECT_EQ(filter.particles().size(), 300U);
  const MonteCarloEstimate before = filter.estimate();
  ASSERT_TRUE(before.pose);
  EXPECT_LT(error_m(before, run.poses[0]), 0.02);
  EXPECT_NEAR(before.modes[0].spread_m, 0.05 * std::numbers::sqrt2, 0.01);
  EXPECT_EQ(before.state, LocalisationState::localised);
}

TEST(MonteCarlo, BlindStretchesWidenTheCloudAndTheNextImageNarrowsIt) {
  const RememberedRoom place(78, {}, 0.3);
  const Walk run = walk(place, 14, 8, {.translation_from_translation = 0.1});
  MonteCarloLocaliser filter = quick_filter(
      place.memory, {}, {.translation_from_translation = 0.1, .rotation_from_translation = 0.1});
  filter.start_at(run.poses[0], 0.05, 0.05);
  filter.observe(run.views[0]);
  const double before = filter.estimate().spread_m;
  for (std::size_t k = 1; k < 13; ++k) filter.move(run.step(k));
  EXPECT_GT(filter.estimate().spread_m, 2.0 * before);
  filter.move(run.step(13));
  const MonteCarloEstimate after = filter.observe(run.views[13]);
  EXPECT_LT(after.modes.at(0).spread_m, 0.5 * filter.model().spacing_m);
  EXPECT_LT(error_m(after, run.poses[13]), place.step_m);
}

// A filter that is linear, so that its true covariance is known from many runs: the particles'
// variance is that of a Kalman filter which weighs views by `share`.
TEST(MonteCarlo, TheStatedCovarianceIsThatOfErrorsThatResembleEachOther) {
  constexpr int runs = 20000;
  constexpr int images = 25;
  constexpr double view_m2 = 0.04;  // of each of x and y
  constexpr double odometry_m2 = 0.0002;
  constexpr double scale = 0.05;
  constexpr double correlation = 0.7;
  constexpr double share = 1.0 - correlation;
  const Pose2 step{0.25, 0.0, 0.1};

  PositionError stated;
  stated.begin(2.0 * view_m2);
  std::vector<double> kept;
  double particles_m2 = view_m2;
  for (int i = 1; i < images; ++i) {
    stated.move(step);
    const double before_m2 = particles_m2 + odometry_m2;
    particles_m2 = 1.0 / (1.0 / before_m2 + share / view_m2);
    kept.push_back(particles_m2 / before_m2);
    stated.observe(2.0 * before_m2, 2.0 * particles_m2, share, correlation, 1e9);
  }
  Random random(5);
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  double heading_rad = 0.0;
  for (int r = 0; r < runs; ++r) {
    const double wrong_scale = random.normal(0.0, scale);
    Point2 view{random.normal(0.0, std::sqrt(view_m2)), random.normal(0.0, std::sqrt(view_m2))};
    Point2 error = view;
    heading_rad = 0.0;
    for (const double k : kept) {
      error.x_m += wrong_scale * step.x_m * std::cos(heading_rad);
      error.y_m += wrong_scale * step.x_m * std::sin(heading_rad);
      heading_rad += step.heading_rad;
      const double fresh = std::sqrt(view_m2 * (1.0 - correlation * correlation));
      view.x_m = correlation * view.x_m + random.normal(0.0, fresh);
      view.y_m = correlation * view.y_m + random.normal(0.0, fresh);
      const double deviation = std::sqrt(odometry_m2);
      error.x_m = k * (error.x_m + random.normal(0.0, deviation)) + (1.0 - k) * view.x_m;
      error.y_m = k * (error.y_m + random.normal(0.0, deviation)) + (1.0 - k) * view.y_m;
    }
    xx += error.x_m * error.x_m / runs;
    xy += error.x_m * error.y_m / runs;
    yy += error.y_m * error.y_m / runs;
  }
  const std::array<double, 9> particles{particles_m2, 0, 0, 0, particles_m2, 0, 0, 0, 0.01};
  const auto covariance = stated.corrected_covariance(particles, heading_rad, scale);
  EXPECT_NEAR(covariance[0], xx, 0.04 * xx);
  EXPECT_NEAR(covariance[1], xy, 0.04 * xx);
  EXPECT_NEAR(covariance[4], yy, 0.04 * yy);
  EXPECT_EQ(covariance[8], 0.01);
  EXPECT_GT(xx + yy, 2.6 * particles_m2);  // what the particles alone would say is 2
}

TEST(MonteCarlo, SuccessiveViewsThatResembleEachOtherMakeThePositionLessSure) {
  const RememberedRoom place(78, {}, 0.3);
  const Walk run = walk(place, 8, 9);
  MonteCarloLocaliser filter =
      quick_filter(place.memory, {.min_particles = 1000, .max_particles = 1000});
  const auto ratio = [&] {
    const PoseBins bins{.cell_m = filter.model().spacing_m, .headings = 24};
    const PoseMode stated = filter.estimate().modes.at(0);
    const PoseMode particles = find_modes(filter.particles(), bins).modes.at(0);
    EXPECT_EQ(stated.heading_spread_rad, particles.heading_spread_rad);
    EXPECT_NEAR(stated.spread_m, std::sqrt(stated.covariance[0] + stated.covariance[4]), 1e-12);
    return stated.spread_m / particles.spread_m;
  };
  filter.observe(run.views[0]);
  EXPECT_NEAR(ratio(), 1.0, 1e-9);
  for (std::size_t k = 1; k < run.poses.size(); ++k) {
    filter.move(run.step(k));
    filter.observe(run.views[k]);
  }
  EXPECT_GT(ratio(), 1.05);
  EXPECT_LT(ratio(), 2.0);
}

TEST(MonteCarlo, WorksWithoutHeadingsInTheMemory) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const RememberedRoom posed(80, {}, 0.3);
  std::vector<FourierSignature> signatures;
  std::vector<std::optional<ReferencePose>> poses;
  for (const ViewId view : posed.memory.views()) {
    signatures.push_back(posed.memory.signature(view));
    const auto pose = *posed.memory.info(view).pose;
    poses.push_back(ReferencePose{pose.x_m, pose.y_m, std::nullopt});
  }
  const VisualMemory memory = make_memory(signatures, poses);
  int right = 0;
  constexpr int runs = 6;
  for (int seed = 1; seed <= runs; ++seed) {
    const Walk run = walk(posed, 15, 600 + static_cast<std::uint64_t>(seed));
    MonteCarloLocaliser filter(memory, {.seed = seed});
    MonteCarloEstimate found;
    for (std::size_t k = 0; k < run.poses.size(); ++k) {
      if (k > 0) filter.move(run.step(k));
      found = filter.observe(
          pack(compute_signature(posed.room.see(run.poses[k])), memory.full_scale()));
    }
    right += error_m(found, run.poses.back()) < posed.step_m ? 1 : 0;
  }
  EXPECT_GE(right, runs - 1);
}

TEST(MonteCarlo, RefusesWhatMakesNoSense) {
  const RememberedRoom place(81, {}, 0.5);
  EXPECT_THROW(quick_filter(place.memory, {.min_particles = 10, .max_particles = 5}),
               ContractError);
  EXPECT_THROW(quick_filter(place.memory, {.min_particles = 0}), OptionError);
  EXPECT_THROW(quick_filter(place.memory, {}, {.translation_from_translation = -1.0}), OptionError);
  MonteCarloLocaliser filter = quick_filter(place.memory);
  EXPECT_THROW(filter.observe(pack(compute_signature(place.room.see({1.0, 1.0, 0.0}, 12)), 1.0F)),
               ContractError);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(filter.move({nan, 0.0, 0.0}), ContractError);
  for (const double bad : {-0.1, nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(filter.spread(bad, 0.1), ContractError);
    EXPECT_THROW(filter.spread(0.1, bad), ContractError);
  }
}

}  // namespace
}  // namespace panonav::testing
