#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav::viewer {

/// A grey picture over two axes of different units, such as a route panorama.
struct PicturePlot {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::pair<double, double> x_range;  ///< outer edges of the first and the last column; may fall
  std::pair<double, double> y_range;  ///< of the first and the last row; may fall
  int columns = 0;
  int rows = 0;
  std::vector<float> values;  ///< 0 black to 1 white, row-major, lowest row first; NaN: light blue
  double x_tick = 0.0;        ///< between marks; 0: chosen by the range
  double y_tick = 0.0;
};

/// Returns the values as colours, the highest row first. Throws ContractError unless there are
/// columns * rows >= 1 values.
[[nodiscard]] Image paint_pixels(const PicturePlot& plot);

/// Writes a plot like the other `write_plot` (plot.hpp). Throws as `paint_pixels`.
void write_plot(const std::filesystem::path& path, const PicturePlot& plot);

}  // namespace panonav::viewer
