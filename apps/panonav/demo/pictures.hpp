#pragma once

#include <string>
#include <vector>

#include "panonav/localisation/hierarchical.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav_viewer/plot.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// A query view and the place that was found for it.
struct LocalisedView {
  Pose2 truth;
  PackedSignature signature;
  Place found;
};

/// Draws the true positions, a line from each to the computed position, and the scene.
[[nodiscard]] viewer::MapPlot draw_answers(const VisualMemory& memory,
                                           const std::vector<viewer::MapLayer>& scene,
                                           const std::vector<LocalisedView>& queries);

/// Animation of the area in which the robot may be, for an increasing number of components [M04
/// figure 9].
struct AreaAnimation {
  viewer::MapAnimation map;
  std::vector<double> areas_m2;  ///< area in each frame
};
[[nodiscard]] AreaAnimation draw_areas(const VisualMemory& memory,
                                       const std::vector<viewer::MapLayer>& scene,
                                       const LocalisedView& query);

/// Draws the similarity of every remembered view to the query [M04 figure 8].
[[nodiscard]] viewer::HeatMap draw_similarity(const VisualMemory& memory, double spacing_m,
                                              const LocalisedView& query);

/// Returns a picture that is embedded in the page.
[[nodiscard]] viewer::ReportPicture embed_image(ImageView image, std::string caption);

}  // namespace panonav::command
