#include "panonav/memory/view_index.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panonav::testing {
namespace {

/// Views with a position on the line y = x, but for the last one, which has none.
VisualMemory make_diagonal_memory(int views) {
  const SignatureShape shape{2, 2};
  VisualMemory memory(shape, 1.0F, std::nullopt);
  for (int i = 0; i < views; ++i) {
    const auto value = static_cast<std::uint8_t>(10 * i);
    const PackedSignature signature{shape, std::vector(4, value), std::vector<std::uint8_t>(4)};
    ReferenceInfo info{.name = "view " + std::to_string(i)};
    if (i + 1 < views) info.pose = ReferencePose{1.0 * i, 1.0 * i, std::nullopt};
    memory.append(signature, info);
  }
  return memory;
}

TEST(HeldViewIndex, FindsWhatTheMemoryFinds) {
  const VisualMemory memory = make_diagonal_memory(8);
  HeldViewIndex index(memory);
  EXPECT_EQ(index.size(), 8U);
  const PackedSignature query = memory.packed(memory.views()[5]);
  EXPECT_EQ(index.search(query, {.top = 4}, {}).matches, memory.search(query, {.top = 4}).matches);
  EXPECT_EQ(index.find("view 3"), memory.views()[3]);
  EXPECT_EQ(index.find("nobody"), std::nullopt);
}

TEST(HeldViewIndex, LoadsThoseViewsThatThereAre) {
  const VisualMemory memory = make_diagonal_memory(6);
  HeldViewIndex index(memory);
  const ViewId a = memory.views()[1];
  const ViewId b = memory.views()[4];
  const VisualMemory part = index.load(std::vector{b, ViewId{1000}, a, b});
  ASSERT_EQ(part.size(), 2U);
  EXPECT_EQ(part.info(a), memory.info(a));
  EXPECT_EQ(part.packed(b), memory.packed(b));
}

TEST(HeldViewIndex, FindsViewsWithinOneOfTheRectanglesOnce) {
  const VisualMemory memory = make_diagonal_memory(8);
  HeldViewIndex index(memory);
  const std::vector<PositionBounds> bounds{{0.5, 2.0, 0.5, 2.0}, {2.0, 3.0, 2.0, 3.5}};
  const auto views = memory.views();
  EXPECT_EQ(index.views_within(bounds), (std::vector<ViewId>{views[1], views[2], views[3]}));
  EXPECT_TRUE(index.views_within({}).empty());
}

}  // namespace
}  // namespace panonav::testing
