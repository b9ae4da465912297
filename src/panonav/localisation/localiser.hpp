#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/localisation/place_model.hpp"
#include "panonav/localisation/position_model.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

/// A reference view that the query resembles.
struct LocalisedMatch {
  ViewId view;
  std::uint32_t dissimilarity = 0;
  PlaceEvidence evidence;  ///< with the heading of the query relative to this view
};

/// Where the robot is, as far as it can be told from one view.
struct Localisation {
  /// False: this is no place of the memory (`PlaceModel`). The matches are listed all the same.
  bool known = false;
  double evidence = 0.0;                ///< what `known` was decided on; 0 when nothing matched
  std::vector<LocalisedMatch> matches;  ///< ascending (dissimilarity, view)
  /// Interpolated between references; empty when the place is unknown or the nearest view has no
  /// pose.
  std::optional<PositionEstimate> position;
  /// Absolute, in [-pi, pi); empty when the place is unknown or none of the four nearest views has
  /// a heading.
  std::optional<double> heading_rad;
  int components = 0;               ///< compared
  std::uint64_t bytes_read = 0;     ///< by the search
  std::uint64_t bytes_in_full = 0;  ///< what a scan over all views would read
};

struct LocaliserOptions {
  int top = 10;        ///< matches listed
  int components = 0;  ///< Fourier components compared, 0 for all
};
void visit_options(LocaliserOptions& options, OptionVisitor& visitor);

/// Finds places of a memory from single views, in any heading of the robot.
class Localiser {
 public:
  /// Learns both models from the memory, which must outlive *this. What is appended later can be
  /// found, but takes part in the models only when a new Localiser is made. Throws OptionError,
  /// ContractError on more components than the memory's. Cost: about 500 searches, at most.
  explicit Localiser(const VisualMemory& memory, const LocaliserOptions& options = {});
  /// With models learnt before. Throws ContractError when the position model was learnt over other
  /// components.
  Localiser(const VisualMemory& memory, PlaceModel place_model, PositionModel position_model,
            const LocaliserOptions& options = {});

  [[nodiscard]] const PlaceModel& place_model() const noexcept { return place_model_; }
  [[nodiscard]] const PositionModel& position_model() const noexcept { return position_model_; }

  /// Topological localisation: the nearest views and, by the visual compass, the heading relative
  /// to each; then whether the place is known, the position between the references [M04 footnote
  /// 1] and the absolute heading: the weighted mean over the four nearest references, so that the
  /// opposite parallaxes of references on opposite sides cancel. Throws ContractError on a query of
  /// another shape. Cost: one exact search and a compass per match.
  [[nodiscard]] Localisation localise(const PackedSignature& query,
                                      const SearchMask& mask = {}) const;

 private:
  const VisualMemory* memory_;
  LocaliserOptions options_;
  PlaceModel place_model_;
  PositionModel position_model_;
};

}  // namespace panonav
