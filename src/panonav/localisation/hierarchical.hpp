#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/voronoi.hpp"
#include "panonav/localisation/localiser_options.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

struct PosedViews;

/// Assigns to each posed view of a memory the floor area that it represents: its Voronoi cell,
/// clipped at half the spacing. Views appended to the memory later have no cell.
class ReferenceAreas {
 public:
  /// Cost: the Voronoi cells of all posed views; some microseconds each.
  explicit ReferenceAreas(const VisualMemory& memory);

  /// Returns the spacing of the posed views (`VoronoiCells::spacing_m`).
  [[nodiscard]] double spacing_m() const noexcept { return cells_.spacing_m(); }
  /// Returns the corners of a view's cell, counter-clockwise; empty if the view has no pose.
  [[nodiscard]] std::vector<Point2> cell(ViewId view) const;
  /// Returns the area of the union of the views' cells; nullopt if one of them has no pose.
  [[nodiscard]] std::optional<double> area_m2(std::span<const Match> views) const;
  /// Returns the smallest circle around the views' positions, enlarged by half a cell's diagonal so
  /// that it covers their cells; nullopt if there are no views, one has no pose, or they are on
  /// several floors.
  [[nodiscard]] std::optional<Circle> enclosing_circle(std::span<const Match> views) const;

 private:
  explicit ReferenceAreas(PosedViews posed);
  [[nodiscard]] std::optional<std::size_t> find_site(ViewId view) const;
  /// Returns the sites of all views; nullopt if one of them has no pose.
  [[nodiscard]] std::optional<std::vector<std::size_t>> find_sites(
      std::span<const Match> views) const;

  std::vector<ViewId> views_;  // with a pose, ascending; same order as the positions of `cells_`
  FloorPlane plane_;
  VoronoiCells cells_;            // of positions in `plane_`
  std::vector<double> areas_m2_;  // by site
};

/// Localises a query hierarchically [M04 section 2.3, figures 9 and 10]: compares more and more
/// components, which narrows the area step by step, until the accuracy is reached. Returns one
/// level for each step; none for an empty memory. Does not detect unknown places (see `Localiser`).
/// Throws OptionError; ContractError on a query of another shape.
[[nodiscard]] std::vector<LocalisationLevel> localise_hierarchically(
    const VisualMemory& memory, const ReferenceAreas& areas, const PackedSignature& query,
    const LocalisationAccuracy& accuracy = {}, const SearchMask& mask = {});

}  // namespace panonav
