#include "runs/memorising.hpp"

namespace panonav::command {

void require_kept_options(const Arguments& arguments, const SignatureOptions& signature,
                          const PreprocessingOptions& preprocessing, const MemoryFile& memory) {
  const MemoryHeader& header = memory.header();
  const std::string as =
      ", as " + memory.path().string() + " was made with; leave it out or start a new memory";
  // 0 stands for the usual size, or for the pictures' own.
  const PanoramaShape usual = choose_panorama_shape(header.source, {});
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
