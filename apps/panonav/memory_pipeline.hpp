#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/storage/memory_file.hpp"
#include "recording.hpp"

namespace panonav::command {

/// From a picture to what a memory compares, as the memory's header says. Reading from several
/// threads is safe.
class MemoryPipeline {
 public:
  /// Throws ContractError when the pictures' elevations are not the memory's.
  MemoryPipeline(const MemoryHeader& header, const PictureSource& source);

  /// Throws FileError on a picture that is missing, damaged or of another size than the memory's.
  [[nodiscard]] Panorama read(const DatasetEntry& entry) const;
  /// The same of a picture that is not in a file. Throws ContractError on one whose size is not the
  /// camera's.
  [[nodiscard]] Panorama convert(ImageView picture) const { return reader_.convert(picture); }
  [[nodiscard]] FourierSignature signature(const Panorama& panorama) const;
  [[nodiscard]] PackedSignature packed(const Panorama& panorama) const;

 private:
  MemoryHeader header_;
  PanoramaReader reader_;
  std::optional<PanoramaShape> picture_shape_;  ///< of panoramas that are resampled
};

/// The size of the cylinders of a new memory, with the defaults filled in; 0: a panorama's own.
[[nodiscard]] PanoramaShape wanted_shape(const Dataset& recording, const SignatureOptions& options);

/// The largest magnitude of k >= 1. k = 0 is the mean brightness: much larger than the rest, and it
/// tells more of the light than of the place, so it may saturate.
[[nodiscard]] float largest_structure(const FourierSignature& signature);

/// A small picture of the view for people, as PNG.
[[nodiscard]] std::vector<std::uint8_t> thumbnail_png(const Panorama& panorama);

/// Calls body(i) for 0 .. count - 1 on all threads.
void for_each_entry(Executor& executor, std::size_t count,
                    const std::function<void(std::size_t)>& body);

}  // namespace panonav::command
