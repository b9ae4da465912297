#include "reports/track_pictures.hpp"

#include <string>
#include <utility>

namespace panonav::command {

namespace {

using Lines = std::vector<std::vector<Point2>>;

viewer::MapLayer draw_references(const VisualMemory& memory) {
  viewer::MapLayer layer{.label = "stored views", .colour = viewer::PlotColour::grey};
  for (const ViewId view : memory.views()) {
    if (const auto& pose = memory.info(view).pose) layer.circles.push_back(pose->position());
  }
  return layer;
}

/// Returns one line for each run of consecutive images with a position; lines end where the robot
/// was kidnapped.
Lines split_lines(const std::vector<std::optional<Point2>>& positions,
                  const std::optional<std::size_t>& kidnapped_after) {
  Lines lines;
  bool is_continued = false;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (positions[i] && !is_continued) lines.emplace_back();
    if (positions[i]) lines.back().push_back(*positions[i]);
    is_continued = positions[i] && kidnapped_after != i;
  }
  std::erase_if(lines, [](const auto& line) { return line.size() < 2; });
  return lines;
}

viewer::MapLayer draw_true_path(const std::vector<TrackedImage>& images,
                                const TrackBackground& background) {
  std::vector<std::optional<Point2>> positions(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (images[i].truth) positions[i] = images[i].truth->position();
  }
  return {.label = "true path",
          .colour = viewer::PlotColour::black,
          .lines = split_lines(positions, background.kidnapped_after)};
}

viewer::MapLayer draw_estimated_path(const std::vector<TrackedImage>& images,
                                     const TrackBackground& background) {
  std::vector<std::optional<Point2>> positions(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (is_position_known(images[i])) positions[i] = images[i].estimate.position;
  }
  return {.label = "estimated path",
          .colour = viewer::PlotColour::blue,
          .lines = split_lines(positions, background.kidnapped_after)};
}

}  // namespace

viewer::MapPlot draw_track(const VisualMemory& memory, const std::vector<TrackedImage>& images,
                           const TrackBackground& background) {
  viewer::MapLayer localised{.label = "localised", .colour = viewer::PlotColour::blue};
  viewer::MapLayer ambiguous{.label = "ambiguous: most likely position",
                             .colour = viewer::PlotColour::orange};
  viewer::MapLayer lost{.label = "true position while lost",
                        .colour = viewer::PlotColour::vermilion};
  viewer::MapLayer start{.label = "start", .colour = viewer::PlotColour::green};
  if (images.front().truth) start.squares.push_back(images.front().truth->position());
  viewer::MapLayer kidnapped{.label = "carried to this place",
                             .colour = viewer::PlotColour::purple};
  if (background.kidnapped_after && images.at(*background.kidnapped_after + 1).truth) {
    kidnapped.squares.push_back(images[*background.kidnapped_after + 1].truth->position());
  }
  for (const TrackedImage& image : images) {
    const auto& position = image.estimate.position;
    if (is_position_known(image)) {
      localised.dots.push_back(*position);
    } else if (image.estimate.state == LocalisationState::ambiguous && position) {
      ambiguous.circles.push_back(*position);
    } else if (image.truth) {
      lost.crosses.push_back(image.truth->position());
    }
  }
  viewer::MapPlot plot{.title = "Map of the whole run", .layers = background.surroundings};
  for (viewer::MapLayer& layer : std::vector{
           draw_references(memory), draw_true_path(images, background),
           draw_estimated_path(images, background), localised, ambiguous, lost, start, kidnapped}) {
    plot.layers.push_back(std::move(layer));
  }
  return plot;
}

}  // namespace panonav::command
