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

void require_kept_options(const Arguments& arguments, const SignatureOptions& signature,
                          const PreprocessingOptions& preprocessing, const MemoryFile& memory) {
  const MemoryHeader& header = memory.header();
  const std::string as =
      ", as " + memory.path().string() + " was made with; leave it out or start a new memory";
  // 0 stands for the usual size, or for the pictures' own.
  const PanoramaShape usual = wanted_shape(header.source, {});
  const PanoramaShape own =
      header.picture_shape.value_or(PanoramaShape{header.shape.rows, header.panorama_columns});
  SignatureOptions wanted = signature;
  if (wanted.rows == 0) wanted.rows = usual.rows > 0 ? usual.rows : own.rows;
  if (wanted.columns == 0) wanted.columns = usual.columns > 0 ? usual.columns : own.columns;
  arguments.require_kept(
      "signature", wanted,
      SignatureOptions{header.shape.rows, header.panorama_columns, header.shape.components}, as);
  arguments.require_kept("preprocessing", preprocessing, header.preprocessing, as);
}

}  // namespace panonav::command
