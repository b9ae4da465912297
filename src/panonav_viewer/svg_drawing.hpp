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

/// A rectangle in a drawing, in pixels from the upper left corner.
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
  double line_width = 1.5;  ///< px; only for rings and crosses
};

struct LineStyle {
  double width = 2.0;  ///< px
  int dashes = 0;      ///< pattern number; 0: no dashes
};

struct TextStyle {
  std::string_view anchor = "start";  ///< text part at the point: "start", "middle", "end"
  double size = 12.0;                 ///< px
  double rotation_deg = 0.0;          ///< clockwise, about the point
};

/// A picture of lines, marks and text, drawn from back to front. Coordinates are pixels from the
/// upper left corner. Points that are not finite are omitted and interrupt lines. Text from any
/// source is escaped.
class SvgDrawing {
 public:
  void add_path(std::span<const Point2> points, PlotColour colour, const LineStyle& style = {});
  void add_polygon(std::span<const Point2> corners, PlotColour colour, double opacity);
  void add_box(const SvgBox& box, PlotColour colour, double opacity = 1.0);
  /// Adds the outline of a box.
  void add_frame(const SvgBox& box, PlotColour colour);
  void add_marks(std::span<const Point2> points, PlotColour colour, const MarkStyle& style);
  /// Adds text; more than 160 characters are shortened in the middle.
  void add_text(Point2 at, std::string_view text, const TextStyle& style = {});
  /// Adds an image that fills the box; its pixels keep sharp edges.
  void add_image(const SvgBox& box, ImageView image);
  /// Clips drawing to the box until `end_clip`.
  void begin_clip(const SvgBox& box);
  void end_clip();

  /// Returns the text of the SVG file.
  [[nodiscard]] std::string to_text(double width, double height) const;

 private:
  std::string body_;
};

/// Estimates the width, in pixels, of text of size 12 px, a little above that of most fonts.
[[nodiscard]] double estimate_text_width(std::string_view text);

/// Writes an SVG file, or a PNG file by the program ffmpeg if `path` does not end in .svg. The file
/// is complete or does not appear at all. Throws FileError if it cannot be written, Error if ffmpeg
/// cannot be started.
void write_drawing(const std::filesystem::path& path, const std::string& svg);

}  // namespace panonav::viewer
