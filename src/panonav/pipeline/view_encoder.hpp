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

/// Requested size of the panoramic cylinders; 0: 80 x 512 [M04 section 2.1] for mirror and 360
/// degree images, the image's own size for ready-made panoramas.
struct SignatureOptions {
  int rows = 0;         ///< 0, or >= 1
  int columns = 0;      ///< 0, or >= 4
  int components = 15;  ///< 1 .. half the columns
};
void visit_options(SignatureOptions& options, OptionVisitor& visitor);

/// Encodes images as the views that a memory compares, as the memory's header says. Tables are made
/// once and buffers are reused. Several threads may use one encoder.
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

  /// Returns the panoramic cylinder of an observation. Throws ContractError (FileError where the
  /// observation has a file) on a picture of another size or band than the memory's, and on a tilt
  /// (`Observation::tilt`) that cannot be compensated.
  [[nodiscard]] Panorama panorama(const Observation& observation) const;
  /// Returns the panoramic cylinder of a picture.
  [[nodiscard]] Panorama panorama(ImageView picture, const Tilt& tilt = {}) const;
  /// Reads a picture. Throws FileError if it is missing, damaged or of another size than the
  /// memory's.
  [[nodiscard]] Panorama read(const DatasetEntry& entry) const;

  /// Computes the signature of an observation, bit for bit the same from an image or its panorama.
  /// Images of a level robot with a mirror go through the fused `SignatureExtractor` without a
  /// panorama. Throws as `panorama`.
  [[nodiscard]] FourierSignature signature(const Observation& observation) const;
  /// Computes the signature of a picture as the camera of a level robot delivers it.
  [[nodiscard]] FourierSignature signature(ImageView picture) const;
  /// Computes the signature of a panorama of the memory's shape.
  [[nodiscard]] FourierSignature signature(const Panorama& panorama) const;
  /// Computes the signature, packed with the memory's full scale.
  [[nodiscard]] PackedSignature packed(const Observation& observation) const;
  /// Computes the packed signature of an image of a level robot.
  [[nodiscard]] PackedSignature packed(ImageView picture) const;
  /// Computes the packed signature of a panorama of the memory's shape.
  [[nodiscard]] PackedSignature packed(const Panorama& panorama) const;

  /// Extracts the local features of a panorama of the memory's shape; empty where elevations are
  /// unknown.
  [[nodiscard]] std::optional<LocalFeatures> features(const Panorama& panorama) const;

 private:
  [[nodiscard]] Panorama checked(Panorama panorama) const;
  void check_band(const std::optional<ElevationBand>& band) const;

  class Workspaces;
  MemoryHeader header_;
  PanoramaReader reader_;
  SignatureExtractor extractor_;
  std::unique_ptr<Workspaces> workspaces_;
  std::optional<PanoramaShape> picture_shape_;  ///< of panoramas that are resampled
};

/// Returns the size of the cylinders of a new memory, with defaults filled in; 0: that of the
/// panorama.
[[nodiscard]] PanoramaShape choose_panorama_shape(const PictureSource& source,
                                                  const SignatureOptions& options);

/// Returns the largest magnitude of all frequencies k >= 1. The mean brightness, k = 0, is much
/// larger and depends more on the light than on the place, so it may saturate.
[[nodiscard]] float largest_nonconstant_magnitude(const FourierSignature& signature);

/// Returns a small image of the view for people, as PNG.
[[nodiscard]] std::vector<std::uint8_t> encode_thumbnail(const Panorama& panorama);

/// Restores the panorama of a thumbnail that `encode_thumbnail` made, enlarged to the memory's
/// size. Columns and rows that did not fill a pixel of the thumbnail are missing; the rest is
/// stretched over them, by less than one pixel. Empty if the image cannot be decoded or has another
/// size than thumbnails of this memory.
[[nodiscard]] std::optional<Panorama> panorama_from_thumbnail(
    std::span<const std::uint8_t> thumbnail, const MemoryHeader& header);
/// Restores the panorama of a view's thumbnail; empty if it has none.
[[nodiscard]] std::optional<Panorama> panorama_from_thumbnail(const MemoryFile& file, ViewId view);
/// Returns the columns of a memory's thumbnails, at most 256.
[[nodiscard]] int thumbnail_columns(const MemoryHeader& header) noexcept;

/// Calls body(i) for 0 .. count - 1 on all threads.
void parallel_for(Executor& executor, std::size_t count,
                  const std::function<void(std::size_t)>& body);

}  // namespace panonav
