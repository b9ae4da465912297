#include "panonav/kernels/sketch.hpp"

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

EncodedSums encode_sums(std::span<const std::int32_t> sums, const SumScale& scale,
                        std::uint8_t* codes, std::size_t stride, Instructions instructions) {
  require(sums.size() == 8 * scale.groups, "sums", static_cast<double>(sums.size()),
          "8 for each group");
  return with_body<SketchBody>(
      instructions, [&](auto body) { return body.encode_sums(sums.data(), scale, codes, stride); });
}

}  // namespace panonav::kernels
