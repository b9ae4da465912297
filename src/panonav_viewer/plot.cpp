#include "panonav_viewer/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/image.hpp"
#include "panonav/core/text.hpp"
#include "panonav_viewer/picture_plot.hpp"
#include "panonav_viewer/plot_axes.hpp"

namespace panonav::viewer {

namespace {

namespace fs = std::filesystem;

constexpr double bar_width = 0.6;  ///< total width of all bars at one x, in units of x
constexpr double bar_opacity = 0.7;
constexpr double polygon_opacity = 0.45;

/// A rectangle that contains everything drawn.
struct Bounds {
  Point2 low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  Point2 high{-low.x_m, -low.y_m};

  void include(const std::vector<Point2>& points) {
    for (const auto& p : points) {
      if (!std::isfinite(p.x_m) || !std::isfinite(p.y_m)) continue;
      low = {std::min(low.x_m, p.x_m), std::min(low.y_m, p.y_m)};
      high = {std::max(high.x_m, p.x_m), std::max(high.y_m, p.y_m)};
    }
  }
  void include(const MapPlot& map) {
    if (map.shown) return include(std::vector{map.shown->first, map.shown->second});
    for (const auto& layer : map.layers) {
      include(layer.circles);
      include(layer.crosses);
      include(layer.dots);
      include(layer.squares);
      for (const auto& line : layer.lines) include(line);
      for (const auto& polygon : layer.filled_polygons) include(polygon);
    }
  }
  [[nodiscard]] double width() const { return high.x_m - low.x_m; }
  [[nodiscard]] double height() const { return high.y_m - low.y_m; }
  /// Adds a margin and extends the shorter side, so that the rectangle is at most 5 times as
  /// wide as high, and at most 1.2 times as high as wide.
  void add_margin() {
    if (!(low.x_m <= high.x_m)) low = high = {};
    const double side = std::max({width(), height(), 1e-6 * std::abs(low.x_m), 1e-9});
    extend(0.03 * side, 0.03 * side);
    extend(std::max(0.0, 0.5 * (height() / 1.2 - width())), 0.0);
    extend(0.0, std::max(0.0, 0.5 * (0.2 * width() - height())));
  }

