#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "panonav_viewer/svg_drawing.hpp"

/// Parts that all plots share: axes, titles, legends.
namespace panonav::viewer {

struct PlotAxis {
  std::string label;
  double from = 0.0;
  double to = 1.0;
  bool is_log = false;
  double tick = 0.0;  ///< between marks; 0: chosen by the range
  /// Marks with text instead of numbers, if any.
  std::vector<std::pair<double, std::string>> names = {};

  /// Returns 0 at `from` and 1 at `to`; NaN for values that the axis cannot show.
  [[nodiscard]] double share_of(double value) const;
  /// Returns the positions of marks: 0.2, 0.5, 1, 2, ... apart, about `max_count` at most.
  [[nodiscard]] std::vector<double> ticks(double max_count) const;
  /// Makes the axis show all values, with a little room; `with_zero`: zero, too.
  void fit(std::span<const double> values, bool with_zero);
};

/// Margins around an area of axes, in pixels: tick labels and axis titles left and below, a title
/// above.
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
  /// Returns the height of the rotated names of x below the area, beyond the usual margin.
  [[nodiscard]] double extra_margin_px() const;
  /// Draws the grid behind the values.
  void draw_grid(SvgDrawing& drawing) const;
  /// Draws frame, numbers, labels and title.
  void draw_axes(SvgDrawing& drawing, const std::string& title) const;

 private:
  [[nodiscard]] bool has_turned_names() const;
  void draw_names(SvgDrawing& drawing) const;
};

/// Symbol of one kind of line, mark or area in a legend.
struct LegendSymbol {
  PlotColour colour = PlotColour::blue;
  std::optional<LineStyle> line = {};
  std::optional<MarkStyle> mark = {};
  double area_opacity = 0.0;

  void draw(SvgDrawing& drawing, Point2 at) const;
};

/// One legend at the bottom of a picture, each label once for each colour.
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
