#include <gtest/gtest.h>

#include <thread>

#include "panonav/core/error.hpp"
#include "panonav/kernels/dispatch.hpp"
#include "panonav/memory/internal/exact_search.hpp"
#include "support/search_oracle.hpp"

namespace panonav::testing {
namespace {

struct Filled {
  VisualMemory memory;
  Oracle oracle;
  ViewMaker maker;
  std::size_t names = 0;

  Filled(SignatureShape shape, Kind kind, std::uint64_t seed)
      : memory(shape, 1.0F, {}), oracle{shape, {}}, maker(shape, kind, seed) {}
  void append(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const PackedSignature view = maker.next();
      oracle.views.emplace(memory.append(view, named(names++)), view);
    }
  }
  void remove(ViewId view) {
    memory.remove(view);
    oracle.views.erase(view);
  }
};

/// Compares one search with the oracle and checks what it reports of itself.
void expect_exact(const Filled& filled, const PackedSignature& query, int top, int components,
                  const SearchMask& mask) {
  const SearchResult found = filled.memory.search(query, {top, components}, mask);
  const int compared = components == 0 ? filled.memory.shape().components : components;
  EXPECT_EQ(found.matches, filled.oracle.nearest(query, top, compared, mask))
      << "top " << top << ", components " << components;
  EXPECT_GE(found.views_in_full, found.matches.size());
  const auto view_bytes = static_cast<std::uint64_t>(compared) * filled.memory.shape().rows;
  EXPECT_GE(found.bytes_read, found.views_in_full * view_bytes);
}

struct Case {
  SignatureShape shape;
  Kind kind;
  std::size_t views;
};

class ExactSearch : public ::testing::TestWithParam<Case> {};

TEST_P(ExactSearch, FindsWhatAFullScanFinds) {
  const Case& tested = GetParam();
  Filled filled(tested.shape, tested.kind, 21);
  filled.append(tested.views);
  Random random(22);
  const auto views = filled.memory.views();
  for (int repeat = 0; repeat < 12; ++repeat) {
    const PackedSignature query = repeat % 3 == 0
                                      ? filled.memory.packed(views[random.index(views.size())])
                                      : filled.maker.next();
    const int top = 1 + static_cast<int>(random.index(25));
    const auto components = static_cast<int>(random.index(tested.shape.components + 1));
    expect_exact(filled, query, top, components, {});

    std::vector<ViewId> excluded;
    for (const Match& match : filled.memory.search(query, {top, components}).matches) {
      if (random.index(2) == 0) excluded.push_back(match.view);
    }
    if (!excluded.empty()) excluded.push_back(excluded.front());
    excluded.push_back(ViewId{4000000000U});
    std::vector<std::uint8_t> rows(tested.shape.rows);
    const bool band = random.index(2) == 0;  // whole blocks stay, or none does
    for (std::size_t row = 0; row < rows.size(); ++row) {
      rows[row] =
          band ? (row < rows.size() / 2 ? 1 : 0) : static_cast<std::uint8_t>(random.index(2));
    }
    expect_exact(filled, query, top, components, {excluded, {}});
    expect_exact(filled, query, top, components, {{}, rows});
    expect_exact(filled, query, top, components, {excluded, rows});

    const int wide_top = 64 + static_cast<int>(random.index(400));
    expect_exact(filled, query, wide_top, components, {});
    expect_exact(filled, query, wide_top, components, {excluded, rows});
  }
}

TEST_P(ExactSearch, HierarchyHoldsExactlyTheViewsWithinItsLimit) {
  const Case& tested = GetParam();
  Filled filled(tested.shape, tested.kind, 23);
  filled.append(tested.views);
  for (const double tolerance : {0.0, 0.3}) {
    const PackedSignature query = filled.maker.next();
    std::vector<ViewId> excluded;
    if (tested.views > 1) excluded = {filled.memory.search(query, {1, 0}).matches.front().view};
    const SearchMask mask{excluded, {}};
    const auto levels = filled.memory.hierarchy(query, tolerance, 0, {}, mask);
    ASSERT_EQ(levels.size(), static_cast<std::size_t>(tested.shape.components));
    const Match nearest = filled.oracle.nearest(query, 1, tested.shape.components, mask).front();
    double limit_before = levels.front().limit;
    std::uint64_t bytes_before = 0;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const VisualMemory::HierarchyLevel& level = levels[i];
      EXPECT_EQ(level.components, static_cast<int>(i) + 1);
      EXPECT_GE(level.limit, (1.0 + tolerance) * nearest.dissimilarity);
      EXPECT_LE(level.limit, limit_before);
      std::vector<Match> expected = filled.oracle.all(query, level.components, mask);
      std::erase_if(expected,
                    [&](const Match& match) { return match.dissimilarity > level.limit; });
      EXPECT_EQ(level.candidates, expected) << level.components << " components";
      EXPECT_GT(level.bytes_read, bytes_before);
      limit_before = level.limit;
      bytes_before = level.bytes_read;
    }
    EXPECT_DOUBLE_EQ(levels.back().limit, (1.0 + tolerance) * nearest.dissimilarity);
    EXPECT_EQ(levels.back().candidates.front(), nearest);
  }
}

