#include "panonav/localisation/internal/view_likelihood.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "support/remembered_worlds.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

double log_ratio(ViewLikelihood& likelihood, const Pose2& pose) {
  Particles particle;
  particle.add(pose, 1.0);
  double ratio = 0.0;
  likelihood.compute_log_ratios(particle, {&ratio, 1});
  return ratio;
}

PackedSignature observed_signature(const RememberedRoom& place, const Pose2& pose) {
  return pack(compute_signature(place.room.see(pose)), place.memory.full_scale());
}

ViewLikelihood make_likelihood(const RememberedRoom& place, bool compass) {
  const auto ranking = std::make_shared<const ColumnRanking>(place.memory);
  return {make_compared_views(ranking), learn_observation_model(*ranking, {.sampled_views = 8}),
          compass};
}

/// Compares the view with the references of every `step`-th site.
void compare_every_nth_site(ViewLikelihood& likelihood, std::uint32_t step) {
  std::vector<std::uint32_t> sites;
  for (std::uint32_t site = 0; site < likelihood.sites().size(); site += step) {
    sites.push_back(site);
  }
  likelihood.compare(sites);
}

/// Views at given positions, of which nothing else is known.
class PositionsOnly final : public ComparedViews {
 public:
  explicit PositionsOnly(std::vector<Point2> positions) : positions_(std::move(positions)) {}
  [[nodiscard]] SignatureShape shape() const override { return {1, 1}; }
  [[nodiscard]] int components() const override { return 0; }
  [[nodiscard]] std::vector<PosedView> posed_views() override {
    std::vector<PosedView> views;
    for (const Point2 p : positions_)
      views.push_back({ViewId{static_cast<std::uint32_t>(views.size())}, {p.x_m, p.y_m, 0.0}});
    return views;
  }
  [[nodiscard]] std::vector<Match> search(const PackedSignature&, int) override { return {}; }
  void load(std::span<const ViewId>, const ProfileCallback&) override {}

 private:
  std::vector<Point2> positions_;
};

TEST(ViewLikelihood, ListsTheNearestSitesOfEachCell) {
  Random random(8);
  int listed = 0;
  int full = 0;
  for (const double range_m : {0.1, 0.7, 5.0}) {
    for (const bool is_line : {false, true}) {
      std::vector<Point2> positions;
      for (int i = 0; i < 300; ++i) {
        positions.push_back({is_line ? 0.1 : random.uniform(-3.0, 3.0), random.uniform(-4.0, 4.0)});
      }
      ObservationModel model;
      model.spacing_m = 0.25;
      model.range_m = range_m;
      const ViewLikelihood likelihood(std::make_unique<PositionsOnly>(positions), model, true);
      const double reach_m = std::max(0.5, std::min(range_m, 1.0)) + 0.5 * model.spacing_m;
      for (int i = 0; i < 200; ++i) {
        const Point2 at{random.uniform(-5.0, 5.0), random.uniform(-6.0, 6.0)};
        const Point2 centre{(std::floor(at.x_m / 0.25) + 0.5) * 0.25,
                            (std::floor(at.y_m / 0.25) + 0.5) * 0.25};
        std::vector<std::pair<float, std::uint32_t>> near;
        for (std::uint32_t s = 0; s < positions.size(); ++s) {
          const double apart_m = distance(centre, positions[s]);
          if (apart_m <= reach_m) near.emplace_back(static_cast<float>(apart_m), s);
        }
        std::ranges::sort(near);
        if (near.size() > 12) near.resize(12);
        std::vector<std::uint32_t> expected;
        for (const auto& [apart_m, site] : near) expected.push_back(site);
        const auto found = likelihood.sites_near(at);
        EXPECT_EQ(std::vector<std::uint32_t>(found.begin(), found.end()), expected);
        listed += expected.empty() ? 0 : 1;
        full += expected.size() == 12 ? 1 : 0;
      }
    }
  }
  EXPECT_GE(listed, 200);
  EXPECT_GE(full, 100);
}

