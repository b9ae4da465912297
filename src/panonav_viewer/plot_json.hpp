#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "panonav_viewer/picture_plot.hpp"
#include "panonav_viewer/plot.hpp"

/// Plots as JSON for the page's scripts, with numbers rounded to six digits. Throws
/// ContractError as `write_plot`.
namespace panonav::viewer {

/// Returns the name of the CSS variable of a colour: "vermilion" for --vermilion.
[[nodiscard]] std::string_view to_string(PlotColour colour);

/// Returns a plot as JSON. Throws ContractError if a series has different numbers of x and y.
[[nodiscard]] std::string plot_to_json(const LinePlot& plot);
[[nodiscard]] std::string plot_to_json(const HeatMap& plot);
/// Returns maps as the frames of an animation, at least one; each title names its frame. Unit and
/// visible part are those of the first. The layers `backdrop` are drawn behind each frame.
[[nodiscard]] std::string plot_to_json(std::string_view title, const std::vector<MapPlot>& frames,
                                       const std::vector<MapLayer>& backdrop = {});
[[nodiscard]] std::string plot_to_json(const PicturePlot& plot);

}  // namespace panonav::viewer
