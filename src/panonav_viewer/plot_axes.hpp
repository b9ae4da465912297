#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panonav_viewer/svg_drawing.hpp"

/// An axis of a plot: range, scale and tick marks.
namespace panonav::viewer {

struct PlotAxis {
  std::string label;
  double from = 0.0;
  double to = 1.0;
  bool is_log = false;
  double tick = 0.0;  ///< distance of tick marks; 0: chosen from the range
  /// Positions with labels that replace the numbers, if any.
  std::vector<std::pair<double, std::string>> tick_labels = {};

  /// Returns the position of a value on the axis, 0 at `from` and 1 at `to`; NaN if the axis cannot
  /// show it.
  [[nodiscard]] double fraction_of(double value) const;
  /// Returns the positions of about `max_count` tick marks at most, at a distance of `tick` or 1, 2
  /// or 5 times a power of ten.
  [[nodiscard]] std::vector<double> ticks(double max_count) const;
  /// Sets the range to contain all values with a margin; also zero if `with_zero`.
  void set_range_to_fit(std::span<const double> values, bool with_zero);
};

/// Margins around the axes, in pixels: left and below for tick labels and axis titles, above for
/// the plot title; and the width of a plot.
constexpr double left_margin_px = 66.0;
constexpr double right_margin_px = 18.0;
constexpr double top_margin_px = 30.0;
constexpr double bottom_margin_px = 50.0;
constexpr double plot_width_px = 720.0;

struct PlotArea {
  SvgBox box;
  PlotAxis x;
  PlotAxis y;

  [[nodiscard]] Point2 to_px(double x_value, double y_value) const;
  [[nodiscard]] std::vector<Point2> to_px(std::span<const Point2> points) const;
  /// Returns the additional height, in pixels, that rotated tick labels below the x axis need.
  [[nodiscard]] double extra_margin_px() const;
  /// Draws the grid behind the values.
  void draw_grid(SvgDrawing& drawing) const;
  /// Draws frame, numbers, labels and title.
  void draw_axes(SvgDrawing& drawing, const std::string& title) const;

 private:
  [[nodiscard]] bool has_rotated_tick_labels() const;
  void draw_tick_labels(SvgDrawing& drawing) const;
};

/// Symbol of a legend entry: line, mark or area.
struct LegendSymbol {
  PlotColour colour = PlotColour::blue;
  std::optional<LineStyle> line = {};
  std::optional<MarkStyle> mark = {};
  double area_opacity = 0.0;

  void draw(SvgDrawing& drawing, Point2 at) const;
};

/// The legend at the bottom of a picture, with one entry per label and colour.
class Legend {
 public:
  void add(const std::string& label, const LegendSymbol& symbol);
  [[nodiscard]] double height(double width) const;
  void draw(SvgDrawing& drawing, double width, double top) const;

 private:
  [[nodiscard]] std::size_t columns(double width) const;

  double entry_width_ = 0.0;
  std::vector<std::pair<std::string, LegendSymbol>> entries_;
};

}  // namespace panonav::viewer
