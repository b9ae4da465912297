#include "panonav/memory/visual_memory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"
#include "support/search_oracle.hpp"

namespace panonav::testing {
namespace {

constexpr SignatureShape shape{20, 6};

VisualMemory filled_memory(std::size_t views, std::uint64_t seed = 1) {
  VisualMemory memory(shape, 0.5F, ElevationBand{-0.5, 0.5});
  ViewMaker maker(shape, Kind::clustered, seed);
  for (std::size_t i = 0; i < views; ++i) memory.append(maker.next(), named(i));
  return memory;
}

TEST(VisualMemory, GivesBackWhatWasAppended) {
  VisualMemory memory(shape, 0.5F, ElevationBand{-0.5, 0.5});
  ViewMaker maker(shape, Kind::random, 2);
  std::vector<PackedSignature> signatures;
  std::vector<ReferenceInfo> infos;
  for (std::size_t i = 0; i < 700; ++i) {
    signatures.push_back(maker.next());
    infos.push_back(named(i));
    const double x = static_cast<double>(i);
    if (i % 2 == 0) infos.back().pose = ReferencePose{x, -x, {}};
    if (i % 4 == 0) infos.back().pose->heading_rad = 0.1 * x;
    if (i % 3 == 0) infos.back().stamp_s = 0.5 * x;
    EXPECT_EQ(memory.append(signatures.back(), infos.back()), ViewId{static_cast<uint32_t>(i)});
  }
  ASSERT_EQ(memory.size(), 700U);
  for (std::size_t i = 0; i < signatures.size(); ++i) {
    const ViewId view = memory.views()[i];
    EXPECT_EQ(memory.packed(view), signatures[i]);
    EXPECT_EQ(memory.info(view), infos[i]);
    EXPECT_EQ(memory.find(infos[i].name), view);
  }
  EXPECT_EQ(memory.find("nobody"), std::nullopt);
  EXPECT_EQ(memory.shape(), shape);
  EXPECT_EQ(memory.full_scale(), 0.5F);
}

TEST(VisualMemory, AppendsFloatSignaturesThroughPack) {
  VisualMemory memory(shape, 0.5F, ElevationBand{-0.5, 0.5});
  std::vector<float> magnitudes(shape.size());
  std::vector<float> phases(shape.size());
  Random random(3);
  for (float& magnitude : magnitudes) magnitude = static_cast<float>(random.uniform(0.01, 0.5));
  for (float& phase : phases) {
    phase = static_cast<float>(random.uniform(-std::numbers::pi, std::numbers::pi));
  }
  const FourierSignature signature(shape, magnitudes, phases, ElevationBand{-0.5, 0.5});
  const ViewId view = memory.append(signature, {"a", {}, {}});
  EXPECT_EQ(memory.packed(view), pack(signature, 0.5F));
  EXPECT_EQ(memory.signature(view), unpack(pack(signature, 0.5F), 0.5F, ElevationBand{-0.5, 0.5}));
}

TEST(VisualMemory, RemovedViewsAreGoneAndTheirIdsAreNotUsedAgain) {
  VisualMemory memory = filled_memory(10);
  const PackedSignature kept = memory.packed(ViewId{4});
  memory.link({ViewId{3}, ViewId{4}});
  memory.link({ViewId{4}, ViewId{5}});
  memory.remove(ViewId{3});
  EXPECT_FALSE(memory.contains(ViewId{3}));
  EXPECT_EQ(memory.find("view 3"), std::nullopt);
  EXPECT_EQ(memory.size(), 9U);
  EXPECT_EQ(memory.packed(ViewId{4}), kept);
  EXPECT_EQ(memory.neighbours(ViewId{4}), std::vector<ViewId>{ViewId{5}});
  EXPECT_THROW(memory.remove(ViewId{3}), ContractError);
  EXPECT_THROW((void)memory.info(ViewId{3}), ContractError);
  EXPECT_THROW((void)memory.packed(ViewId{3}), ContractError);
  EXPECT_THROW((void)memory.neighbours(ViewId{3}), ContractError);

  ViewMaker maker(shape, Kind::random, 5);
  const PackedSignature signature = maker.next();
  const ViewId again = memory.append(signature, named(3));
  EXPECT_EQ(again, ViewId{10});
  EXPECT_EQ(memory.packed(again), signature);
  EXPECT_EQ(memory.find("view 3"), again);
  EXPECT_TRUE(std::ranges::is_sorted(memory.views()));
}

TEST(VisualMemory, BadAppendsChangeNothing) {
  VisualMemory memory = filled_memory(3);
  const PackedSignature good = memory.packed(ViewId{0});
  const auto refuses = [&](const PackedSignature& signature, const ReferenceInfo& info) {
    EXPECT_THROW(memory.append(signature, info), ContractError);
    EXPECT_EQ(memory.size(), 3U);
    EXPECT_EQ(memory.find("new"), std::nullopt);
  };
  refuses(good, {"", {}, {}});
  refuses(good, {"view 1", {}, {}});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  refuses(good, {"new", ReferencePose{nan, 0.0, {}}, {}});
  refuses(good, {"new", ReferencePose{0.0, infinity, {}}, {}});
  refuses(good, {"new", ReferencePose{0.0, 0.0, nan}, {}});
  refuses(good, {"new", {}, nan});
  refuses(ViewMaker({21, 6}, Kind::random, 1).next(), {"new", {}, {}});
  PackedSignature short_one = good;
  short_one.phases.pop_back();
  refuses(short_one, {"new", {}, {}});
  EXPECT_THROW(memory.append_with_id(ViewId{2}, good, {"new", {}, {}}), ContractError);
  EXPECT_EQ(memory.append(good, {"new", {}, {}}), ViewId{3});
}

TEST(VisualMemory, RefusesImpossibleShapesAndScales) {
  EXPECT_THROW(VisualMemory({0, 5}, 1.0F, {}), ContractError);
  EXPECT_THROW(VisualMemory({5, 0}, 1.0F, {}), ContractError);
  EXPECT_THROW(VisualMemory({-3, -5}, 1.0F, {}), ContractError);
  EXPECT_THROW(VisualMemory({1 << 20, 1 << 20}, 1.0F, {}), ContractError);
  EXPECT_THROW(VisualMemory({5, 5}, 0.0F, {}), ContractError);
  EXPECT_THROW(VisualMemory({5, 5}, std::numeric_limits<float>::infinity(), {}), ContractError);
}

TEST(VisualMemory, GivenIdsGrowAndMayLeaveGaps) {
  VisualMemory memory(shape, 1.0F, {});
  ViewMaker maker(shape, Kind::random, 6);
  memory.append_with_id(ViewId{7}, maker.next(), {"a", {}, {}});
  memory.append_with_id(ViewId{4294967295U}, maker.next(), {"b", {}, {}});
  EXPECT_THROW(memory.append(maker.next(), {"c", {}, {}}), ContractError);
  EXPECT_EQ(memory.search(maker.next(), {5, 0}).matches.size(), 2U);
}

TEST(VisualMemory, LinksAreOnePerPair) {
  VisualMemory memory = filled_memory(6);
  memory.link({ViewId{0}, ViewId{1}, Link::Kind::sequence});
  memory.link({ViewId{2}, ViewId{0}, Link::Kind::closure});
  memory.link({ViewId{1}, ViewId{0}, Link::Kind::neighbour});
  ASSERT_EQ(memory.links().size(), 2U);
  EXPECT_EQ(memory.links()[0], (Link{ViewId{1}, ViewId{0}, Link::Kind::neighbour}));
  EXPECT_EQ(memory.neighbours(ViewId{0}), (std::vector{ViewId{1}, ViewId{2}}));
  EXPECT_THROW(memory.link({ViewId{1}, ViewId{1}}), ContractError);
  EXPECT_THROW(memory.link({ViewId{1}, ViewId{9}}), ContractError);
  memory.unlink(ViewId{0}, ViewId{1});
  memory.unlink(ViewId{0}, ViewId{5});
  EXPECT_EQ(memory.links().size(), 1U);
  EXPECT_TRUE(memory.neighbours(ViewId{1}).empty());
}

TEST(VisualMemory, LinksAgreeWithAPlainSetOfPairs) {
  VisualMemory memory = filled_memory(30);
  std::set<std::pair<ViewId, ViewId>> pairs;
  Random random(7);
  for (int i = 0; i < 2000; ++i) {
    const ViewId a{static_cast<std::uint32_t>(random.index(30))};
    const ViewId b{static_cast<std::uint32_t>(random.index(30))};
    if (a == b) continue;
    if (random.index(3) != 0) {
      memory.link({a, b});
      pairs.insert(std::minmax(a, b));
    } else {
      memory.unlink(a, b);
      pairs.erase(std::minmax(a, b));
    }
  }
  memory.remove(ViewId{12});
  std::erase_if(pairs, [](const auto& pair) {
    return pair.first == ViewId{12} || pair.second == ViewId{12};
  });
  ASSERT_GT(pairs.size(), 50U);
  std::set<std::pair<ViewId, ViewId>> found;
  for (const Link& link : memory.links()) found.insert(std::minmax(link.a, link.b));
  EXPECT_EQ(found, pairs);
  EXPECT_EQ(memory.links().size(), pairs.size());
}

TEST(VisualMemory, CopiesAreIndependent) {
  VisualMemory memory = filled_memory(300);
  VisualMemory copy = memory;
  copy.remove(ViewId{5});
  copy.set_pose(ViewId{6}, ReferencePose{1.0, 2.0, 0.5});
  EXPECT_TRUE(memory.contains(ViewId{5}));
  EXPECT_EQ(memory.find("view 5"), ViewId{5});
  EXPECT_FALSE(memory.info(ViewId{6}).pose.has_value());
  EXPECT_EQ(copy.find("view 200"), ViewId{200});
  const PackedSignature query = memory.packed(ViewId{200});
  memory = copy;
  EXPECT_EQ(memory.size(), 299U);
  EXPECT_EQ(memory.search(query).matches, copy.search(query).matches);
  EXPECT_EQ(memory.search(query).matches.front(), (Match{ViewId{200}, 0}));
  const VisualMemory moved = std::move(copy);
  EXPECT_EQ(moved.search(query).matches, memory.search(query).matches);
  EXPECT_THROW(memory.set_pose(ViewId{6}, ReferencePose{NAN, 0.0, {}}), ContractError);
}

}  // namespace
}  // namespace panonav::testing
