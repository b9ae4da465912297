#include "panonav/localisation/memory_update.hpp"

#include "panonav/localisation/internal/pose_witness.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/signature/fourier_signature.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::testing {
namespace {

constexpr double spacing_m = 0.5;
const RoomKind empty_room{5.0, 4.0, 0, 0.15};

/// Witnesses each `step_m` along the x axis around a picture at x = 2, as true as odometry from
/// elsewhere, which is turned by `frame_rad`.
std::vector<PoseWitness> witnesses_along(double step_m, int count, double frame_rad = 0.0) {
  std::vector<PoseWitness> witnesses;
  const Pose2 frame{3.0, -1.0, frame_rad};
  for (int i = -count; i <= count; ++i) {
    if (i == 0) continue;
    const Pose2 there{2.0 + step_m * i, 1.0, 0.0};
    witnesses.push_back({inverse(frame) * there, there, 0.1, step_m * std::abs(i)});
  }
  return witnesses;
}
const Pose2 here{2.0, 1.0, 0.0};

std::optional<Pose2> pose_by(const std::vector<PoseWitness>& witnesses, double frame_rad = 0.0) {
  return find_witnessed_pose(inverse(Pose2{3.0, -1.0, frame_rad}) * here, witnesses, std::nullopt,
                             spacing_m);
}

TEST(WitnessedPose, IsThatOfAgreeingAnswersInAnyFrameOfTheOdometry) {
  for (const double frame_rad : {0.0, 1.0, -3.0}) {
    const auto pose = pose_by(witnesses_along(0.4, 3, frame_rad), frame_rad);
    ASSERT_TRUE(pose);
    EXPECT_LT(distance(pose->position(), here.position()), 1e-9);
    EXPECT_NEAR(pose->heading_rad, 0.0, 1e-9);
  }
}

TEST(WitnessedPose, IsEmptyWhereAnswersAreFewOrStandTogetherOrDisagree) {
  EXPECT_FALSE(pose_by(witnesses_along(0.6, 1)));  // two
  EXPECT_FALSE(pose_by(witnesses_along(0.1, 3)));  // within 0.6 m
  auto carried_away = witnesses_along(0.4, 3);
  for (std::size_t i = 4; i < carried_away.size(); ++i) carried_away[i].pose.y_m += 3.0;
  EXPECT_FALSE(pose_by(carried_away));
  // A camera that was turned: answers are turned, and motion leads elsewhere than they say.
  auto turned = witnesses_along(0.4, 3);
  for (PoseWitness& witness : turned) witness.pose.heading_rad = 0.7;
  EXPECT_FALSE(pose_by(turned));
}

TEST(WitnessedPose, OneWrongAnswerOfManyIsLeftOut) {
  auto witnesses = witnesses_along(0.4, 4);
  witnesses[2].pose.x_m += 2.0;
  const auto pose = pose_by(witnesses);
  ASSERT_TRUE(pose);
  EXPECT_LT(distance(pose->position(), here.position()), 1e-9);
  witnesses[5].pose.y_m -= 2.0;  // two of eight are too many
  EXPECT_FALSE(pose_by(witnesses));
}

PackedSignature seen(const Room& room, const Pose2& pose, const VisualMemory& memory) {
  return pack(compute_signature(room.see(pose)), memory.full_scale());
}

std::vector<Pose2> line() {
  std::vector<Pose2> poses;
  for (double x_m = 0.5; x_m < 4.6; x_m += 0.25) poses.push_back({x_m, 1.85, 0.0});
  return poses;
}

/// A run along the line. In pictures 6 to 9 `changed` is seen, whose places are known from the
/// second run on.
MemoryUpdate::Changes run(const Room& room, const Room* changed, const VisualMemory& memory,
                          const MemoryUpdate::UseStatistics& use,
                          const MemoryUpdateOptions& options = {}, double sure = 1.0) {
  const ColumnRanking ranking(memory);
  MemoryUpdate update(ranking, learn_observation_model(ranking), use, options);
  const std::vector<Pose2> poses = line();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const bool is_changed = changed != nullptr && i >= 6 && i < 10;
    MemoryUpdate::LocalisedView view{Pose2{5.0, 5.0, 2.0} * poses[i],
                                     seen(is_changed ? *changed : room, poses[i], memory), sure,
                                     std::nullopt, std::nullopt};
    if (is_changed && use.runs == 0) {
      view.probability = 0.0;
    } else {
      view.pose = poses[i];
    }
    update.add(std::move(view));
  }
  return update.finish();
}