 private:
  void extend(double x, double y) {
    low = {low.x_m - x, low.y_m - y};
    high = {high.x_m + x, high.y_m + y};
  }
};

/// Sets both axes to the same scale, by the width of the box, and computes the height of the box.
void set_equal_scale(PlotArea& area, const Bounds& bounds) {
  const double px = area.box.width / bounds.width();
  area.box.height = std::round(px * bounds.height());
  constexpr double min_step_px = 50.0;
  double step = std::pow(10.0, std::floor(std::log10(min_step_px / px)));
  for (const double more : {2.0, 2.5, 2.0}) {
    if (step * px < min_step_px) step *= more;
  }
  area.x.tick = area.y.tick = step;
  std::tie(area.x.from, area.x.to) = std::pair(bounds.low.x_m, bounds.high.x_m);
  std::tie(area.y.from, area.y.to) = std::pair(bounds.low.y_m, bounds.high.y_m);
}

void check_series(const Series& series) {
  require(series.x.size() == series.y.size(), "number of y values of a series",
          static_cast<double>(series.y.size()), "the number of its x values");
  const bool has_errors = !series.y_low.empty() || !series.y_high.empty();
  require(!has_errors ||
              (series.y_low.size() == series.x.size() && series.y_high.size() == series.x.size()),
          "number of error bars of a series", static_cast<double>(series.y_low.size()),
          "the number of its x values");
}

bool has_bar_series(const LinePlot& plot) {
  return std::ranges::find(plot.series, SeriesStyle::bars, &Series::style) != plot.series.end();
}

/// Makes an axis that shows `range`; without a range it shows all `values`, and zero if
/// `with_zero`.
PlotAxis make_axis(const std::string& label, bool is_log,
                   const std::optional<std::pair<double, double>>& range,
                   std::span<const double> values, bool with_zero) {
  PlotAxis axis{.label = label, .is_log = is_log};
  axis.set_range_to_fit(values, with_zero);
  if (!range) return axis;
  require(!is_log || (range->first > 0.0 && range->second > 0.0), "range of a logarithmic axis",
          range->first, "> 0");
  axis.from = range->first;
  axis.to = range->second;
  return axis;
}

PlotAxis make_x_axis(const LinePlot& plot) {
  std::vector<double> values;
  for (const Series& series : plot.series) {
    for (const double value : series.x) {
      if (series.style != SeriesStyle::bars) values.push_back(value);
    }
  }
  PlotAxis axis = make_axis(plot.x_label, plot.log_x, plot.x_range, values, false);
  if (has_bar_series(plot) && !plot.x_range) {
    for (const Series& series : plot.series)
      values.insert(values.end(), series.x.begin(), series.x.end());
    if (!values.empty()) {
      axis.from = std::ranges::min(values) - bar_width;
      axis.to = std::ranges::max(values) + bar_width;
    }
  }
  if (plot.series.empty()) return axis;
  const auto& positions = plot.series.front().x;
  for (std::size_t i = 0; i < std::min(plot.x_tick_labels.size(), positions.size()); ++i) {
    axis.tick_labels.emplace_back(positions[i], plot.x_tick_labels[i]);
  }
  return axis;
}

PlotAxis make_y_axis(const LinePlot& plot) {
  std::vector<double> values;
  for (const Series& series : plot.series) {
    for (const auto* part : {&series.y, &series.y_low, &series.y_high}) {
      values.insert(values.end(), part->begin(), part->end());
    }
  }
  return make_axis(plot.y_label, plot.log_y, plot.y_range, values, has_bar_series(plot));
}

/// Draws the bars of series `number`; bars of several series are next to each other.
void draw_bars(SvgDrawing& drawing, const PlotArea& area, const LinePlot& plot, std::size_t number,
               PlotColour colour) {
  const Series& series = plot.series[number];
  const double width = bar_width / static_cast<double>(plot.series.size());
  const double left = -0.5 * bar_width + width * static_cast<double>(number);
  const double base = area.y.is_log ? area.y.from : 0.0;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const Point2 a = area.to_px(series.x[i] + left, base);
    const Point2 b = area.to_px(series.x[i] + left + width, series.y[i]);
    if (!std::isfinite(b.y_m)) continue;
    drawing.add_box({a.x_m, std::min(a.y_m, b.y_m), b.x_m - a.x_m, std::abs(b.y_m - a.y_m)}, colour,
                    bar_opacity);
  }
}

void draw_error_bars(SvgDrawing& drawing, const PlotArea& area, const Series& series,
                     double x_shift, PlotColour colour) {
  constexpr double cap_px = 3.0;
  for (std::size_t i = 0; i < series.y_low.size(); ++i) {
    const Point2 low = area.to_px(series.x[i] + x_shift, series.y_low[i]);
    const Point2 high = area.to_px(series.x[i] + x_shift, series.y_high[i]);
    if (!std::isfinite(low.y_m) || !std::isfinite(high.y_m)) continue;
    drawing.add_path(std::vector<Point2>{{low.x_m - cap_px, low.y_m},
                                         {low.x_m + cap_px, low.y_m},
                                         low,
                                         high,
                                         {high.x_m - cap_px, high.y_m},
                                         {high.x_m + cap_px, high.y_m}},
                     colour, {.width = 1.5});
  }
}

/// Draws one series and adds it to the legend.
void draw_series(SvgDrawing& drawing, Legend& legend, const PlotArea& area, const LinePlot& plot,
                 std::size_t number) {
  constexpr std::size_t series_colour_count = 7;  // the first PlotColours, blue to black
  const Series& series = plot.series[number];
  if (series.x.empty()) return;
  LegendSymbol symbol{.colour = static_cast<PlotColour>(number % series_colour_count)};
  if (series.style == SeriesStyle::bars) {
    draw_bars(drawing, area, plot, number, symbol.colour);
    const double width = bar_width / static_cast<double>(plot.series.size());
    draw_error_bars(drawing, area, series,
                    width * (static_cast<double>(number) + 0.5) - 0.5 * bar_width,
                    PlotColour::dark_grey);
    symbol.area_opacity = bar_opacity;
    legend.add(series.label, symbol);
    return;
  }
  if (series.style != SeriesStyle::points) {
    symbol.line = LineStyle{.dashes = static_cast<int>(number / series_colour_count)};
  }
  if (series.style != SeriesStyle::lines) symbol.mark = MarkStyle{};
  std::vector<Point2> points;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    points.push_back(area.to_px(series.x[i], series.y[i]));
  }
  draw_error_bars(drawing, area, series, 0.0, symbol.colour);
  if (symbol.line) drawing.add_path(points, symbol.colour, *symbol.line);
  if (symbol.mark) drawing.add_marks(points, symbol.colour, *symbol.mark);
  legend.add(series.label, symbol);
}

