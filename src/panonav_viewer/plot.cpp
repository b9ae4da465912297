#include "panonav_viewer/plot.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/temporary_file.hpp"
#include "panonav/core/text.hpp"
#include "panonav_viewer/picture_plot.hpp"

extern char** environ;

namespace panonav::viewer {

namespace {

namespace fs = std::filesystem;

// Text for gnuplot, shown as it is. gnuplot runs what stands between backquotes in a string of
// double quotes; a string of single quotes holds no command, no escape and no macro, and a quote is
// written twice. Terminals are `noenhanced`: there is no markup either.
std::string gnuplot_text(const std::string& text) {
  constexpr std::size_t max_characters = 160;  // more than a picture is wide
  std::string result = "'";
  for (const char c : shortened(readable_line(text), max_characters)) {
    if (c == '\'') result += '\'';
    result += c;
  }
  return result + "'";
}

// A label at a tick, which gnuplot reads as a format for the number there and of which it draws
// nothing when it is long.
std::string gnuplot_tick(const std::string& text) {
  constexpr std::size_t max_bytes = 48;
  std::string format;
  for (std::size_t characters = max_bytes; format.empty() || format.size() > max_bytes;
       --characters) {
    format.clear();
    for (const char c : shortened(readable_line(text), characters)) {
      if (c == '%') format += '%';
      format += c;
    }
    if (format.empty()) break;
  }
  return gnuplot_text(format);
}

std::string number(double value) {
  return std::isfinite(value) ? to_text(value) : std::string("NaN");
}

std::string range_text(const std::optional<std::pair<double, double>>& range) {
  if (!range) return "[*:*]";
  return "[" + number(range->first) + ":" + number(range->second) + "]";
}

// Commands come from standard input and the picture goes to standard output: a path that gnuplot
// reads can be an option or, after "set output", a command to pipe to.
int run_gnuplot(const fs::path& script, const fs::path& picture, const fs::path& log) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr int written = O_WRONLY | O_CREAT | O_TRUNC;
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, script.c_str(), O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, picture.c_str(), written, 0666);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(), written, 0600);
  std::string program = "gnuplot";
  std::string standard_input = "-";
  const std::array<char*, 3> arguments{program.data(), standard_input.data(), nullptr};
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw Error(
        "plots need the program gnuplot, which cannot be started; install the package gnuplot-nox");
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// A picture for a page: gnuplot's own titles, which a browser shows under the mouse, are left out,
// and the pixels of pictures within it keep their edges.
std::string for_pages(std::string svg) {
  for (std::size_t at = 0; (at = svg.find("<title>", at)) != std::string::npos;) {
    const std::size_t end = svg.find("</title>", at);
    if (end == std::string::npos) break;
    svg.erase(at, end + 8 - at);
  }
  for (std::size_t at = 0; (at = svg.find("<image ", at)) != std::string::npos; at += 7) {
    svg.insert(at + 7, "style='image-rendering:pixelated' ");
  }
  return svg;
}

struct PictureSize {
  int width;
  int height;
};