TEST(ObservationModel, LearnsHowLikenessFallsWithDistance) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const RememberedRoom fine(61, {}, 0.25);
  const RememberedRoom coarse(61, {}, 0.5);
  const ObservationModel of_fine = learn_observation_model(ColumnRanking(fine.memory));
  const ObservationModel of_coarse = learn_observation_model(ColumnRanking(coarse.memory));
  EXPECT_NEAR(of_fine.spacing_m, 0.25, 1e-9);
  EXPECT_NEAR(of_coarse.spacing_m, 0.5, 1e-9);
  // The room is the same, so is the range, whatever the grid.
  EXPECT_NEAR(of_coarse.range_m / of_fine.range_m, 1.0, 0.35);
  EXPECT_GT(of_fine.sharpness, 0.0);
  EXPECT_GT(of_fine.far_difference, of_fine.neighbouring_difference);
  EXPECT_GT(of_fine.heading_width_rad, 0.0);
  EXPECT_LE(of_fine.heading_width_rad, 3.0 * std::numbers::pi / 4);

  // Views between the references, which it has not seen, follow the curve on average.
  Random random(9);
  const ColumnRanking ranking(fine.memory);
  double found = 0.0;
  double expected = 0.0;
  const double far = of_fine.far_difference * of_fine.far_difference;
  for (int i = 0; i < 40; ++i) {
    const Pose2 pose = fine.room.between(fine.grid, fine.step_m, random);
    const ColumnProfiles view(observed_signature(fine, pose));
    for (const ViewId reference : fine.memory.views()) {
      const double distance_m =
          distance(fine.memory.info(reference).pose->position(), pose.position());
      if (distance_m > 0.5) continue;
      found += far - std::pow(match_columns(view, *ranking.profiles(reference)).difference, 2);
      expected += far * std::exp(-distance_m / of_fine.range_m);
    }
  }
  EXPECT_NEAR(found / expected, 1.0, 0.2);
}

TEST(ObservationModel, NeedsPlacesToLearnFrom) {
  const Room room(62, {});
  std::vector<FourierSignature> signatures;
  std::vector<std::optional<ReferencePose>> poses;
  for (int i = 0; i < 9; ++i) {
    signatures.push_back(compute_signature(room.see({1.0, 1.0, 0.1 * i})));
    poses.push_back(ReferencePose{1.0, 1.0, 0.1 * i});
  }
  // All in one place.
  EXPECT_THROW((void)learn_observation_model(ColumnRanking(make_memory(signatures, poses))),
               ContractError);
  for (std::size_t i = 0; i < 9; ++i) poses[i].reset();
  EXPECT_THROW((void)learn_observation_model(ColumnRanking(make_memory(signatures, poses))),
               ContractError);
}

TEST(ViewLikelihood, IsGreatestNearTheTruthAndInItsHeading) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const RememberedRoom place(63, {}, 0.3);
  const auto ranking = std::make_shared<const ColumnRanking>(place.memory);
  ViewLikelihood likelihood(make_compared_views(ranking), learn_observation_model(*ranking), true);
  Random random(1);
  int near = 0;
  constexpr int queries = 40;
  for (int i = 0; i < queries; ++i) {
    const Pose2 truth = place.room.between(place.grid, place.step_m, random);
    likelihood.set_view(observed_signature(place, truth));
    compare_every_nth_site(likelihood, 1);
    const double there = log_ratio(likelihood, truth);
    EXPECT_GT(there,
              log_ratio(likelihood, {truth.x_m, truth.y_m, wrap_angle(truth.heading_rad + 1.0)}));
    double best = 0.0;
    Pose2 found;
    for (const Point2 corner : place.grid) {
      for (double dx = -0.15; dx < 0.15; dx += 0.05) {
        for (double dy = -0.15; dy < 0.15; dy += 0.05) {
          const Pose2 pose{corner.x_m + dx, corner.y_m + dy, truth.heading_rad};
          const double value = log_ratio(likelihood, pose);
          if (value > best) {
            best = value;
            found = pose;
          }
        }
      }
    }
    near += distance(found.position(), truth.position()) < place.step_m ? 1 : 0;
  }
  EXPECT_GE(near, queries * 9 / 10);
}