/// Returns the viewer's colour (plan.js) for a value, from black over blue and green to yellow with
/// rising lightness. `share` is 0 .. 1.
std::array<std::uint8_t, 3> interpolate_colour(double share) {
  constexpr std::array<std::array<double, 3>, 6> stops{{{0, 34, 78},
                                                        {53, 69, 108},
                                                        {102, 105, 112},
                                                        {148, 142, 119},
                                                        {200, 184, 102},
                                                        {254, 232, 56}}};
  const double at = std::clamp(share, 0.0, 1.0) * (stops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), stops.size() - 2);
  std::array<std::uint8_t, 3> colour{};
  for (std::size_t i = 0; i < 3; ++i) {
    colour[i] = static_cast<std::uint8_t>(std::lround(
        std::lerp(stops[below][i], stops[below + 1][i], at - static_cast<double>(below))));
  }
  return colour;
}

/// Returns the cells as pixels, highest row first; NaN cells are white.
Image paint_cells(const HeatMap& plot, double low, double high) {
  Image image(plot.columns, plot.rows, 3);
  for (int row = 0; row < plot.rows; ++row) {
    for (int column = 0; column < plot.columns; ++column) {
      const double value = plot.values[static_cast<std::size_t>(row) * plot.columns + column];
      const auto colour = std::isfinite(value) ? interpolate_colour((value - low) / (high - low))
                                               : std::array<std::uint8_t, 3>{255, 255, 255};
      for (int i = 0; i < 3; ++i) {
        image.at(column, plot.rows - 1 - row, i) = colour[static_cast<std::size_t>(i)];
      }
    }
  }
  return image;
}

void draw_colour_bar(SvgDrawing& drawing, const SvgBox& box, const PlotAxis& axis) {
  constexpr int steps = 128;
  constexpr double tick_px = 34.0;
  Image gradient(1, steps, 3);
  for (int v = 0; v < steps; ++v) {
    const auto colour = interpolate_colour(1.0 - (v + 0.5) / steps);
    for (int i = 0; i < 3; ++i) gradient.at(0, v, i) = colour[static_cast<std::size_t>(i)];
  }
  drawing.add_image(box, gradient.view());
  drawing.add_frame(box, PlotColour::dark_grey);
  for (const double tick : axis.ticks(box.height / tick_px)) {
    drawing.add_text({box.right() + 5.0, box.bottom() - axis.fraction_of(tick) * box.height + 4.0},
                     format_number(tick));
  }
  drawing.add_text({box.right() + 62.0, box.top + 0.5 * box.height}, axis.label,
                   {.anchor = "middle", .rotation_deg = -90.0});
}