void draw(const fs::path& path, PictureSize size, const std::string& body) {
  const bool vector_picture = path.extension() == ".svg";
  TemporaryFile picture(path);
  const TemporaryFile script(path.string() + ".gnuplot");
  const TemporaryFile log(path.string() + ".log");
  std::ostringstream text;
  text
      << "set encoding utf8\nset terminal " << (vector_picture ? "svg" : "pngcairo")
      << " noenhanced size " << size.width << "," << size.height
      << " background rgb \"white\" font \"sans-serif," << (vector_picture ? 12 : 10)
      << "\"\nset border lc rgb \"" << hex(PlotColour::dark_grey) << "\"\nset grid lc rgb \""
      << hex(PlotColour::pale_grey)
      << "\" lw 1\nset tics nomirror\nset title offset 0,-0.8\nset xlabel offset 0,0.6\nset ylabel "
         "offset 0.5,0\n"
      << body << "\n";
  {
    std::ofstream out(script.path());
    out << text.str();
    out.flush();
    if (!out) throw FileError(path.string(), "cannot be written; is the disk full?");
  }
  if (run_gnuplot(script.path(), picture.path(), log.path()) != 0) {
    std::ifstream in(log.path());
    std::string line;
    std::string last;
    while (std::getline(in, line)) {
      if (!line.empty()) last = line;
    }
    throw FileError(path.string(), "gnuplot failed: " + last);
  }
  if (vector_picture) {
    std::ostringstream drawn;
    drawn << std::ifstream(picture.path()).rdbuf();
    std::ofstream out(picture.path());
    out << for_pages(std::move(drawn).str());
    out.flush();
    if (!out) throw FileError(path.string(), "cannot be written; is the disk full?");
  }
  std::error_code error;
  fs::rename(picture.path(), path, error);
  if (error) throw FileError(path.string(), "cannot be written: " + error.message());
  picture.keep();
}

std::string colour_text(PlotColour colour) {
  return " lc rgb \"" + std::string(hex(colour)) + "\"";
}

void write_block(std::ostream& out, const std::string& name, const std::string& rows) {
  out << "$" << name << " << END_OF_DATA\n" << rows << "END_OF_DATA\n";
}

std::string points_text(const std::vector<Point2>& points) {
  std::string text;
  for (const auto& p : points) text += number(p.x_m) + " " + number(p.y_m) + "\n";
  return text;
}

std::string polygons_text(const std::vector<std::vector<Point2>>& lines, bool close) {
  std::string text;
  for (const auto& line : lines) {
    if (line.empty()) continue;
    text += points_text(line);
    if (close) text += points_text({line.front()});
    text += "\n";
  }
  return text;
}

// Where a plot stands, in pixels from the upper left corner.
struct Box {
  int left;
  int top;
  int width;
  int height;
};

std::string placed(const Box& box, const PictureSize& size) {
  const auto across = [&](int x) { return number(static_cast<double>(x) / size.width); };
  const auto upwards = [&](int y) { return number(1.0 - static_cast<double>(y) / size.height); };
  return "set lmargin at screen " + across(box.left) + "\nset rmargin at screen " +
         across(box.left + box.width) + "\nset tmargin at screen " + upwards(box.top) +
         "\nset bmargin at screen " + upwards(box.top + box.height) + "\n";
}

constexpr int character_px = 8;  // of the font, at most

// Smaller where it would be wider than its plot.
std::string title_text(const std::string& title, int width) {
  constexpr int font_px = 12;
  const int fitting = width * font_px / (7 * std::max(1, static_cast<int>(title.size())));
  return "set title " + gnuplot_text(title) + " font \"," +
         std::to_string(std::clamp(fitting, 8, font_px)) + "\"\n";
}

// One legend at the bottom of a picture, each entry once.
class Legend {
 public:
  void add(const std::string& label, const std::string& style) {
    const std::pair entry(label, style);
    if (label.empty() || std::ranges::find(entries_, entry) != entries_.end()) return;
    entries_.push_back(entry);
  }
  [[nodiscard]] int height(int width) const { return entries_.empty() ? 0 : 18 * rows(width) + 14; }
  [[nodiscard]] std::string text(const PictureSize& size) const {
    if (entries_.empty()) return "";
    const int high = height(size.width);
    std::string text =
        placed({0, size.height - high, size.width, high - 8}, size) +
        "unset title\nunset xlabel\nunset ylabel\nunset border\nunset tics\nunset grid\nunset "
        "logscale\nset key inside center center horizontal Left reverse samplen 1.5 maxcols " +
        std::to_string(columns(size.width)) + "\nplot [0:1][0:1] NaN notitle";
    for (const auto& [label, style] : entries_) {
      text += ", \\\n  keyentry " + style + " title " + gnuplot_text(label);
    }
    return text + "\n";
  }