/// Applies what a run changes, as a memory file would.
MemoryUpdate::UseStatistics apply(const Room& room, const MemoryUpdate::Changes& changes,
                                  VisualMemory& memory) {
  MemoryUpdate::UseStatistics use = changes.use;
  for (const auto* views : {&changes.replaced, &changes.forgotten}) {
    for (const ViewId view : *views) memory.remove(view);
  }
  for (const auto& [number, pose] : changes.added) {
    const ViewId view =
        memory.append(seen(room, line()[number], memory),
                      {std::to_string(use.runs) + " " + std::to_string(number), pose, {}});
    use.views[view] = {.last_run = use.runs, .learnt = true};
  }
  use.size = static_cast<int>(memory.size());
  return use;
}

TEST(MemoryUpdate, WhatIsAsRememberedIsReinforcedAndNothingElseChanges) {
  const RememberedRoom place(31, empty_room, spacing_m);
  const MemoryUpdate::Changes changes = run(place.room, nullptr, place.memory, {});
  EXPECT_EQ(changes.certain, line().size());
  EXPECT_GE(changes.matched.size(), 8U);
  EXPECT_TRUE(changes.added.empty());
  EXPECT_TRUE(changes.replaced.empty());
  EXPECT_TRUE(changes.forgotten.empty());
  for (const ViewId view : changes.matched) EXPECT_EQ(changes.use.views.at(view).matched, 1);
}

TEST(MemoryUpdate, AnotherAppearanceStandsBesideTheFormerAndServesTheNextRun) {
  const RememberedRoom place(32, empty_room, spacing_m);
  const Room changed(77, empty_room);
  VisualMemory memory = place.memory;
  const MemoryUpdate::Changes first = run(place.room, &changed, memory, {});
  ASSERT_GE(first.added.size(), 2U);
  EXPECT_LE(first.added.size(), 4U);
  for (const auto& [number, pose] : first.added) {
    EXPECT_GE(number, 6U);
    EXPECT_LT(number, 10U);
    EXPECT_LT(distance(pose.position(), line()[number].position()), 0.02);
    EXPECT_NEAR(*pose.heading_rad, 0.0, 0.02);
  }
  for (std::size_t a = 1; a < first.added.size(); ++a) {
    EXPECT_GT(distance(first.added[a - 1].pose.position(), first.added[a].pose.position()),
              0.5 * spacing_m);
  }
  EXPECT_TRUE(first.replaced.empty());
  MemoryUpdate::UseStatistics use = apply(changed, first, memory);
  const MemoryUpdate::Changes second = run(place.room, &changed, memory, use);
  EXPECT_LE(second.added.size(), 1U);
  const auto matched_learnt = std::ranges::count_if(
      second.matched, [&](ViewId view) { return second.use.views.at(view).learnt; });
  EXPECT_GE(matched_learnt, 2);
  // The former appearance has failed once where the new one matched.
  EXPECT_TRUE(std::ranges::any_of(second.use.views,
                                  [](const auto& one) { return one.second.failed == 1; }));
}

TEST(MemoryUpdate, NothingIsLearntWhereNoPlaceIsKnown) {
  const RememberedRoom place(33, empty_room, spacing_m);
  const Room elsewhere(78, empty_room);
  MemoryUpdate::UseStatistics before;
  const MemoryUpdate::Changes changes = run(elsewhere, nullptr, place.memory, before, {}, 0.89);
  EXPECT_EQ(changes.certain, 0U);
  EXPECT_TRUE(changes.added.empty() && changes.matched.empty());
}

