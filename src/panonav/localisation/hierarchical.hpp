#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/voronoi.hpp"
#include "panonav/localisation/localiser_options.hpp"
#include "panonav/localisation/place.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav {

struct PosedViews;

/// The area of floor that each reference view of a memory represents: the Voronoi cells of the
/// posed views, clipped at half the spacing. Copies what it needs: views that the memory gets later
/// have no cell.
class ReferenceAreas {
 public:
  /// Cost: the Voronoi cells of all posed views; some microseconds each.
  explicit ReferenceAreas(const VisualMemory& memory);

  /// Spacing of the posed views, see `VoronoiCells::spacing_m`.
  [[nodiscard]] double spacing_m() const noexcept { return cells_.spacing_m(); }
  /// The corners of a view's cell, counter-clockwise; none when the view had no pose.
  [[nodiscard]] std::vector<Point2> cell(ViewId view) const;
  /// Area of the union of the views' cells; nullopt when one of them has no pose.
  [[nodiscard]] std::optional<double> area_m2(std::span<const Match> views) const;
  /// The smallest circle around the views' positions, and half a cell's diagonal more, so that it
  /// covers their cells; nullopt when one of them has no pose or there is none.
  [[nodiscard]] std::optional<Circle> enclosing_circle(std::span<const Match> views) const;

 private:
  explicit ReferenceAreas(PosedViews posed);
  [[nodiscard]] std::optional<std::size_t> find_site(ViewId view) const;
  /// The sites of all views; nullopt when one of them has no pose.
  [[nodiscard]] std::optional<std::vector<std::size_t>> find_sites(
      std::span<const Match> views) const;

  std::vector<ViewId> views_;  // posed ones, ascending; in the order of the positions of `cells_`
  VoronoiCells cells_;
  std::vector<double> areas_m2_;  // by site
};

/// Hierarchical localisation [M04 section 2.3, figures 9 and 10]: few components give a large area,
/// more components a smaller one, and only as many as the accuracy needs are compared. No levels
/// for an empty memory. Does not detect unknown places (see `Localiser`). Throws OptionError,
/// ContractError on a query of another shape.
[[nodiscard]] std::vector<LocalisationLevel> localise_hierarchically(
    const VisualMemory& memory, const ReferenceAreas& areas, const PackedSignature& query,
    const LocalisationAccuracy& accuracy = {}, const SearchMask& mask = {});

}  // namespace panonav