TEST(ViewLikelihood, ManyParticlesGetWhatEachGetsAlone) {
  const RememberedRoom place(64, {}, 0.4);
  ViewLikelihood likelihood = make_likelihood(place, true);
  Random random(2);
  likelihood.set_view(
      observed_signature(place, place.room.between(place.grid, place.step_m, random)));
  compare_every_nth_site(likelihood, 2);
  Particles particles;
  for (int i = 0; i < 500; ++i) {
    particles.add({random.uniform(-3.0, 9.0), random.uniform(-3.0, 9.0),
                   random.uniform(-std::numbers::pi, std::numbers::pi)},
                  1.0);
  }
  particles.add({1e300, -1e300, 0.0}, 1.0);
  std::vector<double> ratios(particles.size());
  likelihood.compute_log_ratios(particles, ratios);
  double highest = 0.0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    EXPECT_EQ(ratios[i], log_ratio(likelihood, particles.pose(i)));
    EXPECT_GE(ratios[i], 0.0);
    highest = std::max(highest, ratios[i]);
  }
  EXPECT_GT(highest, 0.0);
  EXPECT_EQ(ratios.back(), 0.0);

  // In another order they are the same particles, and those of one cell follow each other.
  particles.weight = ratios;
  auto reordered = particles;
  likelihood.reorder_by_cell(reordered);
  likelihood.compute_log_ratios(reordered, ratios);
  for (std::size_t i = 0; i < reordered.size(); ++i) EXPECT_EQ(ratios[i], reordered.weight[i]);
  const auto in_order = [](const Particles& p) {
    std::vector<std::array<double, 4>> rows;
    for (std::size_t i = 0; i < p.size(); ++i) {
      rows.push_back({p.x_m[i], p.y_m[i], p.heading_rad[i], p.weight[i]});
    }
    std::ranges::sort(rows);
    return rows;
  };
  std::set<const std::uint32_t*> begun;
  const std::uint32_t* last = nullptr;
  for (std::size_t i = 0; i < reordered.size(); ++i) {
    const std::uint32_t* const near = likelihood.sites_near(reordered.position(i)).data();
    if (near != last) {
      EXPECT_TRUE(begun.insert(near).second);
    }
    last = near;
  }
  EXPECT_GT(begun.size(), 20U);
  EXPECT_EQ(in_order(reordered), in_order(particles));
}

TEST(ViewLikelihood, WithoutTheCompassHeadingsDoNotCount) {
  const RememberedRoom place(65, {}, 0.4);
  ViewLikelihood likelihood = make_likelihood(place, false);
  Random random(3);
  const Pose2 truth = place.room.between(place.grid, place.step_m, random);
  likelihood.set_view(observed_signature(place, truth));
  compare_every_nth_site(likelihood, 1);
  const double ahead = log_ratio(likelihood, truth);
  EXPECT_GT(ahead, 0.0);
  EXPECT_NEAR(log_ratio(likelihood, {truth.x_m, truth.y_m, wrap_angle(truth.heading_rad + 2.0)}),
              ahead, 1e-6 * ahead);
}

TEST(ViewLikelihood, ANewViewForgetsTheLast) {
  const RememberedRoom place(66, {}, 0.4);
  ViewLikelihood likelihood = make_likelihood(place, true);
  Random random(4);
  const Pose2 truth = place.room.between(place.grid, place.step_m, random);
  likelihood.set_view(observed_signature(place, truth));
  const std::vector<std::uint32_t> twice{0, 0};
  likelihood.compare(twice);
  likelihood.compare(twice);  // once is enough
  EXPECT_EQ(likelihood.compared_sites().size(), 1U);
  EXPECT_TRUE(likelihood.min_difference(likelihood.compared_sites()));
  likelihood.set_view(observed_signature(place, truth));
  EXPECT_FALSE(likelihood.is_compared(0));
  EXPECT_FALSE(likelihood.min_difference(std::vector<std::uint32_t>{0}));
  EXPECT_EQ(log_ratio(likelihood, truth), 0.0);  // nothing compared, nothing explained
}

TEST(ViewLikelihood, FindsTheSitesThatParticlesAreNear) {
  const RememberedRoom place(67, {}, 0.4);
  ViewLikelihood likelihood = make_likelihood(place, true);
  const Point2 here = place.grid[place.grid.size() / 2];
  Particles particles;
  particles.add({here.x_m, here.y_m, 0.0}, 0.9);
  particles.add({here.x_m, here.y_m, 1.0}, 0.1);
  const auto near = likelihood.heaviest_sites(particles, 5, 0.0);
  ASSERT_EQ(near.size(), 5U);
  EXPECT_EQ(std::set<std::uint32_t>(near.begin(), near.end()).size(), 5U);
  const auto around = likelihood.sites_near(here);
  for (const std::uint32_t site : near) EXPECT_NE(std::ranges::find(around, site), around.end());
  EXPECT_LE(around.size(), 12U);
  EXPECT_TRUE(likelihood.sites_near({1e3, 1e3}).empty());
  EXPECT_TRUE(likelihood.heaviest_sites({}, 5, 0.0).empty());
  EXPECT_EQ(likelihood.site_of(place.memory.views()[3]), 3U);
}

TEST(ViewLikelihood, RefusesAViewOfAnotherShape) {
  const RememberedRoom place(68, {}, 0.5);
  ViewLikelihood likelihood = make_likelihood(place, true);
  const auto other = pack(compute_signature(place.room.see({1.0, 1.0, 0.0}, 12)), 1.0F);
  EXPECT_THROW(likelihood.set_view(other), ContractError);
}

}  // namespace
}  // namespace panonav::testing
