#include "panonav/localisation/sample.hpp"

#include <algorithm>
#include <utility>

#include "panonav/core/random.hpp"

namespace panonav {

void visit_options(LearningOptions& options, OptionVisitor& visitor) {
  using T = LearningOptions;
  constexpr OptionTable table{
      option<&T::sampled_views>("number of views that are used as test images to learn the models",
                                8, 1e6),
      option<&T::compared_views>("number of views with which each test image is compared", 8, 1e6),
      option<&T::seed>("seed of the random selection", 0),
  };
  table.visit(options, visitor);
}

std::vector<ViewId> sample_views(std::span<const ViewId> views, int count, std::uint64_t seed) {
  std::vector<ViewId> sample(views.begin(), views.end());
  const auto size = static_cast<std::size_t>(count);
  if (sample.size() <= size) return sample;
  Random random(seed);
  for (std::size_t i = 0; i < size; ++i) {
    std::swap(sample[i], sample[i + random.index(sample.size() - i)]);
  }
  sample.resize(size);
  std::ranges::sort(sample);
  return sample;
}

}  // namespace panonav
