#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/core/options.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/signature/local_features.hpp"
#include "panonav/signature/signature_extractor.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Requested size of panoramic cylinders and signatures. 0 rows or columns: 80 x 512 [M04 section
/// 2.1] for mirror and 360 degree images, the image's own size for ready-made panoramas.
struct SignatureOptions {
  int rows = 0;         ///< 0, or >= 1
  int columns = 0;      ///< 0, or >= 4
  int components = 15;  ///< 1 .. half the columns
};
void visit_options(SignatureOptions& options, OptionVisitor& visitor);

/// Encodes images into signatures that can be compared with a memory's views, by the settings in
/// the memory's header. Makes its tables once and reuses buffers. Several threads may use one
/// encoder concurrently.
class ViewEncoder {
 public:
  /// `source`: layout of the images; `header.source` for the memory's own camera. Throws
  /// ContractError if the images have other elevations than the memory.
  ViewEncoder(const MemoryHeader& header, const PictureSource& source);
  ~ViewEncoder();
  /// A moved-from object may only be destroyed or assigned to.
  ViewEncoder(ViewEncoder&&) noexcept;
  ViewEncoder& operator=(ViewEncoder&&) noexcept;

  /// Returns the header of the memory.
  [[nodiscard]] const MemoryHeader& header() const noexcept { return header_; }

  /// Returns the panoramic cylinder of an observation. Throws ContractError (FileError if the
  /// observation has a file) if its size or elevation band differs from the memory's, and on a tilt
  /// (`Observation::tilt`) that cannot be compensated.
  [[nodiscard]] Panorama panorama(const Observation& observation) const;
  /// Returns the panoramic cylinder of a picture.
  [[nodiscard]] Panorama panorama(ImageView picture, const Tilt& tilt = {}) const;
  /// Reads a picture and returns its panoramic cylinder. Throws FileError if the picture is
  /// missing, damaged or of another size than the memory's.
  [[nodiscard]] Panorama read(const DatasetEntry& entry) const;

  /// Throws like `panorama` if the size or the elevation band of an observation differs from the
  /// memory's, but computes no panorama.
  void require_fit(const Observation& observation) const;

  /// Computes the signature of an observation. The result is the same, bit for bit, for an image
  /// and its panorama. Mirror images of a level robot are processed by the fused
  /// `SignatureExtractor`, without computing a panorama. Throws like `panorama`.
  [[nodiscard]] FourierSignature signature(const Observation& observation) const;
  /// Computes the signature of a camera picture of a level robot.
  [[nodiscard]] FourierSignature signature(ImageView picture) const;
  /// Computes the signature of a panorama of the memory's shape.
  [[nodiscard]] FourierSignature signature(const Panorama& panorama) const;
  /// Computes the signature, packed with the memory's full scale.
  [[nodiscard]] PackedSignature packed(const Observation& observation) const;
  /// Computes the packed signature of an image of a level robot.
  [[nodiscard]] PackedSignature packed(ImageView picture) const;
  /// Computes the packed signature of a panorama of the memory's shape.
  [[nodiscard]] PackedSignature packed(const Panorama& panorama) const;

  /// Extracts the local features of a panorama of the memory's shape; nullopt if elevations are
  /// unknown.
  [[nodiscard]] std::optional<LocalFeatures> features(const Panorama& panorama) const;

 private:
  [[nodiscard]] Panorama check_panorama(Panorama panorama) const;
  void require_fit(const Panorama& panorama) const;
  void check_band(const std::optional<ElevationBand>& band) const;

  class Workspaces;
  MemoryHeader header_;
  PanoramaReader reader_;
  SignatureExtractor extractor_;
  std::unique_ptr<Workspaces> workspaces_;
  std::optional<PanoramaShape> picture_shape_;  ///< required size of panoramas that are resampled
};

/// Returns the size of the cylinders of a new memory, with defaults filled in; 0: the size of the
/// ready-made panorama.
[[nodiscard]] PanoramaShape choose_panorama_shape(const PictureSource& source,
                                                  const SignatureOptions& options);

/// Returns the largest magnitude of all frequencies k >= 1, used as the full scale for packing. The
/// mean brightness (k = 0) is left out: it is much larger and depends more on the light than on the
/// place, so it may saturate.
[[nodiscard]] float largest_nonconstant_magnitude(const FourierSignature& signature);

/// Returns a small image of the view for display, at most 256 columns wide.
[[nodiscard]] Image make_thumbnail(const Panorama& panorama);
/// Returns the file of `make_thumbnail`: a PNG of panoramas of at most 256 columns, which
/// is exact; a JPEG of larger ones.
[[nodiscard]] std::vector<std::uint8_t> encode_thumbnail(const Panorama& panorama);

/// Restores the panorama of a thumbnail made by `encode_thumbnail`, enlarged to the memory's size.
/// Last columns and rows that did not fill a whole thumbnail pixel are lost; the image is stretched
/// over them, by less than one thumbnail pixel. nullopt if the image cannot be decoded or has
/// another size than thumbnails of this memory.
[[nodiscard]] std::optional<Panorama> panorama_from_thumbnail(
    std::span<const std::uint8_t> thumbnail, const MemoryHeader& header);
/// Restores the panorama of a view's thumbnail; nullopt if it has none.
[[nodiscard]] std::optional<Panorama> panorama_from_thumbnail(const MemoryFile& file, ViewId view);
/// Returns the number of columns of a memory's thumbnails, at most 256.
[[nodiscard]] int thumbnail_columns(const MemoryHeader& header) noexcept;

/// Calls body(i) for 0 .. count - 1 on all threads.
void parallel_for(Executor& executor, std::size_t count,
                  const std::function<void(std::size_t)>& body);

}  // namespace panonav