std::string case_name(const ::testing::TestParamInfo<Case>& info) {
  const char* const kinds[] = {"Random", "Clustered", "Repeated", "Dark"};
  return std::string(kinds[static_cast<int>(info.param.kind)]) + std::to_string(info.param.views) +
         "Of" + std::to_string(info.param.shape.rows) + "x" +
         std::to_string(info.param.shape.components);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, ExactSearch,
    ::testing::Values(Case{{80, 15}, Kind::clustered, 5000}, Case{{80, 15}, Kind::random, 3000},
                      Case{{80, 15}, Kind::repeated, 2500}, Case{{80, 15}, Kind::dark, 1500},
                      Case{{80, 15}, Kind::clustered, 40}, Case{{80, 15}, Kind::clustered, 1},
                      Case{{7, 15}, Kind::clustered, 1200}, Case{{7, 15}, Kind::random, 700},
                      Case{{25, 13}, Kind::clustered, 1500}, Case{{33, 3}, Kind::repeated, 900},
                      Case{{1, 20}, Kind::random, 600}, Case{{4, 1}, Kind::random, 600},
                      Case{{129, 31}, Kind::clustered, 400}),
    case_name);

TEST(VisualMemorySearch, StaysExactWhileViewsComeAndGo) {
  Filled filled({40, 9}, Kind::clustered, 31);
  Random random(32);
  std::size_t removed = 0;
  for (int round = 0; round < 60; ++round) {
    if (random.index(3) != 0 || filled.memory.size() < 50) {
      filled.append(20 + random.index(150));
    } else {
      for (std::size_t i = 10 + random.index(120); i > 0 && !filled.memory.empty(); --i) {
        const auto views = filled.memory.views();
        filled.remove(views[random.index(views.size())]);
        ++removed;
      }
    }
    ASSERT_EQ(filled.memory.size(), filled.oracle.views.size());
    const PackedSignature query = filled.maker.next();
    expect_exact(filled, query, 1 + static_cast<int>(random.index(12)),
                 static_cast<int>(random.index(10)), {});
  }
  EXPECT_GT(removed, 200U);
  while (!filled.memory.empty()) filled.remove(filled.memory.views().back());
  const SearchResult found = filled.memory.search(filled.maker.next());
  EXPECT_TRUE(found.matches.empty());
  EXPECT_TRUE(filled.memory.hierarchy(filled.maker.next(), 0.0).empty());
}

// Views of another kind than those from which the sketches' scales were learnt.
TEST(VisualMemorySearch, StaysExactWhenTheWorldChanges) {
  Filled filled({80, 15}, Kind::dark, 33);
  filled.append(600);
  ViewMaker bright({80, 15}, Kind::random, 34);
  for (int i = 0; i < 60; ++i) {
    const PackedSignature view = bright.next();
    filled.oracle.views.emplace(filled.memory.append(view, named(filled.names++)), view);
    if (i % 10 == 0) expect_exact(filled, bright.next(), 5, 0, {});
  }
  expect_exact(filled, filled.maker.next(), 5, 0, {});
  expect_exact(filled, bright.next(), 70, 0, {});
}

TEST(VisualMemorySearch, TiesAreInTheOrderOfTheIds) {
  Filled filled({80, 15}, Kind::repeated, 35);
  filled.append(1500);
  const SearchResult found = filled.memory.search(filled.maker.next(), {100, 0});
  ASSERT_EQ(found.matches.size(), 100U);
  int ties = 0;
  for (std::size_t i = 1; i < found.matches.size(); ++i) {
    if (found.matches[i - 1].dissimilarity != found.matches[i].dissimilarity) continue;
    EXPECT_LT(found.matches[i - 1].view, found.matches[i].view);
    ++ties;
  }
  EXPECT_GT(ties, 50);
}

TEST(VisualMemorySearch, ReadsAFractionOfClusteredViews) {
  Filled filled({80, 15}, Kind::clustered, 36);
  filled.append(6000);
  double share = 0.0;
  constexpr int queries = 10;
  for (int i = 0; i < queries; ++i) {
    const SearchResult found = filled.memory.search(filled.maker.next());
    EXPECT_EQ(found.bytes_in_full, 6000U * 1200U);
    share += static_cast<double>(found.bytes_read) / static_cast<double>(found.bytes_in_full);
  }
  EXPECT_LT(share / queries, 0.10);
}

