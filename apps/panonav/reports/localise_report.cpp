#include "reports/localise_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav_recordings/run_recorder.hpp"
#include "panonav_viewer/report_page.hpp"
#include "runs/localised_query.hpp"
#include "runs/run_record.hpp"

namespace panonav::command {

namespace {

constexpr std::size_t max_shown = 200;
constexpr std::size_t max_rows = 500;

std::string format_position(const PositionEstimate& position, LengthUnit unit) {
  return "x " + format_fixed(position.x_m, 2) + " " + to_string(unit) + ", y " +
         format_fixed(position.y_m, 2) + " " + to_string(unit);
}

std::string format_degrees(double angle_rad) {
  return format_fixed(degrees(angle_rad), 1) + "\u00b0";
}

std::optional<double> error_m(const LocalisedQuery& query) {
  if (!query.pose || !query.place.position) return std::nullopt;
  const auto& found = *query.place.position;
  return std::hypot(found.x_m - query.pose->x_m, found.y_m - query.pose->y_m);
}

std::string describe_answer(const LocalisedQuery& query) {
  if (!query.error.empty()) return "cannot be read";
  const Place& place = query.place;
  if (!place.known || place.matches.empty()) return "unknown place";
  std::string answer = "near the stored view " + place.matches.front().name;
  for (const AlternativePlace& other : place.alternatives) answer += " or " + other.match.name;
  return answer;
}

/// Makes the moment of an image for the page.
recordings::RunMoment make_moment(const LocalisedQuery& query, std::size_t number,
                                  Panorama&& panorama, const MemoryFile& file) {
  const LengthUnit unit = read_length_unit(file);
  recordings::RunMoment moment{.stamp_s = static_cast<double>(number),
                               .panorama = std::move(panorama)};
  moment.truth = query.pose;
  const auto& matches = query.place.matches;
  set_localisation(moment, query.place);
  moment.values = {{"image", query.file}, {"answer", describe_answer(query)}};
  if (!matches.empty()) moment.values.emplace_back("best_match", matches.front().name);
  if (const auto& position = query.place.position) {
    moment.values.emplace_back("position", format_position(*position, unit));
    const std::string bound = format_bound(*position, unit);
    if (!bound.empty()) moment.values.emplace_back("in 95 % of cases", bound);
  }
  if (const auto& heading = query.place.heading_rad) {
    moment.values.emplace_back("heading", format_degrees(*heading));
  }
  if (matches.empty()) return moment;
  moment.values.emplace_back("probability of this place", format_fixed(query.place.probability, 2));
  for (const AlternativePlace& other : query.place.alternatives) {
    moment.values.emplace_back(
        "or " + other.match.name,
        "probability " + format_fixed(other.probability, 2) +
            (other.position ? ", " + format_position(*other.position, unit) : ""));
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(3, matches.size()); ++i) {
    constexpr std::array names{"best match", "second", "third"};
    moment.values.emplace_back(
        std::string("difference from the ") + names.at(i),
        format_fixed(matches[i].column_difference, 3) + ", " + matches[i].name);
  }
  moment.best_match = load_best_match(query.place, file);
  return moment;
}

void add_table(viewer::ReportPage& page, const std::vector<LocalisedQuery>& queries,
               LengthUnit unit) {
  page.begin_section("All answers");
  if (queries.size() > max_rows) {
    page.add_text("The first " + std::to_string(max_rows) + " of " +
                  std::to_string(queries.size()) + "; --out writes all answers.");
  }
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < std::min(max_rows, queries.size()); ++i) {
    const LocalisedQuery& query = queries[i];
    const auto& matches = query.place.matches;
    const auto& position = query.place.position;
    const auto& heading = query.place.heading_rad;
    const auto difference = [&](std::size_t match) {
      return match < matches.size() ? format_fixed(matches[match].column_difference, 3) : "";
    };
    const auto error = error_m(query);
    const auto dissimilarity = [&](std::size_t match) {
      return match < matches.size() ? std::to_string(matches[match].dissimilarity) : "";
    };
    rows.push_back({query.file, describe_answer(query),
                    query.error.empty() ? format_fixed(query.place.probability, 2) : "",
                    position ? format_position(*position, unit) : "",
                    heading ? format_degrees(*heading) : "", error ? format_fixed(*error, 2) : "",
                    difference(0), difference(1), dissimilarity(0), dissimilarity(1)});
  }
  page.add_text(
      "'Difference' and 'dissimilarity' (of the signatures) are given for the best match and for "
      "the next match.");
  page.add_table({"image", "answer", "probability", "position", "heading", "error [m]",
                  "difference", "to the next", "dissimilarity", "to the next"},
                 rows);
}

/// Returns the number of known places and the median error of answers with a true pose, as texts.
std::vector<std::pair<std::string, std::string>> summarise(
    const std::vector<LocalisedQuery>& queries, std::size_t readable) {
  std::vector<double> errors;
  std::size_t known = 0;
  for (const LocalisedQuery& query : queries) {
    known += query.place.known ? 1 : 0;
    if (const auto error = error_m(query)) errors.push_back(*error);
  }
  std::vector<std::pair<std::string, std::string>> summary{
      {std::to_string(known) + " of " + std::to_string(readable), "images show a known place"}};
  if (!errors.empty()) {
    summary.emplace_back(format_fixed(median(errors), 2) + " m", "median error of the position");
  }
  if (readable < queries.size()) {
    summary.emplace_back(std::to_string(queries.size() - readable), "could not be read");
  }
  return summary;
}

}  // namespace

