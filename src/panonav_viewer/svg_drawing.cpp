#include "panonav_viewer/svg_drawing.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/temporary_file.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_viewer/data_url.hpp"

extern char** environ;

namespace panonav::viewer {

namespace {

namespace fs = std::filesystem;

/// Formats a number of pixels, rounded to two decimals.
std::string format_px(double value) {
  const double rounded = std::round(value * 100.0) / 100.0;
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), rounded + 0.0).ptr;
  return {text.data(), end};
}

std::string format_point(double x, double y) {
  return format_px(x) + "," + format_px(y);
}

bool is_finite(const Point2& point) {
  return std::isfinite(point.x_m) && std::isfinite(point.y_m);
}

std::string format_stroke(PlotColour colour, double width) {
  return " fill='none' stroke='" + std::string(to_css_colour(colour)) + "' stroke-width='" +
         format_px(width) + "' stroke-linejoin='round'";
}

std::string format_box(const SvgBox& box) {
  return " x='" + format_px(box.left) + "' y='" + format_px(box.top) + "' width='" +
         format_px(box.width) + "' height='" + format_px(box.height) + "'";
}

std::string format_mark(const Point2& at, MarkShape shape, double radius) {
  const std::string r = format_px(radius);
  const std::string side = format_px(2.0 * radius);
  const double left = at.x_m - radius;
  switch (shape) {
    case MarkShape::dot:  // a line of length 0 with round ends
      return "M" + format_point(at.x_m, at.y_m) + "h0";
    case MarkShape::ring:
      return "M" + format_point(left, at.y_m) + "a" + r + "," + r + " 0 1 0 " + side + ",0a" + r +
             "," + r + " 0 1 0 -" + side + ",0";
    case MarkShape::cross:
      return "M" + format_point(left, at.y_m - radius) + "l" + side + "," + side + "M" +
             format_point(left, at.y_m + radius) + "l" + side + ",-" + side;
    case MarkShape::square:
      return "M" + format_point(left, at.y_m - radius) + "h" + side + "v" + side + "h-" + side +
             "z";
  }
  return {};
}

/// Runs ffmpeg with the file `svg` as input, `picture` as output and `log` for its errors; returns
/// its exit code.
int run_ffmpeg(const fs::path& svg, const fs::path& picture, const fs::path& log) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr int written = O_WRONLY | O_CREAT | O_TRUNC;
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, svg.c_str(), O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, picture.c_str(), written, 0666);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(), written, 0600);
  std::vector<std::string> words{"ffmpeg",          "-v",        "error", "-f",   "svg_pipe", "-i",
                                 "file:/dev/stdin", "-frames:v", "1",     "-c:v", "png",      "-f",
                                 "image2pipe",      "pipe:"};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int error = posix_spawnp(&child, "ffmpeg", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    throw Error(
        "PNG images need the program ffmpeg, which cannot be started; install the package ffmpeg, "
        "or choose a name that ends in .svg");
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void write_text(const fs::path& path, const std::string& text, const fs::path& named) {
  std::ofstream out(path);
  out << text;
  out.flush();
  if (!out) throw FileError(named.string(), "cannot be written; is the disk full?");
}

}  // namespace

void SvgDrawing::add_path(std::span<const Point2> points, PlotColour colour,
                          const LineStyle& style) {
  constexpr std::array<std::string_view, 5> patterns{"", "6,3", "2,3", "9,3,2,3", "4,4"};
  std::string path;
  bool is_continued = false;
  for (const Point2& point : points) {
    const bool is_shown = is_finite(point);
    if (is_shown) path += (is_continued ? 'L' : 'M') + format_point(point.x_m, point.y_m);
    is_continued = is_shown;
  }
  if (path.empty()) return;
  const std::string_view dashes = patterns.at(static_cast<std::size_t>(style.dashes) % 5);
  body_ += "<path d='" + path + "'" + format_stroke(colour, style.width);
  if (!dashes.empty()) body_ += " stroke-dasharray='" + std::string(dashes) + "'";
  body_ += "/>\n";
}

void SvgDrawing::add_polygon(std::span<const Point2> corners, PlotColour colour, double opacity) {
  std::string text;
  for (const Point2& corner : corners) {
    if (is_finite(corner)) text += format_point(corner.x_m, corner.y_m) + " ";
  }
  if (text.empty()) return;
  text.pop_back();
  body_ += "<polygon points='" + text + "' fill='" + std::string(to_css_colour(colour)) +
           "' fill-opacity='" + format_px(opacity) + "'/>\n";
}

