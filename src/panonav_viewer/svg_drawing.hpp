#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::viewer {

/// A rectangle of a drawing, in pixels from its upper left corner.
struct SvgBox {
  double left = 0.0;
  double top = 0.0;
  double width = 0.0;
  double height = 0.0;

  [[nodiscard]] double right() const { return left + width; }
  [[nodiscard]] double bottom() const { return top + height; }
};

enum class MarkShape { dot, ring, cross, square };
struct MarkStyle {
  MarkShape shape = MarkShape::dot;
  double radius = 3.0;      ///< px
  double line_width = 1.5;  ///< px, of rings and crosses
};

struct LineStyle {
  double width = 2.0;  ///< px
  int dashes = 0;      ///< 0: none; further numbers: other patterns
};

struct TextStyle {
  std::string_view anchor = "start";  ///< which part lies at the point: "start", "middle", "end"
  double size = 12.0;                 ///< px
  double rotation_deg = 0.0;          ///< clockwise, about the point
};

/// A picture of lines, marks and text, drawn from back to front. Coordinates are pixels from the
/// upper left corner; points that are not finite are left out and interrupt lines. Text of any
/// origin is shown as it is and has no effect.
class SvgDrawing {
 public:
  void add_path(std::span<const Point2> points, PlotColour colour, const LineStyle& style = {});
  void add_polygon(std::span<const Point2> corners, PlotColour colour, double opacity);
  void add_box(const SvgBox& box, PlotColour colour, double opacity = 1.0);
  /// Its outline.
  void add_frame(const SvgBox& box, PlotColour colour);
  void add_marks(std::span<const Point2> points, PlotColour colour, const MarkStyle& style);
  /// Text of more than 160 characters loses its middle.
  void add_text(Point2 at, std::string_view text, const TextStyle& style = {});
  /// Fills the box with the pixels, whose edges stay sharp.
  void add_image(const SvgBox& box, ImageView image);
  /// Clips drawing to the box until `end_clip`.
  void begin_clip(const SvgBox& box);
  void end_clip();

  /// Returns the whole text of the SVG file.
  [[nodiscard]] std::string to_text(double width, double height) const;

 private:
  std::string body_;
};

/// Estimates the width in pixels of text of 12 px; a little more than most fonts need.
[[nodiscard]] double estimate_text_width(std::string_view text);

/// Writes SVG text to `path`, or a PNG made by the program ffmpeg if the name does not end in .svg;
/// the file appears whole or not at all. Throws FileError if it cannot be written, Error if ffmpeg
/// cannot be started.
void write_drawing(const std::filesystem::path& path, const std::string& svg);

}  // namespace panonav::viewer
