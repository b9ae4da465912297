#include "runs/localised_query.hpp"

#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav_server/place_json.hpp"

namespace panonav::command {

ordered_json to_json(const LocalisedQuery& answer, bool areas) {
  if (!answer.error.empty()) return {{"file", answer.file}, {"error", answer.error}};
  const Place& found = answer.place;
  ordered_json json{{"file", answer.file}};
  json.update(server::place_json(found));
  json["turned_rad"] = answer.turned_rad;
  if (areas) {
    auto levels = ordered_json::array();
    for (const auto& level : found.areas) {
      levels.push_back(
          {{"components", level.components},
           {"candidates", level.candidates.size()},
           {"area_m2", to_json_or_null(level.area_m2)},
           {"radius_m", level.region ? ordered_json(level.region->radius_m) : ordered_json()},
           {"bytes_read", level.bytes_read}});
    }
    json["areas"] = std::move(levels);
  }
  return json;
}

std::string csv_row(const LocalisedQuery& answer) {
  const Place& place = answer.place;
  const auto& position = place.position;
  std::string row = to_sheet_field(answer.file);
  const auto add = [&row](const std::string& field) {
    row += ',';
    row += field;
  };
  const auto add_degrees = [&](const std::optional<double>& angle_rad) {
    add(angle_rad ? to_text(to_exact_degrees(*angle_rad)) : "");
  };
  add(!answer.error.empty() ? "unreadable" : place.known ? "known" : "unknown");
  add(answer.error.empty() ? format_fixed(place.known_probability, 4) : "");
  add(position ? to_text(position->x_m) : "");
  add(position ? to_text(position->y_m) : "");
  add(position && position->radius_m ? to_text(*position->radius_m) : "");
  add_degrees(place.heading_rad);
  for (std::size_t i = 0; i < 2; ++i) {
    const PlaceMatch* const match = i < place.matches.size() ? &place.matches[i] : nullptr;
    add(match ? to_sheet_field(match->name) : "");
    add(match ? std::to_string(match->dissimilarity) : "");
    add(match ? to_text(match->column_difference) : "");
    if (i == 0) add_degrees(match ? match->heading_rad : std::nullopt);
  }
  add(answer.error.empty() ? "" : to_sheet_field(to_readable_line(answer.error)));
  return row + '\n';
}

std::string format_line(const LocalisedQuery& answer, Session& session) {
  const Place& found = answer.place;
  std::string line = answer.file + "  ";
  if (found.matches.empty()) return line + session.red("nothing to compare with");
  const PlaceMatch& nearest = found.matches.front();
  if (!found.known) {
    return line + session.red("unknown place") + "  (probability " +
           format_fixed(found.known_probability, 2) + "; most similar: " + nearest.name + ")";
  }
  line += session.green("near " + nearest.name) + "  probability " +
          format_fixed(found.known_probability, 2);
  if (found.position) {
    line += "  x " + format_fixed(found.position->x_m, 2) + " m  y " +
            format_fixed(found.position->y_m, 2) + " m";
    if (found.position->radius_m)
      line += "  within " + format_fixed(*found.position->radius_m, 2) + " m";
  }
  if (found.heading_rad) {
    line += "  heading " + format_fixed(degrees(*found.heading_rad), 1) + " degrees";
  } else if (nearest.heading_rad) {
    line += "  rotated by " + format_fixed(degrees(*nearest.heading_rad), 1) +
            " degrees relative to this view";
  }
  for (const auto& level : found.areas) {
    line += "\n    " + std::to_string(level.components) +
            (level.components == 1 ? " component: " : " components: ") +
            std::to_string(level.candidates.size()) +
            (level.candidates.size() == 1 ? " view" : " views");
    if (level.area_m2) line += ", " + format_fixed(*level.area_m2, 2) + " m2";
    if (level.region) line += ", within " + format_fixed(level.region->radius_m, 2) + " m";
  }
  return line;
}

}  // namespace panonav::command