void SvgDrawing::add_box(const SvgBox& box, PlotColour colour, double opacity) {
  body_ += "<rect" + format_box(box) + " fill='" + std::string(to_css_colour(colour)) +
           "' fill-opacity='" + format_px(opacity) + "'/>\n";
}

void SvgDrawing::add_frame(const SvgBox& box, PlotColour colour) {
  body_ += "<path d='M" + format_point(box.left, box.top) + " L" +
           format_point(box.left, box.bottom()) + " L" + format_point(box.right(), box.bottom()) +
           " L" + format_point(box.right(), box.top) + " Z'" + format_stroke(colour, 1.0) + "/>\n";
}

void SvgDrawing::add_marks(std::span<const Point2> points, PlotColour colour,
                           const MarkStyle& style) {
  std::string path;
  for (const Point2& point : points) {
    if (is_finite(point)) path += format_mark(point, style.shape, style.radius);
  }
  if (path.empty()) return;
  body_ += "<path d='" + path + "'";
  if (style.shape == MarkShape::square) {
    body_ += " fill='" + std::string(to_css_colour(colour)) + "'/>\n";
  } else {
    const bool is_dot = style.shape == MarkShape::dot;
    body_ += format_stroke(colour, is_dot ? 2.0 * style.radius : style.line_width) +
             (is_dot ? " stroke-linecap='round'/>\n" : "/>\n");
  }
}

void SvgDrawing::add_text(Point2 at, std::string_view text, const TextStyle& style) {
  constexpr std::size_t max_characters = 160;  // wider than any picture
  std::string escaped;
  for (const char c : shorten_middle(to_readable_line(text), max_characters)) {
    escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
  }
  const std::string place = format_point(at.x_m, at.y_m);
  body_ += "<text x='" + format_px(at.x_m) + "' y='" + format_px(at.y_m) + "'";
  if (style.anchor != "start") body_ += " text-anchor='" + std::string(style.anchor) + "'";
  if (style.size != TextStyle().size) body_ += " font-size='" + format_px(style.size) + "'";
  if (style.rotation_deg != 0.0) {
    body_ += " transform='rotate(" + format_px(style.rotation_deg) + "," + place + ")'";
  }
  body_ += ">" + escaped + "</text>\n";
}

void SvgDrawing::add_image(const SvgBox& box, ImageView image) {
  body_ += "<image" + format_box(box) +
           " preserveAspectRatio='none' style='image-rendering:pixelated' href='" +
           make_data_url("image/png", encode_png(image)) + "'/>\n";
}

void SvgDrawing::begin_clip(const SvgBox& box) {
  body_ += "<svg" + format_box(box) + " viewBox='" + format_px(box.left) + " " +
           format_px(box.top) + " " + format_px(box.width) + " " + format_px(box.height) + "'>\n";
}

void SvgDrawing::end_clip() {
  body_ += "</svg>\n";
}

std::string SvgDrawing::to_text(double width, double height) const {
  const std::string w = format_px(width);
  const std::string h = format_px(height);
  return "<svg xmlns='http://www.w3.org/2000/svg' width='" + w + "' height='" + h +
         "' viewBox='0 0 " + w + " " + h +
         "' font-family='sans-serif' font-size='12'>\n<rect width='100%' height='100%' "
         "fill='#ffffff'/>\n" +
         body_ + "</svg>\n";
}

double estimate_text_width(std::string_view text) {
  constexpr double px_per_character = 7.0;
  return px_per_character * static_cast<double>(text.size());
}

void write_drawing(const std::filesystem::path& path, const std::string& svg) {
  TemporaryFile picture(path);
  if (path.extension() == ".svg") {
    write_text(picture.path(), svg, path);
  } else {
    const TemporaryFile drawing(path.string() + ".svg");
    const TemporaryFile log(path.string() + ".log");
    write_text(drawing.path(), svg, path);
    if (run_ffmpeg(drawing.path(), picture.path(), log.path()) != 0) {
      std::ifstream in(log.path());
      std::string line;
      std::getline(in, line);
      throw FileError(path.string(),
                      "cannot be converted from SVG by ffmpeg: " + to_readable_line(line));
    }
  }
  std::error_code error;
  fs::rename(picture.path(), path, error);
  if (error) throw FileError(path.string(), "cannot be written: " + error.message());
  picture.keep();
}

}  // namespace panonav::viewer