TEST(VisualMemorySearch, ReadsLittleMoreThanEverythingInTheWorstCase) {
  Filled filled({80, 15}, Kind::random, 37);
  filled.append(8000);
  const SearchResult found = filled.memory.search(filled.maker.next());
  EXPECT_LT(static_cast<double>(found.bytes_read), 1.10 * static_cast<double>(found.bytes_in_full));
}

TEST(VisualMemorySearch, EveryInstructionSetFindsAndReadsTheSame) {
  const SignatureShape shape{80, 15};
  ViewMaker maker(shape, Kind::clustered, 38);
  ViewStore store(shape);
  SketchIndex index(shape);
  std::vector<ViewId> views;
  std::vector<ViewStore::Row> rows;
  for (std::uint32_t i = 0; i < 2500; ++i) {
    const PackedSignature signature = maker.next();
    rows.push_back(store.add(signature.magnitudes, signature.phases));
    index.insert(store, rows.back());
    views.push_back(ViewId{3 * i});
  }
  const SearchedViews searched{shape, store, index, views, rows, views};
  const PackedSignature query = maker.next();
  const auto reference = exact_search(searched, query, {}, {}, kernels::Instructions::scalar);
  ASSERT_EQ(reference.matches.size(), 10U);
  for (const auto instructions : kernels::available_instructions()) {
    const auto found = exact_search(searched, query, {}, {}, instructions);
    EXPECT_EQ(found.matches, reference.matches) << kernels::name(instructions);
    EXPECT_EQ(found.bytes_read, reference.bytes_read) << kernels::name(instructions);
    EXPECT_EQ(found.views_in_full, reference.views_in_full) << kernels::name(instructions);
  }
}

TEST(VisualMemorySearch, SeveralThreadsFindTheSame) {
  Filled filled({80, 15}, Kind::clustered, 39);
  filled.append(3000);
  std::vector<PackedSignature> queries;
  std::vector<std::vector<Match>> expected;
  for (int i = 0; i < 8; ++i) {
    queries.push_back(filled.maker.next());
    expected.push_back(filled.memory.search(queries.back()).matches);
  }
  std::vector<int> agreeing(4, 0);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < agreeing.size(); ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t i = 0; i < queries.size(); ++i) {
        const VisualMemory& memory = filled.memory;
        agreeing[t] += memory.search(queries[i]).matches == expected[i] ? 1 : 0;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const int count : agreeing) EXPECT_EQ(count, 8);
}

TEST(VisualMemorySearch, HierarchyStopsWhenTold) {
  Filled filled({80, 15}, Kind::clustered, 40);
  filled.append(2000);
  const PackedSignature query = filled.maker.next();
  const auto all = filled.memory.hierarchy(query, 0.2);
  const auto some = filled.memory.hierarchy(
      query, 0.2, 0,
      [](const VisualMemory::HierarchyLevel& level) { return level.components == 4; });
  ASSERT_EQ(some.size(), 4U);
  ASSERT_EQ(all.size(), 15U);
  for (std::size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i].candidates, all[i].candidates);
  EXPECT_LT(some.back().bytes_read, all.back().bytes_read);
  for (std::size_t i = 1; i < all.size(); ++i) {
    EXPECT_LE(all[i].candidates.size(), all[i - 1].candidates.size());
  }
  EXPECT_LT(all.back().candidates.size(), all.front().candidates.size());
}

TEST(VisualMemorySearch, RefusesWhatIsOutOfRange) {
  Filled filled({8, 4}, Kind::random, 41);
  filled.append(3);
  const PackedSignature query = filled.maker.next();
  EXPECT_THROW((void)filled.memory.search(query, {0, 0}), ContractError);
  EXPECT_THROW((void)filled.memory.search(query, {1, 5}), ContractError);
  EXPECT_THROW((void)filled.memory.search(query, {1, -1}), ContractError);
  const std::vector<std::uint8_t> rows(7, 1);
  EXPECT_THROW((void)filled.memory.search(query, {1, 0}, {{}, rows}), ContractError);
  PackedSignature other = ViewMaker({9, 4}, Kind::random, 1).next();
  EXPECT_THROW((void)filled.memory.search(other), ContractError);
  other = query;
  other.magnitudes.pop_back();
  EXPECT_THROW((void)filled.memory.search(other), ContractError);
  EXPECT_THROW((void)filled.memory.hierarchy(query, -0.1), ContractError);
  EXPECT_THROW((void)filled.memory.hierarchy(query, 0.1, 5), ContractError);
}

}  // namespace
}  // namespace panonav::testing