 private:
  [[nodiscard]] int columns(int width) const {
    std::size_t longest = 0;
    for (const auto& [label, style] : entries_) longest = std::max(longest, label.size());
    return std::clamp(width / (character_px * static_cast<int>(longest) + 60), 1,
                      static_cast<int>(entries_.size()));
  }
  [[nodiscard]] int rows(int width) const {
    const int count = static_cast<int>(entries_.size());
    return (count + columns(width) - 1) / columns(width);
  }
  std::vector<std::pair<std::string, std::string>> entries_;
};

// Data blocks and the plot command of one map; names carry `prefix`.
std::string map_text(const MapPlot& map, const std::string& prefix, int width, Legend& legend) {
  std::ostringstream blocks;
  std::string items;
  for (std::size_t i = 0; i < map.layers.size(); ++i) {
    const MapLayer& layer = map.layers[i];
    // Only the first kind of mark in a layer carries its label.
    std::string label = layer.label;
    const auto add = [&](const std::string& kind, const std::string& rows,
                         const std::string& with) {
      if (rows.empty()) return;
      const std::string name = prefix + "layer" + std::to_string(i) + kind;
      const std::string style = "with " + with + colour_text(layer.colour);
      write_block(blocks, name, rows);
      items += (items.empty() ? "plot $" : ", \\\n  $") + name + " using 1:2 " + style + " notitle";
      legend.add(std::exchange(label, std::string()), style);
    };
    add("polygons", polygons_text(layer.filled_polygons, true),
        "filledcurves closed fs solid 0.45 noborder");
    add("lines", polygons_text(layer.lines, false), "lines lw 2");
    add("dots", points_text(layer.dots), "points pt 7 ps 0.35");
    add("circles", points_text(layer.circles), "points pt 6 ps 0.7");
    add("crosses", points_text(layer.crosses), "points pt 2 ps 1.4 lw 3");
    add("squares", points_text(layer.squares), "points pt 5 ps 1.2");
  }
  return blocks.str() + title_text(map.title, width) + "set xlabel " +
         gnuplot_text("x [" + map.unit + "]") + "\nset ylabel " +
         gnuplot_text("y [" + map.unit + "]") + "\nunset key\n" +
         (items.empty() ? "plot NaN notitle" : items) + "\n";
}

// A rectangle around everything that is drawn.
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
  // With a margin, no wider than 5 times and no higher than 1.2 times the other side.
  void give_room() {
    if (!(low.x_m <= high.x_m)) low = high = {};
    const double side = std::max({width(), height(), 1e-6 * std::abs(low.x_m), 1e-9});
    grow(0.03 * side, 0.03 * side);
    grow(std::max(0.0, 0.5 * (height() / 1.2 - width())), 0.0);
    grow(0.0, std::max(0.0, 0.5 * (0.2 * width() - height())));
  }

 private:
  void grow(double x, double y) {
    low = {low.x_m - x, low.y_m - y};
    high = {high.x_m + x, high.y_m + y};
  }
};

// Both axes to one scale, with as many marks as have room.
struct Scale {
  int box_height;
  std::string axes;
};

Scale equal_scale(const Bounds& bounds, int box_width) {
  const double px = box_width / bounds.width();
  constexpr double min_step_px = 50.0;
  double step = std::pow(10.0, std::floor(std::log10(min_step_px / px)));
  for (const double more : {2.0, 2.5, 2.0}) {
    if (step * px < min_step_px) step *= more;
  }
  return {static_cast<int>(std::lround(px * bounds.height())),
          "set xrange [" + number(bounds.low.x_m) + ":" + number(bounds.high.x_m) +
              "]\nset yrange [" + number(bounds.low.y_m) + ":" + number(bounds.high.y_m) +
              "]\nset xtics " + number(step) + "\nset ytics " + number(step) + "\n"};
}

