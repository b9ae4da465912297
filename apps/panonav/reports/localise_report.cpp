#include "reports/localise_report.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "reporting/plot.hpp"
#include "reports/home_picture.hpp"
#include "reports/report_page.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

constexpr const char* first_page_picture = "query_1.png";
constexpr std::size_t max_shown = 20;
constexpr std::size_t max_rows = 500;
constexpr std::size_t max_references = 5000;  // on a map

std::string position_text(const PlacePosition& position) {
  return "x " + fixed(position.x_m, 2) + " m, y " + fixed(position.y_m, 2) + " m";
}

std::string degrees_text(double angle_rad) {
  return fixed(degrees(angle_rad), 1) + "\u00b0";
}

std::optional<double> error_m(const LocalisedQuery& query) {
  if (!query.pose || !query.place.position) return std::nullopt;
  const auto& found = *query.place.position;
  return std::hypot(found.x_m - query.pose->x_m, found.y_m - query.pose->y_m);
}

std::string answer_text(const LocalisedQuery& query) {
  if (!query.error.empty()) return "cannot be read";
  const Place& place = query.place;
  if (!place.known || place.matches.empty()) return "unknown place";
  return "near " + place.matches.front().name;
}

/// The picture above its best match, which is turned as the robot faced. Gives the caption.
std::string draw_views(const fs::path& path, const MemoryFile& file, const Panorama& seen,
                       const Place& place) {
  std::vector<Panorama> views{seen};
  std::string caption = "The picture.";
  if (!place.matches.empty()) {
    const PlaceMatch& best = place.matches.front();
    if (const auto remembered = thumbnail_panorama(file, best.view)) {
      const double turn_rad = best.heading_rad.value_or(0.0);
      const double columns = turn_rad / (2.0 * std::numbers::pi) * remembered->columns();
      views.push_back(turn_columns(*remembered, static_cast<int>(std::lround(columns))));
      caption = "Above, the picture; below, the stored thumbnail of " + best.name + ", turned by " +
                degrees_text(turn_rad) + " so that both look the same way.";
    } else {
      caption =
          "The picture alone: the memory holds no thumbnail of the best match, " + best.name + ".";
    }
  }
  const Image picture = picture_of_views(views);
  write_png(path, picture.view());
  return caption;
}

/// False where the memory knows no positions.
bool draw_map(const fs::path& path, const VisualMemory& memory, const LocalisedQuery& query) {
  MapLayer references{.label = "references", .colour = PlotColour::grey};
  const std::size_t step = memory.size() / max_references + 1;
  for (std::size_t i = 0; i < memory.size(); i += step) {
    const auto& pose = memory.info(memory.views()[i]).pose;
    if (pose) references.dots.push_back(pose->position());
  }
  if (references.dots.empty()) return false;
  MapLayer others{.label = "next candidates", .colour = PlotColour::orange};
  MapLayer best{.label = "best match", .colour = PlotColour::blue};
  for (const PlaceMatch& match : query.place.matches) {
    const auto& pose = memory.info(match.view).pose;
    if (!pose) continue;
    const bool first = &match == &query.place.matches.front();
    (first ? best.squares : others.circles).push_back(pose->position());
  }
  std::vector<MapLayer> layers{references, others, best};
  if (const auto& found = query.place.position) {
    MapLayer answer{.label = "answer", .colour = PlotColour::vermilion};
    const Point2 at{found->x_m, found->y_m};
    answer.crosses.push_back(at);
    if (const auto& heading = query.place.heading_rad) {
      double reach_m = 0.0;
      for (const Point2& place : references.dots) reach_m = std::max(reach_m, distance(at, place));
      const double length_m = 0.15 * reach_m;
      answer.lines.push_back(
          {at, {at.x_m + length_m * std::cos(*heading), at.y_m + length_m * std::sin(*heading)}});
    }
    layers.push_back(answer);
  }
  if (query.pose) {
    layers.push_back({.label = "ground truth",
                      .colour = PlotColour::black,
                      .circles = {query.pose->position()}});
  }
  write_plot(path, MapPlot{.title = "From above", .layers = layers});
  return true;
}

std::vector<std::pair<std::string, std::string>> figures_of(const LocalisedQuery& query) {
  const Place& place = query.place;
  std::vector<std::pair<std::string, std::string>> figures;
  if (place.position) {
    figures.emplace_back(
        position_text(*place.position),
        place.position->radius_m
            ? "position, within " + fixed(*place.position->radius_m, 2) + " m in 95 % of cases"
            : "position");
  }
  if (place.heading_rad) figures.emplace_back(degrees_text(*place.heading_rad), "heading");
  if (const auto error = error_m(query)) {
    figures.emplace_back(fixed(*error, 2) + " m", "from the data set's position");
  }
  const auto& matches = place.matches;
  if (!matches.empty()) {
    figures.emplace_back(fixed(place.known_probability, 2), "probability that the place is known");
    figures.emplace_back(
        fixed(matches[0].column_difference, 3),
        place.known ? "difference to the best match" : "difference to the most similar view");
  }
  if (matches.size() > 1) {
    figures.emplace_back(fixed(matches[1].column_difference, 3), "to the next, " + matches[1].name);
  }
  return figures;
}

