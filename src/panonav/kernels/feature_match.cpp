#include "panonav/kernels/feature_match.hpp"

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

void nearest_descriptors(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b,
                         std::span<std::uint16_t> nearest_of_a,
                         std::span<std::uint16_t> nearest_of_b, Instructions instructions) {
  const auto check = [](std::size_t words, std::size_t descriptors) {
    require(descriptors <= max_descriptors, "descriptors", static_cast<double>(descriptors),
            "0 .. 256");
    require(words == 4 * descriptors, "words of the descriptors", static_cast<double>(words),
            "four for each");
  };
  check(a.size(), nearest_of_a.size());
  check(b.size(), nearest_of_b.size());
  with_body<FeatureMatchBody>(instructions, [&](auto body) {
    body.nearest_descriptors(a.data(), nearest_of_a.size(), b.data(), nearest_of_b.size(),
                             nearest_of_a.data(), nearest_of_b.data());
  });
}

void count_explained(std::span<const BearingLane> lanes, std::span<const float> directions,
                     float square_tolerance, std::span<std::int32_t> counts,
                     Instructions instructions) {
  require(directions.size() == 2 * counts.size(), "cosines and sines of directions",
          static_cast<double>(directions.size()), "two for each count");
  with_body<FeatureMatchBody>(instructions, [&](auto body) {
    body.count_explained(lanes.data(), lanes.size(), directions.data(), counts.size(),
                         square_tolerance, counts.data());
  });
}

}  // namespace panonav::kernels
