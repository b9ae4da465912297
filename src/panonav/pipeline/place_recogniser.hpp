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
#include "panonav/pipeline/memory_map.hpp"
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
  /// Layout of the pictures; nullopt: that of the memory. Pictures of the kind `pinhole`, which
  /// show a part of the azimuth, need a memory with features for them (`MemoriserOptions::narrow`).
  std::optional<PictureSource> source;
  /// Also compute the areas in which the robot may be (`localise_hierarchically`). The memory is
  /// then held in RAM, as areas depend on the positions of all views.
  std::optional<LocalisationAccuracy> areas;
  /// Largest number of views of a memory on a server that is held in RAM. Larger memories are
  /// searched on the server, which takes more time for each image but 350 instead of 2700 bytes of
  /// RAM for each view (docs/scale.md). Memory files are always held.
  std::size_t max_held_views = 200'000;
  /// Largest number of views from which models are learnt in a memory that is not held.
  std::size_t max_learnt_views = 20'000;
};

/// Computes from one picture where it was taken, by a memory file:
///   panonav::PlaceRecogniser recogniser("office.panonav");
///   auto place = recogniser.localise(panonav::read_image("view.jpg"));
///   if (place.known) std::cout << place.matches.front().name << '\n';
///   if (place.position) std::cout << place.position->x_m << ' ' << place.position->y_m << '\n';
/// If the stored models are not those of the present views (`learn_and_store_models`), learns new
/// ones, which takes seconds for a large memory. Several threads may use one object concurrently.
///
/// Holds the whole memory, or an index of a large memory on a server: the results are the same
/// except `bytes_read`. A memory that is not held and has more than
/// `max_learnt_views` uses the models stored last, or learns from whole areas that contain about
/// this number of views.
class PlaceRecogniser {
 public:
  /// Throws FileError if the file is missing, damaged or has no views; ContractError if the options
  /// do not fit the memory.
  explicit PlaceRecogniser(const std::filesystem::path& memory,
                           const PlaceRecogniserOptions& options = {});
  /// Uses an open file or memory on a server and holds its views in RAM.
  explicit PlaceRecogniser(const MemoryFile& file, const PlaceRecogniserOptions& options = {});
  /// Uses a memory that is not held, through its index.
  PlaceRecogniser(std::unique_ptr<IndexedMemory> index, const std::filesystem::path& memory,
                  const PlaceRecogniserOptions& options = {});
  ~PlaceRecogniser();
  /// A moved-from object may only be destroyed or assigned to.
  PlaceRecogniser(PlaceRecogniser&&) noexcept;
  PlaceRecogniser& operator=(PlaceRecogniser&&) noexcept;

  /// Finds the place of an observation. One with `Observation::narrow_source` is compared as a
  /// narrow picture; the first such one takes time to load their features. Ignores views with names
  /// in `excluded_names`. Throws like `ViewEncoder::panorama`; if the memory is not held, FileError
  /// if its server cannot be reached. Cost: that of `Localiser::localise`, and 0.1 ms if a mirror
  /// image is needed.
  [[nodiscard]] Place localise(const Observation& observation,
                               std::span<const std::string> excluded_names = {}) const;

  /// Returns the unit of all positions when the memory was opened: names with `_m` are in metres
  /// only if it is metres.
  [[nodiscard]] LengthUnit length_unit() const noexcept;
  [[nodiscard]] bool is_memory_held() const noexcept;  ///< False: the server is searched.
  [[nodiscard]] std::size_t size() const;  ///< Returns the number of views that can be found.
  [[nodiscard]] const ViewEncoder& encoder() const noexcept;  ///< Returns the encoder.

  /// Adds a view that can be found from now on, without changing the file or the models. No other
  /// thread may use *this meanwhile. Throws ContractError like `VisualMemory::append`, and if the
  /// memory is not held.
  void append(const ReferenceInfo& info, const PackedSignature& signature);
  /// Returns the held views. Throws ContractError if the memory is not held.
  [[nodiscard]] const VisualMemory& memory() const;
  /// Returns the localiser, whose places have no areas. Throws ContractError if the memory is not
  /// held.
  [[nodiscard]] const Localiser& localiser() const;

  /// If the memory is not held, updates the index (`IndexedMemory::refresh`) and the models after
  /// other programs added or removed views. Other threads may localise meanwhile, but only one may
  /// refresh. Returns true if anything changed.
  bool refresh();
  [[nodiscard]] std::uint64_t index_bytes() const;       ///< Returns 0 if the memory is held.
  [[nodiscard]] SearchCounters search_counters() const;  ///< Returns zeros if the memory is held.

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