// Around a plot, in pixels: tick labels and axis titles left and below, a title above.
constexpr int left_px = 66;
constexpr int right_px = 12;
constexpr int above_px = 30;
constexpr int below_px = 50;

}  // namespace

std::string_view hex(PlotColour colour) {
  constexpr std::array<std::string_view, 12> colours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                     "#e69f00", "#56b4e9", "#000000", "#f0e442",
                                                     "#555555", "#8c8c8c", "#c4c4c4", "#e4e4e4"};
  return colours.at(static_cast<std::size_t>(colour));
}

void write_plot(const std::filesystem::path& path, const LinePlot& plot) {
  constexpr std::size_t series_colours = 7;  // the first ones, up to black
  std::ostringstream body;
  std::string items;
  Legend legend;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const Series& series = plot.series[i];
    require(series.x.size() == series.y.size(), "number of y values of a series",
            static_cast<double>(series.y.size()), "the number of its x values");
    const bool errors = !series.y_low.empty() || !series.y_high.empty();
    require(!errors ||
                (series.y_low.size() == series.x.size() && series.y_high.size() == series.x.size()),
            "number of error bars of a series", static_cast<double>(series.y_low.size()),
            "the number of its x values");
    if (series.x.empty()) continue;
    std::string rows;
    for (std::size_t j = 0; j < series.x.size(); ++j) {
      rows += number(series.x[j]) + " " + number(series.y[j]);
      if (errors) rows += " " + number(series.y_low[j]) + " " + number(series.y_high[j]);
      rows += "\n";
    }
    const std::string name = "series" + std::to_string(i);
    write_block(body, name, rows);
    const std::string colour = colour_text(static_cast<PlotColour>(i % series_colours));
    const std::string dashes = " dt " + std::to_string(1 + i / series_colours);
    std::string style;
    switch (series.style) {
      case SeriesStyle::lines:
        style = "with lines lw 2" + dashes;
        break;
      case SeriesStyle::points:
        style = "with points pt 7 ps 0.6";
        break;
      case SeriesStyle::lines_and_points:
        style = "with linespoints lw 2 pt 7 ps 0.7" + dashes;
        break;
      case SeriesStyle::bars:
        style = "with boxes";
        break;
    }
    style += colour;
    legend.add(series.label, style);
    // Lines and points come over their error bars, bars under them.
    const bool below = series.style == SeriesStyle::bars;
    const std::string marks = "$" + name + " using 1:2 " + style + " notitle";
    const std::string bars = "$" + name + " using 1:2:3:4 with yerrorbars pt 0 lw 1.5" +
                             (below ? colour_text(PlotColour::dark_grey) : colour) + " notitle";
    if (!items.empty()) items += ", \\\n  ";
    if (!errors) {
      items += marks;
    } else {
      items += below ? marks + ", \\\n  " + bars : bars + ", \\\n  " + marks;
    }
  }
  PictureSize size{720, 420};
  int below = below_px;
  body << "set multiplot\n"
       << title_text(plot.title, size.width - left_px) << "set xlabel "
       << gnuplot_text(plot.x_label) << "\nset ylabel " << gnuplot_text(plot.y_label) << "\n";
  if (plot.log_x) body << "set logscale x\n";
  if (plot.log_y) body << "set logscale y\n";
  const std::optional unit{std::pair{0.1, 1.0}};  // of a plot of nothing
  body << "set xrange " << range_text(items.empty() ? unit : plot.x_range) << "\nset yrange "
       << range_text(items.empty() ? unit : plot.y_range) << "\n";
  if (!plot.x_tick_labels.empty() && !plot.series.empty()) {
    const std::size_t count = std::min(plot.x_tick_labels.size(), plot.series[0].x.size());
    std::size_t longest = 1;
    std::string tics;
    // Turned where they would overlap, and only every so many where even that is too narrow.
    const std::size_t every = 1 + 16 * count / static_cast<std::size_t>(size.width - left_px);
    for (std::size_t i = 0; i < count; i += every) {
      const std::string tick = gnuplot_tick(plot.x_tick_labels[i]);
      longest = std::max(longest, tick.size() - 2);
      tics += (i > 0 ? ", " : "") + tick + " " + number(plot.series[0].x[i]);
    }
    const bool turned = count * (longest + 1) * character_px >
                        every * static_cast<std::size_t>(size.width - left_px - right_px);
    if (turned) below += static_cast<int>(longest) * character_px * 2 / 3;
    body << "set xtics " << (turned ? "rotate by 40 right " : "norotate ") << "(" << tics << ")\n";
  }
  const int high = legend.height(size.width);
  size.height += high + below - below_px;
  body << placed({left_px + 10, above_px, size.width - left_px - 10 - right_px,
                  size.height - above_px - below - high},
                 size)
       << "unset key\nset style fill solid 0.7\nset boxwidth 0.6\nplot "
       << (items.empty() ? "NaN notitle" : items) << "\n"
       << legend.text(size) << "unset multiplot\n";
  draw(path, size, body.str());
}

