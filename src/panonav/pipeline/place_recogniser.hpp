#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "panonav/localisation/localiser_options.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "panonav/pipeline/observation.hpp"

namespace panonav {

class IndexedMemory;
class Localiser;
class MemoryFile;
class ViewEncoder;
struct SearchCounters;

/// Options of a place recogniser.
struct PlaceRecogniserOptions {
  LocaliserOptions localiser;  ///< number of views compared and listed
  /// Layout of the pictures; empty: that of the memory's own.
  std::optional<PictureSource> source;
  /// Compute also the area where the robot may be, component by component. This holds the
  /// memory, as areas are computed from the positions of all views.
  std::optional<LocalisationAccuracy> areas;
  /// Largest number of views for which a memory on a server is held. Larger ones are searched on
  /// the server: 350 bytes a view instead of 2700, but more time for each image (docs/scale.md).
  /// Files are always held.
  std::size_t max_held_views = 200'000;
  /// Largest number of views from which models are learnt in a memory that is not held.
  std::size_t max_learnt_views = 20'000;
};

/// Computes from one picture where it was taken, by a memory file:
///   panonav::PlaceRecogniser recogniser("office.panonav");
///   auto place = recogniser.localise(panonav::read_image("view.jpg"));
///   if (place.known) std::cout << place.position->x_m << ' ' << place.position->y_m << '\n';
/// (`position` is empty only for memories whose views have no poses.) Models that no longer fit the
/// views of the file (`learn_and_store_models`) are learnt again, which takes seconds in a large
/// memory. Several threads may use one object.
///
/// Holds the whole memory, or of a large one on a server only an index: the answers are the same
/// bits but for `bytes_read`. A memory that is not held and has more than `max_learnt_views` uses
/// the models that were kept last, or else learns from whole areas with that many views.
class PlaceRecogniser {
 public:
  /// Throws FileError on a file that is missing, damaged or without views, ContractError on options
  /// that do not fit it.
  explicit PlaceRecogniser(const std::filesystem::path& memory,
                           const PlaceRecogniserOptions& options = {});
  /// Uses an open file or memory on a server; its views are held.
  explicit PlaceRecogniser(const MemoryFile& file, const PlaceRecogniserOptions& options = {});
  /// Uses a memory that is not held, through its index.
  PlaceRecogniser(std::unique_ptr<IndexedMemory> index, const std::filesystem::path& memory,
                  const PlaceRecogniserOptions& options = {});
  ~PlaceRecogniser();
  /// A moved-from object may only be destroyed or assigned to.
  PlaceRecogniser(PlaceRecogniser&&) noexcept;
  PlaceRecogniser& operator=(PlaceRecogniser&&) noexcept;

  /// Finds the place of an observation. Views with names in `excluded_names` are ignored. Throws as
  /// `ViewEncoder::panorama`; if the memory is not held, FileError while its server cannot be
  /// reached. Cost: that of `Localiser::localise` and 0.1 ms for a mirror image.
  [[nodiscard]] Place localise(const Observation& observation,
                               std::span<const std::string> excluded_names = {}) const;

  [[nodiscard]] bool is_held() const noexcept;  ///< False: it is searched on its server.
  [[nodiscard]] std::size_t size() const;       ///< Returns the number of views that can be found.
  [[nodiscard]] const ViewEncoder& encoder() const noexcept;  ///< Returns the encoder.

  /// Adds a view that can be found from now on; models learn from it only in a new PlaceRecogniser.
  /// The file is not changed. No other thread may use *this meanwhile. Throws ContractError as
  /// `VisualMemory::append`, and if the memory is not held.
  void append(const ReferenceInfo& info, const PackedSignature& signature);
  /// Returns the held views. Throws ContractError if the memory is not held.
  [[nodiscard]] const VisualMemory& memory() const;
  /// Returns the localiser, which compares views; `localise` adds areas. Throws ContractError where
  /// the memory is not held.
  [[nodiscard]] const Localiser& localiser() const;

  /// Updates the index of a memory that is not held to views that were added and removed since, and
  /// the models learnt from them (`IndexedMemory::refresh`). Other threads may localise meanwhile,
  /// but only one may refresh. Returns true if anything changed.
  bool refresh();
  [[nodiscard]] std::uint64_t index_bytes() const;       ///< Returns 0 if the memory is held.
  [[nodiscard]] SearchCounters search_counters() const;  ///< Returns zeros if the memory is held.

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
