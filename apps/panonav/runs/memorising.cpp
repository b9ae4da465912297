#include "runs/memorising.hpp"

#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/memory_map.hpp"
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace panonav::command {

void require_stored_options(const Arguments& declared, const SignatureOptions& signature,
                            const PreprocessingOptions& preprocessing, const MemoryFile& memory) {
  const MemoryHeader& header = memory.header();
  const std::string message_end =
      ", as " + memory.path().string() + " was made with; leave it out or start a new memory";
  // Replaces 0 by the default size of such images, or by the size of the memory's images.
  const PanoramaShape default_shape = choose_panorama_shape(header.source, {});
  const PanoramaShape image_shape =
      header.picture_shape.value_or(PanoramaShape{header.shape.rows, header.panorama_columns});
  SignatureOptions arguments = signature;
  if (arguments.rows == 0)
    arguments.rows = default_shape.rows > 0 ? default_shape.rows : image_shape.rows;
  if (arguments.columns == 0)
    arguments.columns = default_shape.columns > 0 ? default_shape.columns : image_shape.columns;
  declared.require_same(
      "signature", arguments,
      SignatureOptions{header.shape.rows, header.panorama_columns, header.shape.components},
      message_end);
  declared.require_same("preprocessing", preprocessing, header.preprocessing, message_end);
}

void print_views_without_position(const MemoryFile& memory, Session& session) {
  const auto info = memory.counts();
  const std::uint64_t without = info.views - info.views_with_position;
  if (without == 0 || info.views_with_position == 0 || has_positions_from_map(memory)) return;
  session.print(session.red(std::to_string(without) + " of " + format_count(info.views, "view") +
                            (without == 1 ? " has no position" : " have no position")) +
                ": the other positions come from a data set, and " +
                (without == 1 ? "this image" : "these images") +
                " came without one. localise can name such a view, but gives no position near it; "
                "track and drawn maps leave it out.");
}

void return_freed_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace panonav::command