void write_plot(const std::filesystem::path& path, const HeatMap& plot) {
  require(plot.columns >= 1 && plot.rows >= 1 &&
              plot.values.size() ==
                  static_cast<std::size_t>(plot.columns) * static_cast<std::size_t>(plot.rows),
          "number of heat map values", static_cast<double>(plot.values.size()),
          "columns * rows >= 1");
  std::ostringstream body;
  std::string rows;
  double low = 0.0;
  double high = 0.0;
  for (int j = 0; j < plot.rows; ++j) {
    for (int i = 0; i < plot.columns; ++i) {
      const double value = plot.values[static_cast<std::size_t>(j) * plot.columns + i];
      if (std::isfinite(value)) {
        low = std::min(low, value);
        high = std::max(high, value);
      }
      rows += number(plot.first_cell.x_m + i * plot.spacing_m) + " " +
              number(plot.first_cell.y_m + j * plot.spacing_m) + " " + number(value) + "\n";
    }
  }
  if (low == high) high = 1.0;
  write_block(body, "cells", rows);
  const double half = 0.5 * plot.spacing_m;
  Bounds bounds;
  bounds.include({{plot.first_cell.x_m - half, plot.first_cell.y_m - half},
                  {plot.first_cell.x_m + (plot.columns - 0.5) * plot.spacing_m,
                   plot.first_cell.y_m + (plot.rows - 0.5) * plot.spacing_m}});
  bounds.give_room();
  constexpr int bar_px = 110;
  PictureSize size{720, 0};
  Box box{left_px, above_px, size.width - left_px - bar_px, 0};
  const Scale scale = equal_scale(bounds, box.width);
  box.height = scale.box_height;
  size.height = above_px + box.height + below_px;
  const std::string crosses = points_text(plot.crosses);
  if (!crosses.empty()) write_block(body, "crosses", crosses);
  body << placed(box, size) << scale.axes << "set title " << gnuplot_text(plot.title)
       << "\nset xlabel " << gnuplot_text(plot.x_label) << "\nset ylabel "
       << gnuplot_text(plot.y_label) << "\nset cblabel " << gnuplot_text(plot.value_label)
       << "\nset palette defined (0 \"#440154\", 0.25 \"#3b528b\", 0.5 \"#21918c\", 0.75 "
          "\"#5ec962\", 1 \"#fde725\")\nset cbrange ["
       << number(low) << ":" << number(high)
       << "]\nset style fill solid 1 noborder\nplot $cells using "
       // An image has two rows and two columns at least.
       << (plot.columns > 1 && plot.rows > 1 ? "1:2:3 with image notitle"
                                             : "1:2:(" + number(half) + "):(" + number(half) +
                                                   "):3 with boxxyerror lc palette notitle");
  if (!crosses.empty()) {
    body << ", $crosses using 1:2 with points pt 2 ps 2 lw 3" << colour_text(PlotColour::vermilion)
         << " notitle";
  }
  draw(path, size, body.str());
}

