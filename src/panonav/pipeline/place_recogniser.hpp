#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/localisation/hierarchical.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// A view of the memory that a picture resembles.
struct PlaceMatch {
  std::string name;                 ///< of the view
  ViewId view;                      ///< its id in the memory
  std::uint32_t dissimilarity = 0;  ///< integer L1 over packed magnitudes
  double column_difference = 0.0;   ///< after turning (`ColumnMatch`)
  /// Local features that agree with one turn and one direction of motion; empty where they do not
  /// decide.
  std::optional<int> verified_features;
  /// Of the robot relative to this view; empty when one of them has no structure.
  std::optional<double> heading_rad;
};

/// Where the robot is, in the frame of the memory's positions.
struct PlacePosition {
  double x_m = 0.0;  ///< along the frame's x axis
  double y_m = 0.0;  ///< along its y axis
  /// The true position lies within it in 95 % of the cases; empty when nothing could be learnt.
  std::optional<double> radius_m;
};

/// What one picture tells of where it was taken; see `Localisation` for what each means.
struct Place {
  double known_probability = 0.0;         ///< that the place is one of the memory's
  bool known = false;                     ///< at least 0.5 probable
  std::vector<PlaceMatch> matches;        ///< the best first; listed for unknown places, too
  std::optional<PlacePosition> position;  ///< between references; empty for an unknown place
  /// Of the robot, in the same frame; empty for an unknown place.
  std::optional<double> heading_rad;
  int components = 0;            ///< compared
  std::uint64_t bytes_read = 0;  ///< by the search
  /// From coarse to fine, where they were asked for; empty otherwise.
  std::vector<LocalisationLevel> areas;
};

/// What a recogniser compares and tells.
struct PlaceRecogniserOptions {
  LocaliserOptions localiser;  ///< how many views are compared and listed
  /// How pictures lie; empty: as those that the memory was made from.
  std::optional<PictureSource> source;
  /// Also tell the area where the robot may be, component by component.
  std::optional<WantedAccuracy> areas;
};

/// Tells from one picture where it was taken, by a memory file:
///   panonav::PlaceRecogniser recogniser("office.panonav");
///   auto place = recogniser.localise(panonav::read_image("view.jpg"));
///   if (place.known) std::cout << place.position->x_m << ' ' << place.position->y_m << '\n';
/// (`position` is empty only for memories whose views have no poses.) Pictures become signatures as
/// the file says, and what is learnt of its views comes from the file, too (`keep_models`); models
/// that do not fit the views any more are learnt anew, which takes seconds in a large memory.
/// Holds the whole memory; the file is not needed afterwards. Several threads may ask at a time.
class PlaceRecogniser {
 public:
  /// Throws FileError on a file that is missing, damaged or without views, ContractError on options
  /// that do not fit it.
  explicit PlaceRecogniser(const std::filesystem::path& memory,
                           const PlaceRecogniserOptions& options = {});
  /// The same of a file that is open.
  explicit PlaceRecogniser(const MemoryFile& file, const PlaceRecogniserOptions& options = {});
  ~PlaceRecogniser();
  /// What is left of the other may only be destroyed or assigned to.
  PlaceRecogniser(PlaceRecogniser&&) noexcept;
  PlaceRecogniser& operator=(PlaceRecogniser&&) noexcept;

  /// Views called `excluded_names` are not found. Throws as `ViewEncoder::panorama`. Cost: that of
  /// `Localiser::localise` and 0.1 ms for a mirror picture.
  [[nodiscard]] Place localise(const Observation& observation,
                               std::span<const std::string> excluded_names = {}) const;

  /// A view that can be found from now on; it takes part in what is learnt of all views only in a
  /// new PlaceRecogniser. The file is not touched. Not while another thread asks. Throws
  /// ContractError as `VisualMemory::append`.
  void append(const ReferenceInfo& info, const PackedSignature& signature);

  [[nodiscard]] const VisualMemory& memory() const noexcept;  ///< The views that are held.
  [[nodiscard]] const ViewEncoder& encoder() const noexcept;  ///< What makes queries of pictures.
  /// What compares views; `localise` gives its answers by name.
  [[nodiscard]] const Localiser& localiser() const noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
