#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav::viewer {

/// A grey image over two axes, which may have different units, such as a route panorama.
struct PicturePlot {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::pair<double, double> x_range;  ///< outer edges of first and last column; may decrease
  std::pair<double, double> y_range;  ///< outer edges of first and last row; may decrease
  int columns = 0;
  int rows = 0;
  std::vector<float> values;  ///< 0 black .. 1 white, row-major, lowest row first; NaN: light blue
  double x_tick = 0.0;        ///< distance of tick marks; 0: chosen from the range
  double y_tick = 0.0;
};

/// Returns the values as colours, highest row first. Throws ContractError unless there are columns
/// * rows >= 1 values.
[[nodiscard]] Image paint_pixels(const PicturePlot& plot);

/// Writes the plot as a file, as `write_plot` in plot.hpp. Throws as `paint_pixels`.
void write_plot(const std::filesystem::path& path, const PicturePlot& plot);

}  // namespace panonav::viewer