void write_plot(const std::filesystem::path& path, const PicturePlot& plot) {
  require(plot.columns >= 1 && plot.rows >= 1 &&
              plot.values.size() ==
                  static_cast<std::size_t>(plot.columns) * static_cast<std::size_t>(plot.rows),
          "number of picture values", static_cast<double>(plot.values.size()),
          "columns * rows >= 1");
  std::string rows;
  const double dx = (plot.x_range.second - plot.x_range.first) / plot.columns;
  const double dy = (plot.y_range.second - plot.y_range.first) / plot.rows;
  for (int j = 0; j < plot.rows; ++j) {
    for (int i = 0; i < plot.columns; ++i) {
      const float value = plot.values[static_cast<std::size_t>(j) * plot.columns + i];
      const bool known = std::isfinite(value);
      const auto grey = [&](double missing) {
        return std::to_string(std::lround(
            255.0 * std::clamp(known ? static_cast<double>(value) : missing, 0.0, 1.0)));
      };
      rows += number(plot.x_range.first + (i + 0.5) * dx) + " " +
              number(plot.y_range.first + (j + 0.5) * dy) + " " + grey(0.55) + " " + grey(0.7) +
              " " + grey(0.9) + "\n";
    }
  }
  std::ostringstream body;
  write_block(body, "pixels", rows);
  body << "set title " << gnuplot_text(plot.title) << "\nset xlabel " << gnuplot_text(plot.x_label)
       << "\nset ylabel " << gnuplot_text(plot.y_label) << "\nset tics out\nset xrange ["
       << number(plot.x_range.first) << ":" << number(plot.x_range.second) << "]\nset yrange ["
       << number(plot.y_range.first) << ":" << number(plot.y_range.second) << "]\n";
  if (plot.x_tick != 0.0) body << "set xtics " << number(plot.x_tick) << "\n";
  if (plot.y_tick != 0.0) body << "set ytics " << number(plot.y_tick) << "\n";
  body << "plot $pixels using 1:2:3:4:5 with rgbimage notitle\n";
  draw(path, {720, 420}, body.str());
}

void write_plot(const std::filesystem::path& path, const MapPlot& plot) {
  write_plot(path, std::vector{plot}, 1);
}

void write_plot(const std::filesystem::path& path, const std::vector<MapPlot>& panels,
                int panel_columns) {
  require(!panels.empty(), "number of panels", 0.0, ">= 1");
  require(panel_columns >= 1, "panel columns", panel_columns, ">= 1");
  const int count = static_cast<int>(panels.size());
  const int panel_rows = (count + panel_columns - 1) / panel_columns;
  // All panels show the same part of the world, so that they can be compared.
  Bounds bounds;
  for (const MapPlot& panel : panels) bounds.include(panel);
  bounds.give_room();
  const int panel_width = panel_columns == 1 ? 720 : panel_columns == 2 ? 400 : 320;
  const int box_width = panel_width - left_px - right_px;
  const Scale scale = equal_scale(bounds, box_width);
  const int panel_height = above_px + scale.box_height + below_px;
  Legend legend;
  std::vector<std::string> texts;
  for (int i = 0; i < count; ++i) {
    texts.push_back(
        map_text(panels[static_cast<std::size_t>(i)], "p" + std::to_string(i), box_width, legend));
  }
  PictureSize size{panel_width * panel_columns, panel_height * panel_rows};
  size.height += legend.height(size.width);
  std::string body = "set multiplot\n" + scale.axes;
  for (int i = 0; i < count; ++i) {
    body += placed({i % panel_columns * panel_width + left_px,
                    i / panel_columns * panel_height + above_px, box_width, scale.box_height},
                   size) +
            texts[static_cast<std::size_t>(i)];
  }
  draw(path, size, body + legend.text(size) + "unset multiplot\n");
}

}  // namespace panonav::viewer
