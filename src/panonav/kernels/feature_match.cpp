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

void nearest_histograms(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b,
                        std::span<std::uint16_t> nearest_of_a,
                        std::span<std::int32_t> distances_of_a,
                        std::span<std::uint16_t> nearest_of_b, Instructions instructions) {
  const auto check = [](std::size_t values, std::size_t histograms) {
    require(histograms <= max_histograms, "histograms", static_cast<double>(histograms),
            "0 .. 1024");
    require(values == histogram_dimensions * histograms, "values of the histograms",
            static_cast<double>(values), "128 for each");
  };
  check(a.size(), nearest_of_a.size());
  check(b.size(), nearest_of_b.size());
  require(distances_of_a.size() == nearest_of_a.size(), "distances",
          static_cast<double>(distances_of_a.size()), "one for each histogram");
  with_body<FeatureMatchBody>(instructions, [&](auto body) {
    body.nearest_histograms(a.data(), nearest_of_a.size(), b.data(), nearest_of_b.size(),
                            nearest_of_a.data(), distances_of_a.data(), nearest_of_b.data());
  });
}

void count_explained(const MatchedBearings& matched, const MatchedBearings::Turn& turn,
                     const MotionHypotheses& hypotheses, std::span<std::int32_t> counts,
                     Instructions instructions) {
  require(counts.size() == 2 * motion_axes, "counts", static_cast<double>(counts.size()),
          "two for each axis");
  with_body<FeatureMatchBody>(instructions, [&](auto body) {
    body.count_explained(matched, turn, hypotheses, counts.data());
  });
}

}  // namespace panonav::kernels
