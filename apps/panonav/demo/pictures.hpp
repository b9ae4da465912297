#pragma once

#include <string>
#include <vector>

#include "panonav/localisation/hierarchical.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav_viewer/plot.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

/// A query view and the memory's answer to it.
struct LocalisedView {
  Pose2 truth;
  PackedSignature signature;
  Place found;
};

/// True places, and a line from each to where the memory says it is, over the layers of the scene.
[[nodiscard]] viewer::MapPlot draw_answers(const VisualMemory& memory,
                                           const std::vector<viewer::MapLayer>& scene,
                                           const std::vector<LocalisedView>& queries);

/// The area where the robot may be after each number of components [M04 figure 9].
struct AreasShown {
  viewer::UnfoldingMap map;
  std::vector<double> areas_m2;  ///< of the frames
};
[[nodiscard]] AreasShown draw_areas(const VisualMemory& memory,
                                    const std::vector<viewer::MapLayer>& scene,
                                    const LocalisedView& query);

/// Draws the similarity of every remembered view to the query [M04 figure 8].
[[nodiscard]] viewer::HeatMap draw_similarity(const VisualMemory& memory, double spacing_m,
                                              const LocalisedView& query);

/// A picture that stands in the page itself.
[[nodiscard]] viewer::ReportPicture embed_image(ImageView image, std::string caption);

}  // namespace panonav::command
