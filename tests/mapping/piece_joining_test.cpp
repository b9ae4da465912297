#include "panonav/mapping/internal/piece_joining.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav::testing {
namespace {

constexpr int side = 5;
constexpr std::size_t piece_views = side * side;

/// Two squares of views, 1 apart, that touch: nodes 0 .. 24 and 25 .. 49, each with the poses of
/// its own frame.
struct TwoPieces {
  Pose2 p_from_q;
  std::vector<Pose2> truth;
  std::vector<Pose2> poses;
  std::vector<std::size_t> components;

  explicit TwoPieces(Random& random)
      : p_from_q{random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0),
                 random.uniform(-std::numbers::pi, std::numbers::pi)} {
    for (std::size_t i = 0; i < 2 * piece_views; ++i) {
      const auto x = static_cast<double>(i / side);
      const auto y = static_cast<double>(i % side);
      truth.push_back({x, y, random.uniform(-std::numbers::pi, std::numbers::pi)});
      components.push_back(i / piece_views);
      poses.push_back(components[i] == 0 ? truth[i] : inverse(p_from_q) * truth[i]);
    }
  }

  /// Links across the border with noise of 0.1 in each coordinate and 3 degrees.
  [[nodiscard]] std::vector<CrossLink> measure_links(Random& random) const {
    std::vector<CrossLink> links;
    for (std::size_t a = piece_views - side; a < piece_views; ++a) {
      for (std::size_t b = piece_views; b < piece_views + side; ++b) {
        Pose2 step = inverse(truth[a]) * truth[b];
        const double length = std::hypot(step.x_m, step.y_m);
        if (length > 1.5) continue;
        step.x_m += random.uniform(-0.1, 0.1);
        step.y_m += random.uniform(-0.1, 0.1);
        step.heading_rad = wrap_angle(step.heading_rad + random.uniform(-0.05, 0.05));
        links.push_back({a, b, step, length, 0.9});
      }
    }
    return links;
  }
};

/// Replaces the steps of all links by others of random directions and turns.
void scatter(std::vector<CrossLink>& links, Random& random) {
  for (CrossLink& link : links) {
    const double direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    link.step = {link.length * std::cos(direction_rad), link.length * std::sin(direction_rad),
                 random.uniform(-std::numbers::pi, std::numbers::pi)};
  }
}

TEST(PieceJoining, JoinsAtTheTruePose) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed, 1);
    TwoPieces pieces(random);
    const auto links = pieces.measure_links(random);
    ASSERT_EQ(links.size(), 13U);
    const auto joined = join_pieces(links, pieces.poses, pieces.components, piece_views);
    ASSERT_EQ(joined.size(), 1U) << "seed " << seed;
    EXPECT_EQ(joined.front().agreeing.size(), links.size());
    for (std::size_t i = 1; i < pieces.poses.size(); ++i) {
      EXPECT_EQ(pieces.components[i], pieces.components[0]);
      const Pose2 found = inverse(pieces.poses[0]) * pieces.poses[i];
      const Pose2 truth = inverse(pieces.truth[0]) * pieces.truth[i];
      EXPECT_NEAR(distance(found.position(), truth.position()), 0.0, 0.4) << "seed " << seed;
    }
  }
}

TEST(PieceJoining, JoinsDespiteWrongLinks) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed, 2);
    TwoPieces pieces(random);
    auto links = pieces.measure_links(random);
    auto wrong = pieces.measure_links(random);
    wrong.resize(5);
    scatter(wrong, random);
    for (CrossLink& link : wrong) link.probability = 0.3;
    links.insert(links.end(), wrong.begin(), wrong.end());
    ASSERT_EQ(join_pieces(links, pieces.poses, pieces.components, piece_views).size(), 1U)
        << "seed " << seed;
    const Pose2 found = inverse(pieces.poses[0]) * pieces.poses[piece_views];
    const Pose2 truth = inverse(pieces.truth[0]) * pieces.truth[piece_views];
    EXPECT_LT(distance(found.position(), truth.position()), 0.4) << "seed " << seed;
  }
}

TEST(PieceJoining, DoesNotJoinByInconsistentLinks) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed, 3);
    TwoPieces pieces(random);
    auto links = pieces.measure_links(random);
    scatter(links, random);
    const auto before = pieces.poses;
    EXPECT_TRUE(join_pieces(links, pieces.poses, pieces.components, piece_views).empty())
        << "seed " << seed;
    EXPECT_EQ(pieces.poses, before);
  }
}

TEST(PieceJoining, DoesNotChooseBetweenTwoPoses) {
  Random random(1, 4);
  TwoPieces pieces(random);
  auto links = pieces.measure_links(random);
  const Pose2 shift{0.0, 0.0, 0.5 * std::numbers::pi};
  const auto count = links.size();
  for (std::size_t k = 0; k < count; ++k) {  // as many show a quarter turn of the second piece
    CrossLink other = links[k];
    other.step =
        inverse(pieces.poses[other.in_p]) * pieces.p_from_q * shift * pieces.poses[other.in_q];
    links.push_back(other);
  }
  EXPECT_TRUE(join_pieces(links, pieces.poses, pieces.components, piece_views).empty());
}

TEST(PieceJoining, NeedsThreeViewsOfEachPiece) {
  Random random(1, 5);
  TwoPieces pieces(random);
  auto links = pieces.measure_links(random);
  std::erase_if(links, [](const CrossLink& link) { return link.in_q > piece_views + 1; });
  ASSERT_EQ(links.size(), 5U);
  for (CrossLink& link : links) link.probability = 0.99;
  EXPECT_TRUE(join_pieces(links, pieces.poses, pieces.components, piece_views).empty());
}

TEST(PieceJoining, DoesNotJoinPiecesThatAreTooSmall) {
  Random random(1, 7);
  TwoPieces pieces(random);
  const auto links = pieces.measure_links(random);
  EXPECT_TRUE(join_pieces(links, pieces.poses, pieces.components, piece_views + 1).empty());
  EXPECT_EQ(join_pieces(links, pieces.poses, pieces.components, piece_views).size(), 1U);
}

TEST(PieceJoining, CrossingsAreProbableLinksThatAgree) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed, 8);
    const TwoPieces pieces(random);
    auto links = pieces.measure_links(random);
    const std::size_t right = links.size();
    auto wrong = pieces.measure_links(random);
    wrong.resize(4);
    for (CrossLink& link : wrong) {
      link.step = {-link.step.x_m, -link.step.y_m,
                   wrap_angle(link.step.heading_rad + std::numbers::pi)};
      link.probability = 0.95;
    }
    links.insert(links.end(), wrong.begin(), wrong.end());
    links[3].probability = 0.99;
    const auto chosen = choose_crossings(links, pieces.poses, pieces.components);
    ASSERT_EQ(chosen.size(), 3U) << "seed " << seed;
    EXPECT_TRUE(std::ranges::binary_search(chosen, std::size_t{3}));
    for (const std::size_t k : chosen) EXPECT_LT(k, right) << "seed " << seed;
    for (CrossLink& link : links) link.probability = 0.4;
    EXPECT_TRUE(choose_crossings(links, pieces.poses, pieces.components).empty());
  }
}

TEST(PieceJoining, DoesNotJoinByUnrelatedViews) {
  Random random(1, 6);
  TwoPieces pieces(random);
  auto links = pieces.measure_links(random);
  for (CrossLink& link : links) link.probability = 0.0;
  EXPECT_TRUE(join_pieces(links, pieces.poses, pieces.components, piece_views).empty());
}

}  // namespace
}  // namespace panonav::testing
