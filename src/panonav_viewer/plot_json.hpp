#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "panonav_viewer/picture_plot.hpp"
#include "panonav_viewer/plot.hpp"

/// Plots as the page's scripts read them: JSON, numbers to six digits. Throws ContractError as
/// `write_plot`.
namespace panonav::viewer {

/// Returns the name of the style's variable: "vermilion" for --vermilion.
[[nodiscard]] std::string_view name_of(PlotColour colour);

/// Returns a plot as JSON. Throws ContractError on series of different length in x and y.
[[nodiscard]] std::string plot_json(const LinePlot& plot);
[[nodiscard]] std::string plot_json(const HeatMap& plot);
/// Several frames are shown one after the other; the title of each says which it is. At least one;
/// unit and corners are those of the first. `backdrop` is drawn behind each.
[[nodiscard]] std::string plot_json(std::string_view title, const std::vector<MapPlot>& frames,
                                    const std::vector<MapLayer>& backdrop = {});
[[nodiscard]] std::string plot_json(const PicturePlot& plot);

}  // namespace panonav::viewer