/// Draws a layer; in the legend, only its first kind of mark has the label.
void draw_layer(SvgDrawing& drawing, Legend& legend, const PlotArea& area, const MapLayer& layer) {
  std::string label = layer.label;
  const auto add_to_legend = [&](LegendSymbol symbol) {
    symbol.colour = layer.colour;
    legend.add(std::exchange(label, std::string()), symbol);
  };
  for (const auto& polygon : layer.filled_polygons) {
    drawing.add_polygon(area.to_px(polygon), layer.colour, polygon_opacity);
  }
  if (!layer.filled_polygons.empty()) add_to_legend({.area_opacity = polygon_opacity});
  for (const auto& line : layer.lines) drawing.add_path(area.to_px(line), layer.colour);
  if (!layer.lines.empty()) add_to_legend({.line = LineStyle{}});
  const auto draw_marks = [&](const std::vector<Point2>& points, const MarkStyle& style) {
    if (points.empty()) return;
    drawing.add_marks(area.to_px(points), layer.colour, style);
    add_to_legend({.mark = style});
  };
  draw_marks(layer.dots, {.radius = 1.6});
  draw_marks(layer.circles, {.shape = MarkShape::ring, .line_width = 1.0});
  draw_marks(layer.crosses, {.shape = MarkShape::cross, .radius = 5.0, .line_width = 3.0});
  draw_marks(layer.squares, {.shape = MarkShape::square, .radius = 4.5});
}

}  // namespace

std::string_view to_css_colour(PlotColour colour) {
  constexpr std::array<std::string_view, 12> colours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                     "#e69f00", "#56b4e9", "#000000", "#f0e442",
                                                     "#555555", "#8c8c8c", "#c4c4c4", "#e4e4e4"};
  return colours.at(static_cast<std::size_t>(colour));
}

void write_plot(const fs::path& path, const LinePlot& plot) {
  std::ranges::for_each(plot.series, &check_series);
  constexpr double area_height = 340.0;
  PlotArea area{.x = make_x_axis(plot), .y = make_y_axis(plot)};
  area.box = {left_margin_px + 10.0, top_margin_px,
              plot_width_px - left_margin_px - 10.0 - right_margin_px, area_height};
  SvgDrawing drawing;
  Legend legend;
  area.draw_grid(drawing);
  drawing.begin_clip(area.box);
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    draw_series(drawing, legend, area, plot, i);
  }
  drawing.end_clip();
  area.draw_axes(drawing, plot.title);
  const double top = area.box.bottom() + bottom_margin_px + area.extra_margin_px();
  legend.draw(drawing, plot_width_px, top);
  write_drawing(path, drawing.to_text(plot_width_px, top + legend.height(plot_width_px)));
}

void write_plot(const fs::path& path, const HeatMap& plot) {
  require(plot.columns >= 1 && plot.rows >= 1 &&
              plot.values.size() ==
                  static_cast<std::size_t>(plot.columns) * static_cast<std::size_t>(plot.rows),
          "number of heat map values", static_cast<double>(plot.values.size()),
          "columns * rows >= 1");
  PlotAxis values{.label = plot.value_label, .from = 0.0, .to = 0.0};
  for (const double value : plot.values) {
    if (!std::isfinite(value)) continue;
    values.from = std::min(values.from, value);
    values.to = std::max(values.to, value);
  }
  if (values.from == values.to) values.to = 1.0;
  const double half = 0.5 * plot.spacing_m;
  const Point2 low{plot.first_cell.x_m - half, plot.first_cell.y_m - half};
  const Point2 high{low.x_m + plot.columns * plot.spacing_m, low.y_m + plot.rows * plot.spacing_m};
  Bounds bounds;
  bounds.include({low, high});
  bounds.add_margin();
  constexpr double colour_bar_px = 110.0;
  PlotArea area{.x = {.label = plot.x_label}, .y = {.label = plot.y_label}};
  area.box = {left_margin_px, top_margin_px, plot_width_px - left_margin_px - colour_bar_px, 0.0};
  set_equal_scale(area, bounds);
  SvgDrawing drawing;
  area.draw_grid(drawing);
  const Point2 upper_left = area.to_px(low.x_m, high.y_m);
  const Point2 lower_right = area.to_px(high.x_m, low.y_m);
  const Image cells = paint_cells(plot, values.from, values.to);
  drawing.add_image({upper_left.x_m, upper_left.y_m, lower_right.x_m - upper_left.x_m,
                     lower_right.y_m - upper_left.y_m},
                    cells.view());
  drawing.begin_clip(area.box);
  drawing.add_marks(area.to_px(plot.crosses), PlotColour::vermilion,
                    {.shape = MarkShape::cross, .radius = 7.0, .line_width = 3.0});
  drawing.end_clip();
  area.draw_axes(drawing, plot.title);
  draw_colour_bar(drawing, {area.box.right() + 20.0, area.box.top, 20.0, area.box.height}, values);
  write_drawing(path, drawing.to_text(plot_width_px, area.box.bottom() + bottom_margin_px));
}

