#include "runs/memorising.hpp"

namespace panonav::command {

void require_stored_options(const Arguments& declared, const SignatureOptions& signature,
                            const PreprocessingOptions& preprocessing, const MemoryFile& memory) {
  const MemoryHeader& header = memory.header();
  const std::string as =
      ", as " + memory.path().string() + " was made with; leave it out or start a new memory";
  // 0 stands for the usual size, or for the pictures' own.
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
      SignatureOptions{header.shape.rows, header.panorama_columns, header.shape.components}, as);
  declared.require_same("preprocessing", preprocessing, header.preprocessing, as);
}

}  // namespace panonav::command
