#include "panonav/localisation/sample.hpp"

#include <algorithm>
#include <utility>

#include "panonav/core/random.hpp"

namespace panonav {

std::vector<ViewId> sample_views(std::span<const ViewId> views, int count, std::uint64_t seed) {
  std::vector<ViewId> sample(views.begin(), views.end());
  const auto wanted = static_cast<std::size_t>(count);
  if (sample.size() <= wanted) return sample;
  Random random(seed);
  for (std::size_t i = 0; i < wanted; ++i) {
    std::swap(sample[i], sample[i + random.index(sample.size() - i)]);
  }
  sample.resize(wanted);
  std::ranges::sort(sample);
  return sample;
}

}  // namespace panonav
