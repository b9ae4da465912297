#include "runs/memorising.hpp"

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

}  // namespace panonav::command
