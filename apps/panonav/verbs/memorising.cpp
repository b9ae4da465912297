#include "verbs/memorising.hpp"

#include <algorithm>
#include <vector>

#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"

namespace panonav::command {

MemoryHeader header_from_first_views(const Dataset& recording, const SignatureOptions& wanted,
                                     const PreprocessingOptions& preprocessing,
                                     Executor& executor) {
  const std::size_t count = std::min(Memoriser::scale_views, recording.entries.size());
  std::vector<Observation> first(count, Observation(Image(1, 1)));
  for_each_entry(executor, count,
                 [&](std::size_t i) { first[i] = read_observation(recording.entries[i]); });
  return header_from_first(first, recording.source, wanted, preprocessing, executor);
}

}  // namespace panonav::command
