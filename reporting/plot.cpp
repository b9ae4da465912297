#include "reporting/plot.hpp"

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
#include "panonav/core/text.hpp"
#include "reporting/picture_plot.hpp"

extern char** environ;

namespace panonav {

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

// A pair of files that are gone when the scope ends, whatever happens.
struct TemporaryFile {
  fs::path path;
  explicit TemporaryFile(fs::path p) : path(std::move(p)) {}
  ~TemporaryFile() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
};

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

struct PictureSize {
  int width;
  int height;
};

void draw(const fs::path& path, PictureSize size, const std::string& body) {
  const bool vector_picture = path.extension() == ".svg";
  const std::string unique = "." + std::to_string(getpid());
  const TemporaryFile picture(path.string() + unique + ".part");
  const TemporaryFile script(path.string() + unique + ".gnuplot");
  const TemporaryFile log(path.string() + unique + ".log");
  std::ostringstream text;
  text << "set encoding utf8\nset terminal " << (vector_picture ? "svg" : "pngcairo")
       << " noenhanced size " << size.width << "," << size.height
       << " background rgb \"white\" font \"DejaVu Sans," << (vector_picture ? 12 : 11) << "\"\n"
       << "set border lc rgb \"#444444\"\nset grid lc rgb \"#dddddd\" lw 1\n"
       << body << "\n";
  {
    std::ofstream out(script.path);
    out << text.str();
    out.flush();
    if (!out)
      throw FileError(path.string(), "cannot be written; is the folder there and writable?");
  }
  const int result = run_gnuplot(script.path, picture.path, log.path);
  if (result != 0) {
    std::ifstream in(log.path);
    std::string line;
    std::string last;
    while (std::getline(in, line)) {
      if (!line.empty()) last = line;
    }
    throw FileError(path.string(), "gnuplot failed: " + last);
  }
  std::error_code error;
  fs::rename(picture.path, path, error);
  if (error) throw FileError(path.string(), "cannot be written: " + error.message());
}

// Colours that stay apart for colour-blind readers (Okabe and Ito).
constexpr std::array<const char*, 7> kColours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                              "#e69f00", "#56b4e9", "#000000"};

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

// Data blocks and the plot command of one map; names carry `prefix`.
std::string map_text(const MapPlot& map, const std::string& prefix) {
  std::ostringstream blocks;
  std::ostringstream items;
  const auto add = [&](const std::string& name, const std::string& rows, const std::string& style,
                       const std::string& label) {
    if (rows.empty()) return;
    write_block(blocks, name, rows);
    items << (items.tellp() > 0 ? ", \\\n  " : "") << "$" << name << " using 1:2 " << style
          << (label.empty() ? std::string(" notitle") : " title " + gnuplot_text(label));
  };
  for (std::size_t i = 0; i < map.layers.size(); ++i) {
    const MapLayer& layer = map.layers[i];
    const std::string name = prefix + "layer" + std::to_string(i);
    const std::string colour = " lc rgb " + gnuplot_text(layer.colour);
    // Only the first kind of mark in a layer carries its label.
    std::string label = layer.label;
    const auto take_label = [&label](bool used) {
      return used ? std::exchange(label, std::string()) : std::string();
    };
    add(name + "polygons", polygons_text(layer.filled_polygons, true),
        "with filledcurves closed fs solid 0.45 noborder" + colour,
        take_label(!layer.filled_polygons.empty()));
    add(name + "lines", polygons_text(layer.lines, false), "with lines lw 2" + colour,
        take_label(!layer.lines.empty()));
    add(name + "dots", points_text(layer.dots), "with points pt 7 ps 0.35" + colour,
        take_label(!layer.dots.empty()));
    add(name + "circles", points_text(layer.circles), "with points pt 6 ps 0.8" + colour,
        take_label(!layer.circles.empty()));
    add(name + "crosses", points_text(layer.crosses), "with points pt 2 ps 1.6 lw 3" + colour,
        take_label(!layer.crosses.empty()));
    add(name + "squares", points_text(layer.squares), "with points pt 5 ps 1.3" + colour,
        take_label(!layer.squares.empty()));
  }
  std::ostringstream text;
  text << blocks.str() << "set title " << gnuplot_text(map.title) << "\n"
       << "set size ratio -1\nset key outside bottom center horizontal samplen 1.5 width -1\n";
  if (items.tellp() > 0) {
    text << "plot " << items.str() << "\n";
  } else {
    text << "plot [0:1][0:1] NaN notitle\n";
  }
  return text.str();
}

// The rectangle around everything on a map.
struct Bounds {
  Point2 low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  Point2 high{-low.x_m, -low.y_m};

