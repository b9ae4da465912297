#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav::viewer {

/// The colours of all plots: those of Okabe and Ito, which colour-blind readers can distinguish,
/// and greys for backgrounds.
enum class PlotColour {
  blue,
  vermilion,
  green,
  purple,
  orange,
  sky,
  black,
  yellow,
  dark_grey,
  grey,
  light_grey,
  pale_grey,
};
/// Returns the CSS colour, as "#0072b2".
[[nodiscard]] std::string_view to_css_colour(PlotColour colour);

enum class SeriesStyle { lines, points, lines_and_points, bars };

struct Series {
  std::string label;  ///< empty: not in the legend
  std::vector<double> x;
  std::vector<double> y;
  SeriesStyle style = SeriesStyle::lines_and_points;
  std::vector<double> y_low;  ///< lower ends of error bars; empty: none
  std::vector<double> y_high;

  void add(double at, double value) {
    x.push_back(at);
    y.push_back(value);
  }
  void add(double at, double value, double low, double high) {
    add(at, value);
    y_low.push_back(low);
    y_high.push_back(high);
  }
};

/// Curves over one x axis. Labels contain the units: "distance [m]".
struct LinePlot {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<Series> series;
  bool log_x = false;
  bool log_y = false;
  std::optional<std::pair<double, double>> x_range;
  std::optional<std::pair<double, double>> y_range;
  std::vector<std::string> x_tick_labels;  ///< for bars: one text per x value
};

/// Values on a regular grid in the floor plane, lowest row first. The colour bar begins at 0 unless
/// there are negative values.
struct HeatMap {
  std::string title;
  std::string x_label = "x [m]";
  std::string y_label = "y [m]";
  std::string value_label;
  int columns = 0;
  int rows = 0;
  Point2 first_cell;  ///< centre of cell (0, 0)
  double spacing_m = 1.0;
  std::vector<double> values;  ///< row-major; NaN: empty cell
  std::vector<Point2> crosses;
};

/// One layer of a map: points, lines and polygons of one colour, with one label.
struct MapLayer {
  std::string label;
  PlotColour colour = PlotColour::blue;
  std::vector<Point2> circles;
  std::vector<Point2> crosses;
  std::vector<std::vector<Point2>> lines;
  std::vector<std::vector<Point2>> filled_polygons;
  std::vector<Point2> dots;  ///< small circles, for many points
  std::vector<Point2> squares;
};
struct MapPlot {
  std::string title;
  std::vector<MapLayer> layers;  ///< drawn in this order
  std::string unit = "m";        ///< of both axes
  /// Two opposite corners of the visible part; nullopt: everything.
  std::optional<std::pair<Point2, Point2>> shown = {};
};

/// Writes an SVG file; if the path does not end in .svg, a PNG file that the program ffmpeg makes
/// from the SVG. The file is complete or does not appear at all. Throws FileError if it cannot be
/// written, Error if a PNG needs ffmpeg and it is not installed, and ContractError on series whose
/// x and y differ in size. Layers and series without points are not in the legend.
void write_plot(const std::filesystem::path& path, const LinePlot& plot);
void write_plot(const std::filesystem::path& path, const HeatMap& plot);
void write_plot(const std::filesystem::path& path, const MapPlot& plot);
/// Writes several maps as panels of one picture, with equal size and one legend (as in [M04]
/// figures 9 and 10).
void write_plot(const std::filesystem::path& path, const std::vector<MapPlot>& panels,
                int panel_columns);

}  // namespace panonav::viewer
