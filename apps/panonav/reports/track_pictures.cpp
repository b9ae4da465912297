#include "reports/track_pictures.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "panonav/geometry/positions.hpp"

namespace panonav::command {

namespace {

using Lines = std::vector<std::vector<Point2>>;

MapLayer references(const VisualMemory& memory) {
  MapLayer layer{.label = "remembered views", .colour = PlotColour::grey};
  for (const ViewId view : memory.views()) {
    if (const auto& pose = memory.info(view).pose) layer.circles.push_back(pose->position());
  }
  return layer;
}

/// One line for each stretch of images that hold a position and follow each other.
Lines lines_of(const std::vector<std::optional<Point2>>& positions,
               const std::optional<std::size_t>& kidnapped_after) {
  Lines lines;
  bool going_on = false;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (positions[i] && !going_on) lines.emplace_back();
    if (positions[i]) lines.back().push_back(*positions[i]);
    going_on = positions[i] && kidnapped_after != i;
  }
  std::erase_if(lines, [](const auto& line) { return line.size() < 2; });
  return lines;
}

MapLayer true_path(const std::vector<TrackedImage>& images, std::size_t count,
                   const TrackBackground& background) {
  std::vector<std::optional<Point2>> positions(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (images[i].truth) positions[i] = images[i].truth->position();
  }
  return {.label = "ground truth",
          .colour = PlotColour::black,
          .lines = lines_of(positions, background.kidnapped_after)};
}

MapLayer estimated_path(const std::vector<TrackedImage>& images, std::size_t count,
                        const TrackBackground& background) {
  std::vector<std::optional<Point2>> positions(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (is_localised(images[i])) positions[i] = images[i].estimate.pose->position();
  }
  return {.label = "estimated path",
          .colour = PlotColour::blue,
          .lines = lines_of(positions, background.kidnapped_after)};
}

}  // namespace

void draw_track_map(const VisualMemory& memory, const std::vector<TrackedImage>& images,
                    const TrackBackground& background, const std::filesystem::path& path) {
  MapLayer localised{.label = "localised here", .colour = PlotColour::blue};
  MapLayer guessed{.label = "ambiguous: likeliest place", .colour = PlotColour::orange};
  MapLayer lost{.label = "true place where lost", .colour = PlotColour::vermilion};
  MapLayer start{.label = "start", .colour = PlotColour::green};
  if (images.front().truth) start.squares.push_back(images.front().truth->position());
  MapLayer kidnapped{.label = "kidnapped to here", .colour = PlotColour::purple};
  if (background.kidnapped_after && images.at(*background.kidnapped_after + 1).truth) {
    kidnapped.squares.push_back(images[*background.kidnapped_after + 1].truth->position());
  }
  for (const TrackedImage& image : images) {
    const auto& pose = image.estimate.pose;
    if (is_localised(image)) {
      localised.dots.push_back(pose->position());
    } else if (image.estimate.state == LocalisationState::ambiguous && pose) {
      guessed.circles.push_back(pose->position());
    } else if (image.truth) {
      lost.crosses.push_back(image.truth->position());
    }
  }
  MapPlot plot{.title = "The whole run from above", .layers = background.surroundings};
  for (MapLayer& layer :
       std::vector{references(memory), true_path(images, images.size(), background),
                   estimated_path(images, images.size(), background), localised, guessed, lost,
                   start, kidnapped}) {
    plot.layers.push_back(std::move(layer));
  }
  write_plot(path, plot);
}

void draw_track_snapshots(const VisualMemory& memory, const std::vector<TrackedImage>& images,
                          const std::set<std::size_t>& shown, const TrackBackground& background,
                          const std::filesystem::path& path, const std::vector<Point2>& at_first) {
  std::vector<MapPlot> panels;
  if (!at_first.empty()) {
    MapPlot panel{.title = "before the first image", .layers = background.surroundings};
    panel.layers.push_back(references(memory));
    panel.layers.push_back(
        {.label = "particles", .colour = PlotColour::vermilion, .dots = at_first});
    panels.push_back(std::move(panel));
  }
  for (const std::size_t number : shown) {
    const TrackedImage& image = images[number];
    const MapLayer particles{.label = "particles",
                             .colour = PlotColour::vermilion,
                             .dots = positions_of(image.particles)};
    MapLayer estimate{.label = is_localised(image) ? "estimate" : "likeliest place",
                      .colour = is_localised(image) ? PlotColour::blue : PlotColour::orange};
    if (image.estimate.pose) estimate.squares.push_back(image.estimate.pose->position());
    MapLayer truth{.label = "true place", .colour = PlotColour::black};
    if (image.truth) truth.crosses.push_back(image.truth->position());
    std::string title =
        "image " + std::to_string(number + 1) + ": " + std::string(name_of(image.estimate.state));
    if (background.kidnapped_after && number == *background.kidnapped_after + 1) {
      title += ", kidnapped to here";
    }
    MapPlot panel{.title = std::move(title), .layers = background.surroundings};
    for (MapLayer& layer :
         std::vector{references(memory), particles, true_path(images, number + 1, background),
                     estimated_path(images, number + 1, background), estimate, truth}) {
      panel.layers.push_back(std::move(layer));
    }
    panels.push_back(std::move(panel));
  }
  write_plot(path, panels, std::min(3, static_cast<int>(panels.size())));
}

}  // namespace panonav::command