  void include(const std::vector<Point2>& points) {
    for (const auto& p : points) {
      low = {std::min(low.x_m, p.x_m), std::min(low.y_m, p.y_m)};
      high = {std::max(high.x_m, p.x_m), std::max(high.y_m, p.y_m)};
    }
  }
  void include(const MapPlot& map) {
    for (const auto& layer : map.layers) {
      include(layer.circles);
      include(layer.crosses);
      include(layer.dots);
      include(layer.squares);
      for (const auto& line : layer.lines) include(line);
      for (const auto& polygon : layer.filled_polygons) include(polygon);
    }
  }
  [[nodiscard]] bool empty() const { return !(high.x_m > low.x_m && high.y_m > low.y_m); }
};

// Keeps a map's picture close to the map's own proportions.
PictureSize map_size(const Bounds& bounds, int width) {
  const double ratio =
      bounds.empty()
          ? 0.75
          : std::clamp((bounds.high.y_m - bounds.low.y_m) / (bounds.high.x_m - bounds.low.x_m), 0.2,
                       1.2);
  return {width, static_cast<int>(ratio * width) + 130};
}

}  // namespace

void write_plot(const std::filesystem::path& path, const LinePlot& plot) {
  std::ostringstream body;
  bool has_labels = false;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const Series& series = plot.series[i];
    require(series.x.size() == series.y.size(), "number of y values of a series",
            static_cast<double>(series.y.size()), "the number of its x values");
    const bool bars = !series.y_low.empty() || !series.y_high.empty();
    require(!bars ||
                (series.y_low.size() == series.x.size() && series.y_high.size() == series.x.size()),
            "number of error bars of a series", static_cast<double>(series.y_low.size()),
            "the number of its x values");
    has_labels = has_labels || !series.label.empty();
    std::string rows;
    for (std::size_t j = 0; j < series.x.size(); ++j) {
      rows += number(series.x[j]) + " " + number(series.y[j]);
      if (bars) rows += " " + number(series.y_low[j]) + " " + number(series.y_high[j]);
      rows += "\n";
    }
    write_block(body, "series" + std::to_string(i), rows.empty() ? "NaN NaN\n" : rows);
  }
  body << "set title " << gnuplot_text(plot.title) << "\nset xlabel " << gnuplot_text(plot.x_label)
       << "\nset ylabel " << gnuplot_text(plot.y_label) << "\n";
  if (plot.log_x) body << "set logscale x\n";
  if (plot.log_y) body << "set logscale y\n";
  body << "set xrange " << range_text(plot.x_range) << "\nset yrange " << range_text(plot.y_range)
       << "\n";
  if (has_labels) body << "set key outside right top\n";
  if (!plot.x_tick_labels.empty() && !plot.series.empty()) {
    body << "set xtics rotate by -20 (";
    for (std::size_t i = 0; i < plot.x_tick_labels.size() && i < plot.series[0].x.size(); ++i) {
      body << (i > 0 ? ", " : "") << gnuplot_tick(plot.x_tick_labels[i]) << " "
           << number(plot.series[0].x[i]);
    }
    body << ")\n";
  }
  body << "set style fill solid 0.7\nset boxwidth 0.6\nplot ";
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const Series& series = plot.series[i];
    const std::string colour = std::string(" lc rgb \"") + kColours[i % kColours.size()] + "\"";
    const std::string data = "$series" + std::to_string(i);
    std::string style;
    switch (series.style) {
      case SeriesStyle::lines:
        style = "with lines lw 2";
        break;
      case SeriesStyle::points:
        style = "with points pt 7 ps 0.6";
        break;
      case SeriesStyle::lines_and_points:
        style = "with linespoints lw 2 pt 7 ps 0.7";
        break;
      case SeriesStyle::bars:
        style = "with boxes";
        break;
    }
    // Lines and points come over their error bars, bars under them.
    const bool below = series.style == SeriesStyle::bars;
    const std::string marks =
        data + " using 1:2 " + style + colour +
        (series.label.empty() ? std::string(" notitle") : " title " + gnuplot_text(series.label));
    const std::string error_bars = data + " using 1:2:3:4 with yerrorbars pt 0 lw 1.5" +
                                   (below ? std::string(" lc rgb \"#333333\"") : colour) +
                                   " notitle";
    body << (i > 0 ? ", \\\n  " : "");
    if (series.y_low.empty()) {
      body << marks;
    } else {
      body << (below ? marks : error_bars) << ", \\\n  " << (below ? error_bars : marks);
    }
  }
  if (plot.series.empty()) body << "[0:1][0:1] NaN notitle";
  draw(path, {900, 520}, body.str());
}