void write_localise_report(const std::filesystem::path& folder, const MemoryFile& file,
                           const PlaceRecogniser& recogniser,
                           const std::vector<LocalisedQuery>& queries,
                           const std::function<Panorama(std::size_t)>& panorama) {
  std::vector<std::size_t> readable;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (queries[i].error.empty()) readable.push_back(i);
  }
  viewer::ReportPage page("Localised images",
                          "This page shows each image and the most similar view of " +
                              memory_name(file.path()) +
                              ", rotated to the same heading. If both show the same objects in the "
                              "same directions, the answer is correct.");
  page.add_figures(summarise(queries, readable.size()));
  page.add_text(
      "The difference compares the image with a view at the same heading, column by column; it is "
      "0 if both are equal. If the best match is much more similar than other views, the place is "
      "probably known. The other views are the tenth best match and mirrored views, which show "
      "places that do not exist. Only the better half of the columns is compared. A place with a "
      "probability below one half is reported as unknown.");
  const std::size_t shown = std::min(max_shown, readable.size());
  page.begin_section("Image by image");
  const bool has_map = !recordings::reference_positions(recogniser.memory()).empty();
  page.add_text(
      "The upper row is the image; the forward direction is in the middle. The lower row is the "
      "most similar view of the memory, rotated to the same heading.");
  page.add_text(has_map
                    ? "Grey dots on the map are the views of the memory. The large dot is the "
                      "answer; its ellipse contains the true position in 95 % of cases, across "
                      "a route it is as wide as the map. The ring is the position that the data "
                      "set gives."
                    : "The memory contains no positions, so this page has no map.");
  if (shown < readable.size()) {
    page.add_text("The page shows " + std::to_string(shown) + " of " +
                  format_count(readable.size(), "image") + " at equal intervals.");
  }
  viewer::RunPage run("", shown);
  run.set_unordered();
  bool thumbnails = true;
  for (std::size_t n = 0; n < shown; ++n) {
    const std::size_t i = readable[n * (readable.size() - 1) / std::max<std::size_t>(1, shown - 1)];
    recordings::RunMoment moment = make_moment(queries[i], n, panorama(i), file);
    thumbnails = thumbnails && (queries[i].place.matches.empty() || !moment.best_match.empty());
    if (n == 0) {
      moment.references = recordings::reference_positions(recogniser.memory());
      const LengthUnit unit = read_length_unit(file);
      if (unit != LengthUnit::metres) moment.length_unit = to_string(unit);
    }
    run.add(moment);
  }
  if (!thumbnails) page.add_text("For some images, the memory has no thumbnail of the best match.");
  if (shown > 0) page.add_run(run);
  add_table(page, queries, read_length_unit(file));
  page.write(folder, "index.html", "panonav localise");
}

}  // namespace panonav::command