TEST(MemoryUpdate, SizeIsBoundedAndWhatIsTrueStaysHoweverManyOddRunsCome) {
  const RememberedRoom place(34, empty_room, spacing_m);
  VisualMemory memory = place.memory;
  MemoryUpdate::UseStatistics use;
  const MemoryUpdateOptions options{.appearances = 2, .failures = 3};
  std::size_t replaced = 0;
  for (std::uint64_t r = 0; r < 12; ++r) {
    const Room odd(100 + r, empty_room);
    const MemoryUpdate::Changes changes =
        run(place.room, r % 2 == 0 ? &odd : nullptr, memory, use, options);
    replaced += changes.replaced.size();
    use = apply(odd, changes, memory);
    EXPECT_LE(memory.size(), 2 * place.memory.size());
    for (const ViewId a : memory.views()) {
      const Point2 at = memory.info(a).pose->position();
      if (!use.views[a].learnt) continue;
      EXPECT_LE(std::ranges::count_if(memory.views(),
                                      [&](ViewId b) {
                                        return distance(memory.info(b).pose->position(), at) <=
                                               0.5 * spacing_m;
                                      }),
                4);  // two around each of two places that overlap
    }
  }
  EXPECT_GE(replaced, 2U);
  // Views of the room as it is on other days are all there.
  for (const ViewId view : place.memory.views()) EXPECT_TRUE(memory.contains(view));
}

TEST(MemoryUpdate, WhatKeepsFailingIsForgottenOnceAnotherViewOfThePlaceMatches) {
  const RememberedRoom place(35, empty_room, spacing_m);
  const Room changed(79, empty_room);
  VisualMemory memory = place.memory;
  MemoryUpdate::UseStatistics use;
  std::size_t forgotten = 0;
  for (int r = 0; r < 6; ++r) {
    const MemoryUpdate::Changes changes = run(place.room, &changed, memory, use, {.failures = 3});
    EXPECT_TRUE(r >= 3 || changes.forgotten.empty());
    forgotten += changes.forgotten.size();
    use = apply(changed, changes, memory);
  }
  EXPECT_GE(forgotten, 1U);
  EXPECT_LE(forgotten, 6U);
}

TEST(MemoryUpdate, SameRunGivesTheSameChangesAndHoldsAFewPicturesOnly) {
  const RememberedRoom place(36, empty_room, spacing_m);
  const Room changed(80, empty_room);
  const MemoryUpdate::Changes one = run(place.room, &changed, place.memory, {});
  const MemoryUpdate::Changes two = run(place.room, &changed, place.memory, {});
  EXPECT_EQ(one.matched, two.matched);
  EXPECT_EQ(one.use, two.use);
  ASSERT_EQ(one.added.size(), two.added.size());
  for (std::size_t i = 0; i < one.added.size(); ++i) {
    EXPECT_EQ(one.added[i].pose, two.added[i].pose);
  }
  const ColumnRanking ranking(place.memory);
  MemoryUpdate update(ranking, learn_observation_model(ranking), {});
  const PackedSignature view = seen(place.room, {1.0, 1.0, 0.0}, place.memory);
  for (int i = 0; i < 500; ++i) {
    update.add({Pose2{0.2 * i, 0.0, 0.0}, view, 0.0, std::nullopt, std::nullopt});
  }
  int candidates = 0;
  for (std::size_t i = 0; i < 500; ++i) candidates += update.can_become_view(i) ? 1 : 0;
  EXPECT_GT(candidates, 0);
  EXPECT_LE(candidates, 65);
  EXPECT_THROW(MemoryUpdate(ranking, learn_observation_model(ranking), {}, {.appearances = 0}),
               OptionError);
}

}  // namespace
}  // namespace panonav::testing