void write_plot(const std::filesystem::path& path, const HeatMap& plot) {
  require(plot.columns >= 1 && plot.rows >= 1 &&
              plot.values.size() ==
                  static_cast<std::size_t>(plot.columns) * static_cast<std::size_t>(plot.rows),
          "number of heat map values", static_cast<double>(plot.values.size()),
          "columns * rows >= 1");
  std::ostringstream body;
  std::string rows;
  for (int j = 0; j < plot.rows; ++j) {
    for (int i = 0; i < plot.columns; ++i) {
      rows += number(plot.first_cell.x_m + i * plot.spacing_m) + " " +
              number(plot.first_cell.y_m + j * plot.spacing_m) + " " +
              number(plot.values[static_cast<std::size_t>(j) * plot.columns + i]) + "\n";
    }
  }
  write_block(body, "cells", rows);
  body << "set title " << gnuplot_text(plot.title) << "\nset xlabel " << gnuplot_text(plot.x_label)
       << "\nset ylabel " << gnuplot_text(plot.y_label) << "\nset cblabel "
       << gnuplot_text(plot.value_label)
       << "\nset size ratio -1\nset palette defined (0 \"#440154\", 0.25 \"#3b528b\", 0.5 "
          "\"#21918c\", 0.75 \"#5ec962\", 1 \"#fde725\")\nset datafile missing \"NaN\"\n"
       << "set xrange [" << number(plot.first_cell.x_m - 0.5 * plot.spacing_m) << ":"
       << number(plot.first_cell.x_m + (plot.columns - 0.5) * plot.spacing_m) << "]\nset yrange ["
       << number(plot.first_cell.y_m - 0.5 * plot.spacing_m) << ":"
       << number(plot.first_cell.y_m + (plot.rows - 0.5) * plot.spacing_m) << "]\n";
  // Boxes instead of an image: they keep their borders sharp and leave missing cells white.
  const std::string half = number(0.5 * plot.spacing_m);
  std::string crosses = points_text(plot.crosses);
  if (!crosses.empty()) write_block(body, "crosses", crosses);
  body << "set style fill solid 1 noborder\nplot $cells using 1:2:(" << half << "):(" << half
       << "):3 with boxxyerror lc palette notitle";
  if (!crosses.empty()) {
    body << ", $crosses using 1:2 with points pt 2 ps 2 lw 3 lc rgb \"#d55e00\" notitle";
  }
  const double ratio = std::clamp(static_cast<double>(plot.rows) / plot.columns, 0.2, 1.2);
  draw(path, {900, static_cast<int>(700 * ratio) + 150}, body.str());
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
       << "\nset ylabel " << gnuplot_text(plot.y_label) << "\nset tics out nomirror\nset xrange ["
       << number(plot.x_range.first) << ":" << number(plot.x_range.second) << "]\nset yrange ["
       << number(plot.y_range.first) << ":" << number(plot.y_range.second) << "]\n";
  if (plot.x_tick != 0.0) body << "set xtics " << number(plot.x_tick) << "\n";
  if (plot.y_tick != 0.0) body << "set ytics " << number(plot.y_tick) << "\n";
  body << "plot $pixels using 1:2:3:4:5 with rgbimage notitle\n";
  draw(path, {1000, 480}, body.str());
}

void write_plot(const std::filesystem::path& path, const MapPlot& plot) {
  Bounds bounds;
  bounds.include(plot);
  draw(path, map_size(bounds, 800),
       "set xlabel " + gnuplot_text("x [" + plot.unit + "]") + "\nset ylabel " +
           gnuplot_text("y [" + plot.unit + "]") +
           "\nset offsets graph 0.03, graph 0.03, graph 0.03, graph 0.03\n" + map_text(plot, "m"));
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
  constexpr int kPanelWidth = 560;
  PictureSize size = map_size(bounds, kPanelWidth);
  size.width *= panel_columns;
  size.height *= panel_rows;
  std::string body = "set multiplot layout " + std::to_string(panel_rows) + "," +
                     std::to_string(panel_columns) + "\nset xlabel 'x [m]'\nset ylabel 'y [m]'\n";
  if (!bounds.empty()) {
    const double margin =
        0.03 * std::max(bounds.high.x_m - bounds.low.x_m, bounds.high.y_m - bounds.low.y_m);
    body += "set xrange [" + number(bounds.low.x_m - margin) + ":" +
            number(bounds.high.x_m + margin) + "]\nset yrange [" + number(bounds.low.y_m - margin) +
            ":" + number(bounds.high.y_m + margin) + "]\n";
  }
  for (int i = 0; i < count; ++i) {
    body += map_text(panels[static_cast<std::size_t>(i)], "p" + std::to_string(i));
  }
  draw(path, size, body + "unset multiplot\n");
}

}  // namespace panonav
