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
  LocaliserOptions localiser;  ///< how many views are compared and listed
  /// How pictures lie; empty: as those that the memory was made from.
  std::optional<PictureSource> source;
  /// Also tell the area where the robot may be, component by component. The memory is held for it,
  /// as areas are cut out of the positions of all views.
  std::optional<LocalisationAccuracy> areas;
  /// A memory on a server with more views is not held but searched where it lies: 350 bytes a view
  /// instead of 2700, and a longer time for each picture (docs/scale.md). Files are always held.
  std::size_t max_held_views = 200'000;
  /// Views of which models are learnt at most in a memory that is not held.
  std::size_t max_learnt_views = 20'000;
};

/// Tells from one picture where it was taken, by a memory file:
///   panonav::PlaceRecogniser recogniser("office.panonav");
///   auto place = recogniser.localise(panonav::read_image("view.jpg"));
///   if (place.known) std::cout << place.position->x_m << ' ' << place.position->y_m << '\n';
/// (`position` is empty only for memories whose views have no poses.) Pictures become signatures as
/// the file says; models that no longer fit its views (`keep_models`) are learnt again, which takes
/// seconds in a large memory. Several threads may use one object.
///
/// The whole memory is held, or of a large one on a server only an index: the answers are the same
/// bits but for `bytes_read`. A memory that is not held and has more than `max_learnt_views` uses
/// the models that were kept last, or else learns from whole areas with that many views.
class PlaceRecogniser {
 public:
  /// Throws FileError on a file that is missing, damaged or without views, ContractError on options
  /// that do not fit it.
  explicit PlaceRecogniser(const std::filesystem::path& memory,
                           const PlaceRecogniserOptions& options = {});
  /// The same of a file that is open; its views are held, wherever it lies.
  explicit PlaceRecogniser(const MemoryFile& file, const PlaceRecogniserOptions& options = {});
  /// The same of a memory that is not held, by its index.
  PlaceRecogniser(std::unique_ptr<IndexedMemory> index, const std::filesystem::path& memory,
                  const PlaceRecogniserOptions& options = {});
  ~PlaceRecogniser();
  /// A moved-from object may only be destroyed or assigned to.
  PlaceRecogniser(PlaceRecogniser&&) noexcept;
  PlaceRecogniser& operator=(PlaceRecogniser&&) noexcept;

  /// Views called `excluded_names` are not found. Throws as `ViewEncoder::panorama`; where the
  /// memory is not held, FileError when its server cannot be reached, and the next picture may
  /// reach it again. Cost: that of `Localiser::localise` and 0.1 ms for a mirror picture.
  [[nodiscard]] Place localise(const Observation& observation,
                               std::span<const std::string> excluded_names = {}) const;

  [[nodiscard]] bool is_held() const noexcept;  ///< False: the memory is searched where it lies.
  [[nodiscard]] std::size_t size() const;       ///< Views that can be found.
  [[nodiscard]] const ViewEncoder& encoder() const noexcept;  ///< Makes queries of pictures.

  /// Adds a view that can be found from now on; it takes part in what is learnt of all views only
  /// in a new PlaceRecogniser. The file is not touched. Not while another thread asks. Throws
  /// ContractError as `VisualMemory::append`, and where the memory is not held.
  void append(const ReferenceInfo& info, const PackedSignature& signature);
  /// The views that are held. Throws ContractError where the memory is not.
  [[nodiscard]] const VisualMemory& memory() const;
  /// Returns what compares views; `localise` adds areas. Throws ContractError where the memory is
  /// not held.
  [[nodiscard]] const Localiser& localiser() const;

  /// Where the memory is not held, takes over which views came and went since, and what was learnt
  /// of them (`IndexedMemory::refresh`). Pictures are answered meanwhile. Not from two threads at a
  /// time. Returns whether anything changed.
  bool refresh();
  [[nodiscard]] std::uint64_t index_bytes() const;       ///< 0: the memory is held.
  [[nodiscard]] SearchCounters search_counters() const;  ///< Zeros where the memory is held.

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
