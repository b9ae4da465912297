#include "runs/localised_query.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/number_text.hpp"
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

std::string make_csv_header(LengthUnit unit) {
  const std::string lengths = unit == LengthUnit::metres
                                  ? "x_m,y_m,radius_m,along_route_m"
                                  : "x_steps,y_steps,radius_steps,along_route_steps";
  return "file,answer,known_probability," + lengths +
         ",heading_deg,best,dissimilarity,column_difference,turn_deg,next,next_dissimilarity,"
         "next_column_difference,probability,alternative,alternative_probability,error\n";
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
  add(position && position->along_route ? to_text(position->along_route->within_m) : "");
  add_degrees(place.heading_rad);
  for (std::size_t i = 0; i < 2; ++i) {
    const PlaceMatch* const match = i < place.matches.size() ? &place.matches[i] : nullptr;
    add(match ? to_sheet_field(match->name) : "");
    const bool has_rows = match && !std::isnan(match->column_difference);  // not a narrow image
    add(has_rows ? std::to_string(match->dissimilarity) : "");
    add(has_rows ? to_text(match->column_difference) : "");
    if (i == 0) add_degrees(match ? match->heading_rad : std::nullopt);
  }
  const AlternativePlace* const other =
      place.alternatives.empty() ? nullptr : &place.alternatives.front();
  add(answer.error.empty() ? format_fixed(place.probability, 4) : "");
  add(other ? to_sheet_field(other->match.name) : "");
  add(other ? format_fixed(other->probability, 4) : "");
  add(answer.error.empty() ? "" : to_sheet_field(to_readable_line(answer.error)));
  return row + '\n';
}

namespace {

std::string format_length(double length, LengthUnit unit) {
  return format_fixed(length, 2) + " " + to_string(unit);
}

/// Returns "within 0.03 m"; at least 0.01, because a bound of 0.00 m would not be true.
std::string format_within(double bound, LengthUnit unit) {
  constexpr double smallest_shown = 0.01;
  return "within " + format_length(std::max(bound, smallest_shown), unit);
}

std::string format_position(const PositionEstimate& position, LengthUnit unit) {
  std::string text =
      "x " + format_length(position.x_m, unit) + "  y " + format_length(position.y_m, unit);
  if (const std::string bound = format_bound(position, unit); !bound.empty()) text += "  " + bound;
  return text;
}

std::string format_alternative(const AlternativePlace& other, LengthUnit unit) {
  std::string text =
      "\n    or near " + other.match.name + "  probability " + format_fixed(other.probability, 2);
  if (!other.floor().empty()) text += "  floor " + std::string(other.floor());
  if (other.position) text += "  " + format_position(*other.position, unit);
  if (other.heading_rad) {
    text += "  heading " + format_fixed(degrees(*other.heading_rad), 1) + " degrees";
  }
  return text;
}

}  // namespace

std::string format_bound(const PositionEstimate& position, LengthUnit unit) {
  std::string text;
  if (position.radius_m) text = format_within(*position.radius_m, unit);
  if (!position.along_route) return text;
  const std::string along =
      format_within(position.along_route->within_m, unit) + " along the route";
  return text.empty() ? along : text + " (" + along + ")";
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
  line +=
      session.green("near " + nearest.name) + "  probability " + format_fixed(found.probability, 2);
  if (!found.floor().empty()) line += "  floor " + std::string(found.floor());
  if (found.position) line += "  " + format_position(*found.position, session.length_unit());
  if (found.heading_rad) {
    line += "  heading " + format_fixed(degrees(*found.heading_rad), 1) + " degrees";
  } else if (nearest.heading_rad) {
    line += "  rotated by " + format_fixed(degrees(*nearest.heading_rad), 1) +
            " degrees relative to this view";
  }
  for (const AlternativePlace& other : found.alternatives) {
    line += format_alternative(other, session.length_unit());
  }
  for (const auto& level : found.areas) {
    line += "\n    " + format_count(level.components, "component") + ": " +
            format_count(level.candidates.size(), "view");
    if (level.area_m2) {
      line += ", " + format_fixed(*level.area_m2, 2) +
              (session.length_unit() == LengthUnit::metres ? " m2" : " square view steps");
    }
    if (level.region) line += ", " + format_within(level.region->radius_m, session.length_unit());
  }
  return line;
}

}  // namespace panonav::command
