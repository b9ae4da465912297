#include "panonav_fleet/internal/view_sketches.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <thread>

#include "panonav/core/error.hpp"
#include "support/search_oracle.hpp"

namespace panonav::fleet {
using namespace testing;
namespace {

/// Sketches and the views that they are of.
struct Sketched {
  ViewSketches sketches;
  Oracle oracle;
  ViewMaker maker;
  std::uint32_t last = 0;
  mutable std::size_t statements = 0;

  Sketched(SignatureShape shape, Kind kind, std::uint64_t seed)
      : sketches(shape), oracle{shape, {}}, maker(shape, kind, seed) {}
  void insert(std::size_t count) {
    std::vector<ViewId> ids;
    std::vector<std::uint8_t> magnitudes;
    for (std::size_t i = 0; i < count; ++i) {
      const PackedSignature view = maker.next();
      ids.push_back({++last});
      magnitudes.insert(magnitudes.end(), view.magnitudes.begin(), view.magnitudes.end());
      oracle.views.emplace(ids.back(), view);
    }
    sketches.insert(ids, magnitudes);
  }
  void erase(std::span<const ViewId> views) {
    sketches.erase(views);
    for (const ViewId view : views) oracle.views.erase(view);
  }
  [[nodiscard]] ViewSketches::ReadViews read() const {
    return [this](std::span<const ViewId> views, const ViewSketches::TakeView& take) {
      ++statements;
      for (const ViewId view : views) {
        const auto found = oracle.views.find(view);
        if (found != oracle.views.end()) take(view, found->second.magnitudes);
      }
    };
  }
  void expect_exact(const PackedSignature& query, int top, int components,
                    const SearchMask& mask) const {
    Executor executor(1 + top % 3);
    const SearchResult found = sketches.search(query, {top, components}, mask, read(), executor);
    const int compared = components == 0 ? oracle.shape.components : components;
    EXPECT_EQ(found.matches, oracle.nearest(query, top, compared, mask))
        << "top " << top << ", components " << components;
    EXPECT_GE(found.views_in_full, found.matches.size());
  }
};

struct SketchedCase {
  SignatureShape shape;
  Kind kind;
  std::size_t views;
};

class SketchedSearch : public ::testing::TestWithParam<SketchedCase> {};

TEST_P(SketchedSearch, FindsWhatAFullScanFinds) {
  const SketchedCase& sketched = GetParam();
  Sketched all(sketched.shape, sketched.kind, 31);
  all.insert(sketched.views / 2);
  for (int i = 0; i < 3; ++i) all.insert(1);
  all.insert(sketched.views / 2);
  Random random(32);
  std::vector<ViewId> some;
  for (std::uint32_t id = 1; id <= all.last; ++id) {
    if (random.index(9) == 0) some.push_back({id});
  }
  all.erase(some);
  EXPECT_EQ(all.sketches.size(), all.oracle.views.size());
  std::vector<ViewId> ids;
  for (const auto& [id, view] : all.oracle.views) ids.push_back(id);
  EXPECT_EQ(all.sketches.views(), ids);
  for (int repeat = 0; repeat < 10; ++repeat) {
    const PackedSignature query =
        repeat % 3 == 0 ? all.oracle.views.at(ids[random.index(ids.size())]) : all.maker.next();
    const int components =
        repeat % 2 == 0 ? 0 : 1 + static_cast<int>(random.index(sketched.shape.components));
    std::vector<ViewId> excluded;
    for (int i = 0; i < repeat; ++i) excluded.push_back(ids[random.index(ids.size())]);
    std::vector<std::uint8_t> rows;
    if (repeat % 4 == 3) {
      for (int row = 0; row < sketched.shape.rows; ++row)
        rows.push_back(random.index(6) == 0 ? 0 : 1);
    }
    const int top = repeat == 5 ? 300 : 1 + static_cast<int>(random.index(20));
    all.expect_exact(query, top, components, {excluded, rows});
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, SketchedSearch,
                         ::testing::Values(SketchedCase{{80, 15}, Kind::clustered, 7000},
                                           SketchedCase{{80, 15}, Kind::random, 3000},
                                           SketchedCase{{80, 15}, Kind::repeated, 7000},
                                           SketchedCase{{80, 15}, Kind::dark, 3000},
                                           SketchedCase{{20, 15}, Kind::clustered, 9000},
                                           SketchedCase{{1, 6}, Kind::clustered, 140000},
                                           SketchedCase{{1, 1}, Kind::random, 2000},
                                           SketchedCase{{7, 3}, Kind::repeated, 700},
                                           SketchedCase{{3, 200}, Kind::clustered, 2000},
                                           SketchedCase{{500, 2}, Kind::random, 300}),
                         [](const auto& tested) {
                           return "of" + std::to_string(tested.param.shape.rows) + "x" +
                                  std::to_string(tested.param.shape.components) + "kind" +
                                  std::to_string(static_cast<int>(tested.param.kind));
                         });

TEST(ViewSketches, AlmostAllViewsAreRuledOutAndFewStatementsAreAsked) {
  Sketched all({80, 15}, Kind::clustered, 41);
  all.insert(7000);
  all.statements = 0;
  std::uint64_t in_full = 0;
  Executor executor;
  for (int i = 0; i < 20; ++i) {
    const PackedSignature query = all.maker.next();
    const SearchResult found = all.sketches.search(query, {10, 0}, {}, all.read(), executor);
    in_full += found.views_in_full;
    EXPECT_LT(found.bytes_read, found.bytes_in_full / 20);
  }
  EXPECT_LT(in_full, 20U * 300);
  EXPECT_LE(all.statements, 20U * 6);
  EXPECT_LT(all.sketches.bytes(), 7000U * 1700);
}

TEST(ViewSketches, NoiseIsComparedWithFewViewsBecauseNoneHasItsMagnitudes) {
  Sketched all({80, 15}, Kind::clustered, 42);
  all.insert(7000);
  ViewMaker noise({80, 15}, Kind::random, 43);
  std::vector<std::uint8_t> rows(80, 1);
  std::fill_n(rows.begin(), 20, 0);
  std::uint64_t in_full = 0;
  Executor executor;
  for (int i = 0; i < 8; ++i) {
    const PackedSignature query = noise.next();
    all.expect_exact(query, 10, i % 3, {});
    all.expect_exact(query, 10, 0, {{}, rows});
    in_full += all.sketches.search(query, {10, 0}, {}, all.read(), executor).views_in_full;
  }
  EXPECT_LT(in_full, 8U * 700);
}

TEST(ViewSketches, AnEmptyOneFindsNothing) {
  Sketched none({80, 15}, Kind::random, 1);
  EXPECT_EQ(none.sketches.size(), 0U);
  none.expect_exact(none.maker.next(), 10, 0, {});
  none.insert(5);
  none.expect_exact(none.maker.next(), 10, 0, {});
  const std::vector<ViewId> ids = none.sketches.views();
  none.expect_exact(none.maker.next(), 10, 0, {ids, {}});  // all are excluded
  none.erase(ids);
  none.expect_exact(none.maker.next(), 10, 0, {});
  none.insert(3);
  none.expect_exact(none.maker.next(), 1, 0, {});
}

TEST(ViewSketches, ViewsThatAreGoneWhenTheyAreReadAreLeftOut) {
  Sketched all({20, 15}, Kind::clustered, 51);
  all.insert(7000);
  const PackedSignature query = all.maker.next();
  // Also those that look best by their sketches: the search continues with others.
  for (int round = 0; round < 4; ++round) {
    for (const Match& match : all.oracle.nearest(query, 12, 15, {}))
      all.oracle.views.erase(match.view);
    all.expect_exact(query, 10, 0, {});
  }
  const auto kept = all.oracle.views;
  all.oracle.views.clear();
  all.expect_exact(query, 10, 0, {});
}

TEST(ViewSketches, ACopyIsWhatTheOriginalWas) {
  Sketched all({20, 15}, Kind::clustered, 61);
  all.insert(7000);
  const Sketched before = all;
  const PackedSignature query = all.maker.next();
  std::thread asks([&] {
    for (int i = 0; i < 20; ++i) before.expect_exact(query, 10, 0, {});
  });
  for (int i = 0; i < 10; ++i) {
    all.insert(3);
    all.erase(std::vector{ViewId{static_cast<std::uint32_t>(100 * i + 1)}});
    all.expect_exact(query, 10, 0, {});
  }
  asks.join();
  EXPECT_EQ(before.sketches.size(), 7000U);
  EXPECT_EQ(all.sketches.size(), 7020U);
}

TEST(ViewSketches, JoinedOnesFindWhatBothHold) {
  Sketched one({20, 15}, Kind::clustered, 71);
  one.insert(7000);
  Sketched other({20, 15}, Kind::clustered, 72);
  other.last = 50000;
  other.insert(7100);
  other.erase(std::vector{ViewId{50003}, ViewId{57100}});
  one.sketches.insert(other.sketches);
  one.oracle.views.insert(other.oracle.views.begin(), other.oracle.views.end());
  EXPECT_EQ(one.sketches.size(), one.oracle.views.size());
  for (int i = 0; i < 5; ++i) {
    one.expect_exact(one.maker.next(), 10, 0, {});
    one.expect_exact(other.maker.next(), 10, 0, {});
  }
  EXPECT_THROW(one.sketches.insert(ViewSketches({80, 15})), ContractError);
}

TEST(ViewSketches, RefuseWhatDoesNotFit) {
  EXPECT_THROW(ViewSketches({0, 15}), ContractError);
  Sketched all({80, 15}, Kind::random, 1);
  all.insert(10);
  const PackedSignature query = all.maker.next();
  const std::vector<std::uint8_t> rows(79, 1);
  const auto read = all.read();
  Executor executor;
  EXPECT_THROW((void)all.sketches.search(query, {0, 0}, {}, read, executor), ContractError);
  EXPECT_THROW((void)all.sketches.search(query, {1, 16}, {}, read, executor), ContractError);
  EXPECT_THROW((void)all.sketches.search(query, {1, 0}, {{}, rows}, read, executor), ContractError);
  EXPECT_THROW((void)all.sketches.search(ViewMaker({20, 15}, Kind::random, 1).next(), {1, 0}, {},
                                         read, executor),
               ContractError);
  EXPECT_THROW(all.sketches.insert(std::vector{ViewId{99}}, std::vector<std::uint8_t>(1199)),
               ContractError);
  EXPECT_THROW((void)all.sketches.search(
                   query, {1, 0}, {},
                   [](std::span<const ViewId> views, const ViewSketches::TakeView& take) {
                     take(views.front(), {});
                   },
                   executor),
               ContractError);
}

}  // namespace
}  // namespace panonav::fleet