Image paint_pixels(const PicturePlot& plot) {
  require(plot.columns >= 1 && plot.rows >= 1 &&
              plot.values.size() ==
                  static_cast<std::size_t>(plot.columns) * static_cast<std::size_t>(plot.rows),
          "number of image values", static_cast<double>(plot.values.size()), "columns * rows >= 1");
  constexpr std::array<std::uint8_t, 3> unknown{170, 214, 240};
  Image image(plot.columns, plot.rows, 3);
  for (int row = 0; row < plot.rows; ++row) {
    for (int column = 0; column < plot.columns; ++column) {
      const float value = plot.values[static_cast<std::size_t>(row) * plot.columns + column];
      for (int i = 0; i < 3; ++i) {
        image.at(column, plot.rows - 1 - row, i) =
            std::isnan(value)
                ? unknown[static_cast<std::size_t>(i)]
                : static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(value, 0.0F, 1.0F)));
      }
    }
  }
  return image;
}

void write_plot(const fs::path& path, const PicturePlot& plot) {
  const Image image = paint_pixels(plot);
  constexpr double area_height = 340.0;
  PlotArea area{.box = {left_margin_px, top_margin_px,
                        plot_width_px - left_margin_px - right_margin_px, area_height},
                .x = {.label = plot.x_label,
                      .from = plot.x_range.first,
                      .to = plot.x_range.second,
                      .tick = plot.x_tick},
                .y = {.label = plot.y_label,
                      .from = plot.y_range.first,
                      .to = plot.y_range.second,
                      .tick = plot.y_tick}};
  SvgDrawing drawing;
  drawing.add_image(area.box, image.view());
  area.draw_axes(drawing, plot.title);
  write_drawing(path, drawing.to_text(plot_width_px, area.box.bottom() + bottom_margin_px));
}

void write_plot(const fs::path& path, const MapPlot& plot) {
  write_plot(path, std::vector{plot}, 1);
}

void write_plot(const fs::path& path, const std::vector<MapPlot>& panels, int panel_columns) {
  require(!panels.empty(), "number of panels", 0.0, ">= 1");
  require(panel_columns >= 1, "panel columns", panel_columns, ">= 1");
  // All panels show the same part of the world, so that they can be compared.
  Bounds bounds;
  for (const MapPlot& panel : panels) bounds.include(panel);
  bounds.add_margin();
  const double panel_width = panel_columns == 1   ? plot_width_px
                             : panel_columns == 2 ? 400.0
                                                  : 320.0;
  PlotArea area;
  area.box.width = panel_width - left_margin_px - right_margin_px;
  set_equal_scale(area, bounds);
  const double panel_height = top_margin_px + area.box.height + bottom_margin_px;
  SvgDrawing drawing;
  Legend legend;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const auto columns = static_cast<std::size_t>(panel_columns);
    area.box.left = static_cast<double>(i % columns) * panel_width + left_margin_px;
    area.box.top = static_cast<double>(i / columns) * panel_height + top_margin_px;
    area.x.label = "x [" + panels[i].unit + "]";
    area.y.label = "y [" + panels[i].unit + "]";
    area.draw_grid(drawing);
    drawing.begin_clip(area.box);
    for (const MapLayer& layer : panels[i].layers) draw_layer(drawing, legend, area, layer);
    drawing.end_clip();
    area.draw_axes(drawing, panels[i].title);
  }
  const double width = panel_width * panel_columns;
  const auto rows = (panels.size() + panel_columns - 1) / static_cast<std::size_t>(panel_columns);
  const double top = panel_height * static_cast<double>(rows);
  legend.draw(drawing, width, top);
  write_drawing(path, drawing.to_text(width, top + legend.height(width)));
}

}  // namespace panonav::viewer
