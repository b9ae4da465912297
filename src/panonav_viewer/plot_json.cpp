#include "panonav_viewer/plot_json.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_viewer/data_url.hpp"

namespace panonav::viewer {

namespace {

using Json = nlohmann::ordered_json;

Json round_to_six_digits(double value) {
  if (!std::isfinite(value)) return nullptr;
  std::array<char, 32> text;
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 6)
          .ptr;
  double rounded = value;
  std::from_chars(text.data(), end, rounded);
  return rounded;
}

Json to_json_array(const std::vector<double>& values) {
  Json all = Json::array();
  for (const double value : values) all.push_back(round_to_six_digits(value));
  return all;
}

Json pair(const std::pair<double, double>& values) {
  return {round_to_six_digits(values.first), round_to_six_digits(values.second)};
}

/// Rounds coordinates to 4 decimals: 0.1 mm in metres; other units have similar sizes.
Json points_to_json(const std::vector<Point2>& source) {
  Json all = Json::array();
  const auto rounded = [](double value) { return std::round(value * 1e4) / 1e4; };
  for (const Point2& point : source) {
    all.push_back(rounded(point.x_m));
    all.push_back(rounded(point.y_m));
  }
  return all;
}

Json lines_to_json(const std::vector<std::vector<Point2>>& source) {
  Json all = Json::array();
  for (const auto& list : source) all.push_back(points_to_json(list));
  return all;
}

Json make_layer_json(const MapLayer& layer) {
  Json json{{"label", layer.label}, {"colour", to_string(layer.colour)}};
  if (!layer.circles.empty()) json["circles"] = points_to_json(layer.circles);
  if (!layer.crosses.empty()) json["crosses"] = points_to_json(layer.crosses);
  if (!layer.lines.empty()) json["lines"] = lines_to_json(layer.lines);
  if (!layer.filled_polygons.empty()) json["polygons"] = lines_to_json(layer.filled_polygons);
  if (!layer.dots.empty()) json["dots"] = points_to_json(layer.dots);
  if (!layer.squares.empty()) json["squares"] = points_to_json(layer.squares);
  return json;
}

/// Returns JSON as text; invalid UTF-8 is replaced, because labels may contain names with any
/// bytes.
std::string dump_json(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string_view to_string(PlotColour colour) {
  constexpr std::array<std::string_view, 12> names{
      "blue",  "vermilion", "green",     "purple", "orange",     "sky",
      "black", "yellow",    "dark_grey", "grey",   "light_grey", "pale_grey"};
  return names.at(static_cast<std::size_t>(colour));
}

std::string plot_to_json(const LinePlot& plot) {
  Json json{{"title", plot.title}, {"x_label", plot.x_label}, {"y_label", plot.y_label}};
  Json& all = json["series"] = Json::array();
  for (const Series& series : plot.series) {
    require(series.x.size() == series.y.size(), "values of a series",
            static_cast<double>(series.y.size()), "as many as it has places");
    constexpr std::array styles{"lines", "points", "lines_and_points", "bars"};
    Json one{{"label", series.label},
             {"style", styles.at(static_cast<std::size_t>(series.style))},
             {"x", to_json_array(series.x)},
             {"y", to_json_array(series.y)}};
    if (!series.y_low.empty()) {
      one["low"] = to_json_array(series.y_low);
      one["high"] = to_json_array(series.y_high);
    }
    all.push_back(std::move(one));
  }
  if (plot.log_x) json["log_x"] = true;
  if (plot.log_y) json["log_y"] = true;
  if (plot.x_range) json["x_range"] = pair(*plot.x_range);
  if (plot.y_range) json["y_range"] = pair(*plot.y_range);
  if (!plot.x_tick_labels.empty()) json["names"] = plot.x_tick_labels;
  return dump_json(json);
}

std::string plot_to_json(const HeatMap& plot) {
  return dump_json(
      Json{{"title", plot.title},
           {"heat",
            {{"columns", plot.columns},
             {"rows", plot.rows},
             {"first",
              {round_to_six_digits(plot.first_cell.x_m), round_to_six_digits(plot.first_cell.y_m)}},
             {"spacing", round_to_six_digits(plot.spacing_m)},
             {"values", to_json_array(plot.values)},
             {"label", plot.value_label},
             {"crosses", points_to_json(plot.crosses)}}}});
}

std::string plot_to_json(std::string_view title, const std::vector<MapPlot>& frames,
                         const std::vector<MapLayer>& backdrop) {
  require(!frames.empty(), "frames of a map", 0.0, "at least one");
  Json json{{"title", title}, {"unit", frames.front().unit}};
  if (const auto& shown = frames.front().shown) {
    json["shown"] = {std::min(shown->first.x_m, shown->second.x_m),
                     std::min(shown->first.y_m, shown->second.y_m),
                     std::max(shown->first.x_m, shown->second.x_m),
                     std::max(shown->first.y_m, shown->second.y_m)};
  }
  const auto layers_json = [](const std::vector<MapLayer>& layers) {
    Json all = Json::array();
    for (const MapLayer& layer : layers) all.push_back(make_layer_json(layer));
    return all;
  };
  if (!backdrop.empty()) json["backdrop"] = layers_json(backdrop);
  Json& all = json["frames"] = Json::array();
  for (const MapPlot& frame : frames) {
    all.push_back({{"title", frame.title}, {"layers", layers_json(frame.layers)}});
  }
  return dump_json(json);
}

std::string plot_to_json(const PicturePlot& plot) {
  const Image image = paint_pixels(plot);
  Json json{{"title", plot.title},
            {"x_label", plot.x_label},
            {"y_label", plot.y_label},
            {"x_range", pair(plot.x_range)},
            {"y_range", pair(plot.y_range)},
            {"image", make_data_url("image/png", encode_png(image.view()))}};
  if (plot.x_tick > 0.0) json["x_tick"] = plot.x_tick;
  if (plot.y_tick > 0.0) json["y_tick"] = plot.y_tick;
  return dump_json(json);
}

}  // namespace panonav::viewer