void add_table(ReportPage& page, const std::vector<LocalisedQuery>& queries) {
  page.section("All answers");
  if (queries.size() > max_rows) {
    page.text("The first " + std::to_string(max_rows) + " of " + std::to_string(queries.size()) +
              "; --out writes all of them.");
  }
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < std::min(max_rows, queries.size()); ++i) {
    const LocalisedQuery& query = queries[i];
    const auto& matches = query.place.matches;
    const auto& position = query.place.position;
    const auto& heading = query.place.heading_rad;
    const auto difference = [&](std::size_t match) {
      return match < matches.size() ? fixed(matches[match].column_difference, 3) : "";
    };
    const auto error = error_m(query);
    const auto dissimilarity = [&](std::size_t match) {
      return match < matches.size() ? std::to_string(matches[match].dissimilarity) : "";
    };
    rows.push_back({query.file, answer_text(query),
                    query.error.empty() ? fixed(query.place.known_probability, 2) : "",
                    position ? position_text(*position) : "", heading ? degrees_text(*heading) : "",
                    error ? fixed(*error, 2) : "", difference(0), difference(1), dissimilarity(0),
                    dissimilarity(1)});
  }
  page.text(
      "Difference and dissimilarity (of the signatures) are to the best match and to the next.");
  page.table({"picture", "answer", "probability", "position", "heading", "error [m]", "difference",
              "to the next", "dissimilarity", "to the next"},
             rows);
}

}  // namespace

void prepare_localise_report(const fs::path& folder) {
  prepare_report_folder(folder, first_page_picture, "localise");
}

void write_localise_report(const fs::path& folder, const MemoryFile& file,
                           const PlaceRecogniser& recogniser,
                           const std::vector<LocalisedQuery>& queries,
                           const std::function<Panorama(std::size_t)>& panorama) {
  std::vector<std::size_t> readable;
  std::vector<double> errors;
  std::size_t known = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (queries[i].error.empty()) readable.push_back(i);
    known += queries[i].place.known ? 1 : 0;
    if (const auto error = error_m(queries[i])) errors.push_back(*error);
  }
  ReportPage page(
      "Where was this?",
      "What the robot saw, and the view of " + file.path().filename().string() +
          " that resembles it most, turned as the robot faced. Where both show the "
          "same things in the same directions, the answer is right. Grey marks: straight ahead.");
  std::vector<std::pair<std::string, std::string>> summary{
      {std::to_string(known) + " of " + std::to_string(readable.size()),
       "pictures show a known place"}};
  if (!errors.empty()) {
    summary.emplace_back(fixed(median(errors), 2) + " m", "median error of the position");
  }
  if (readable.size() < queries.size()) {
    summary.emplace_back(std::to_string(queries.size() - readable.size()), "could not be read");
  }
  page.figures(summary);
  page.text(
      "The difference compares the picture with a view column by column, both turned alike: "
      "0 where they are the same. The probability that the place is known follows from how much "
      "less the better half of the columns differs at the best match than at the tenth best and "
      "at mirrored views, which show places that do not exist. Below one half the place is "
      "unknown.");
  const std::size_t shown = std::min(max_shown, readable.size());
  if (shown < readable.size()) {
    page.text("Shown are " + std::to_string(shown) + " of " + std::to_string(readable.size()) +
              " pictures, evenly spread.");
  }
  for (std::size_t n = 0; n < shown; ++n) {
    const std::size_t i = readable[n * (readable.size() - 1) / std::max<std::size_t>(1, shown - 1)];
    const LocalisedQuery& query = queries[i];
    const std::string picture = "query_" + std::to_string(n + 1) + ".png";
    const std::string map = "map_" + std::to_string(n + 1) + ".svg";
    page.section(query.file + ": " + answer_text(query));
    page.figures(figures_of(query));
    std::vector<ReportPicture> pictures{
        {picture, draw_views(folder / picture, file, panorama(i), query.place)}};
    if (draw_map(folder / map, recogniser.memory(), query)) {
      pictures.push_back(
          {map, "From above: all references, those most similar to the picture" +
                    std::string(query.place.position
                                    ? ", and the answer, with its heading where it has one."
                                    : ". There is no answer.")});
    } else if (n == 0) {
      page.text("The memory knows no positions, so there is no map.");
    }
    page.pictures(pictures);
  }
  add_table(page, queries);
  page.write(folder);
}

}  // namespace panonav::command
