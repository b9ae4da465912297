#include "panonav/relative_pose/homing_view.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"

namespace panonav {
namespace {

// Every byte as a phase, magnitudes of 0 among them.
VisualMemory memory_of_noise(std::uint64_t seed, int first, int end) {
  constexpr SignatureShape shape{16, 16};
  Random random(seed);
  VisualMemory memory(shape, 37.5F, ElevationBand{-0.6, 0.6});
  for (int view = first; view < end; ++view) {
    PackedSignature packed{shape, {}, {}};
    for (std::size_t i = 0; i < shape.size(); ++i) {
      packed.magnitudes.push_back(static_cast<std::uint8_t>(random.index(8) * random.index(32)));
      packed.phases.push_back(static_cast<std::uint8_t>(i));
    }
    memory.append_with_id(ViewId{static_cast<std::uint32_t>(view)}, packed,
                          {.name = std::to_string(view)});
  }
  return memory;
}

TEST(HomingViewOfBytes, IsThatOfTheUnpackedSignatureToTheBit) {
  const VisualMemory memory = memory_of_noise(1, 0, 5);
  for (const ViewId view : memory.views()) {
    const HomingView direct = homing_view(memory, view);
    const HomingView unpacked = homing_view(memory.signature(view));
    ASSERT_EQ(direct, unpacked);
    for (int k = 0; k < direct.components(); ++k) {
      for (int y = 0; y < direct.rows(); ++y) {
        // Equality alone would pass a zero of the other sign.
        EXPECT_EQ(std::bit_cast<std::uint32_t>(direct.a(y, k)),
                  std::bit_cast<std::uint32_t>(unpacked.a(y, k)));
        EXPECT_EQ(std::bit_cast<std::uint32_t>(direct.b(y, k)),
                  std::bit_cast<std::uint32_t>(unpacked.b(y, k)));
      }
    }
  }
  EXPECT_THROW((void)homing_view(memory, ViewId{5}), ContractError);
}

// References are kept whole, and are compared with views of which a robot needs less.
TEST(HomingView, OfAWholeViewOnlyTheCommonComponentsCount) {
  const VisualMemory memory = memory_of_noise(4, 0, 2);
  const HomingView reference = homing_view(memory, ViewId{0});
  const HomingView seen = first_components(homing_view(memory, ViewId{1}), 6);
  EXPECT_EQ(image_difference(reference, seen),
            image_difference(first_components(reference, 6), seen));
}

}  // namespace
}  // namespace panonav
