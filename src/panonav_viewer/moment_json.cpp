#include "panonav_viewer/moment_json.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace panonav::viewer {

namespace {

using Json = nlohmann::ordered_json;

/// Rounds to 4 decimals, because more digits are not visible; null for NaN, which JSON does not
/// have.
Json rounded_number(double value) {
  if (!std::isfinite(value)) return nullptr;
  return std::round(value * 1e4) / 1e4;
}

Json rounded_numbers(const Pose2& pose) {
  return {rounded_number(pose.x_m), rounded_number(pose.y_m), rounded_number(pose.heading_rad)};
}

Json rounded_numbers(const std::vector<Pose2>& poses) {
  Json all = Json::array();
  for (const Pose2& pose : poses) {
    all.push_back(rounded_number(pose.x_m));
    all.push_back(rounded_number(pose.y_m));
    all.push_back(rounded_number(pose.heading_rad));
  }
  return all;
}

Json rounded_numbers(const std::vector<Point2>& points) {
  Json all = Json::array();
  for (const Point2& point : points) {
    all.push_back(rounded_number(point.x_m));
    all.push_back(rounded_number(point.y_m));
  }
  return all;
}

/// Appends the elements xx, xy and yy of the covariance, which are drawn; not rounded, because they
/// may be small.
void add_covariance(Json& to, const std::array<double, 9>& covariance) {
  for (const std::size_t i : {0U, 1U, 4U}) to.push_back(covariance[i]);
}

/// Returns JSON as text; invalid UTF-8 is replaced, because names of files may contain any bytes.
std::string to_text_with_valid_utf8(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string moment_to_json(const recordings::RunMoment& moment, std::size_t number) {
  Json json{{"n", number}, {"t", moment.stamp_s}};
  Json pictures = Json::array();
  if (moment.picture || !moment.encoded_picture.empty()) pictures.push_back("camera");
  if (moment.panorama) pictures.push_back("panorama");
  if (!moment.best_match.empty()) pictures.push_back("best");
  if (!pictures.empty()) json["pictures"] = std::move(pictures);
  if (moment.pose) json["pose"] = rounded_numbers(*moment.pose);
  if (moment.covariance) add_covariance(json["covariance"] = Json::array(), *moment.covariance);
  for (const PoseMode& mode : moment.modes) {
    Json& entry = json["modes"].emplace_back(Json::array({rounded_number(mode.weight)}));
    for (Json& value : rounded_numbers(mode.mean)) entry.push_back(std::move(value));
    add_covariance(entry, mode.covariance);
  }
  if (!moment.comparisons.empty()) {
    Json& entry = json["compared"] = Json::array();
    for (const recordings::RunComparison& one : moment.comparisons) {
      entry.push_back(one.reference);
      entry.push_back(one.dissimilarity);
    }
  }
  if (moment.homing) {
    json["homing"] = {rounded_number(moment.homing->direction_rad),
                      rounded_number(moment.homing->probability)};
  }
  for (const auto& [stage, ms] : moment.stages_ms) json["stages"][stage] = rounded_number(ms);
  if (!moment.particles.empty()) json["particles"] = rounded_numbers(moment.particles);
  if (moment.odometry) json["odometry"] = rounded_numbers(*moment.odometry);
  if (moment.tilt) {
    json["tilt"] = {rounded_number(moment.tilt->roll_rad), rounded_number(moment.tilt->pitch_rad)};
  }
  if (moment.truth) {
    json["truth"] = {
        rounded_number(moment.truth->x_m), rounded_number(moment.truth->y_m),
        moment.truth->heading_rad ? rounded_number(*moment.truth->heading_rad) : Json()};
  }
  if (moment.best_match_turn_rad) json["turn"] = rounded_number(*moment.best_match_turn_rad);
  if (!moment.state.empty()) {
    json["state"] = moment.state;
    json["sure"] = moment.sure;
    if (moment.probability) json["probability"] = rounded_number(*moment.probability);
  }
  if (!moment.values.empty()) {
    Json& values = json["values"] = Json::object();
    for (const auto& [name, value] : moment.values) {  // several events may have the same name
      Json& entry = values[name];
      entry = entry.is_null() ? value : entry.get<std::string>() + ", " + value;
    }
  }
  return to_text_with_valid_utf8(json);
}

std::string retained_to_json(const recordings::RunMoment& moment) {
  Json json;
  if (!moment.references.empty()) {
    json["references"] = rounded_numbers(moment.references);
    for (const recordings::RunReference& view : moment.reference_views) {
      json["names"].push_back(view.name);
      json["headings"].push_back(view.heading_rad ? rounded_number(*view.heading_rad) : Json());
    }
  }
  for (const recordings::RunRegion& region : moment.regions) {
    Json& entry = json["regions"].emplace_back(Json::array({region.area}));
    for (Json& value : rounded_numbers(region.outline)) entry.push_back(std::move(value));
  }
  for (const auto& wall : moment.walls) json["walls"].push_back(rounded_numbers(wall));
  if (!moment.edges.empty()) {
    Json& all = json["edges"] = Json::array();
    for (const recordings::RunEdge& edge : moment.edges) {
      for (const double value : {edge.from.x_m, edge.from.y_m, edge.to.x_m, edge.to.y_m}) {
        all.push_back(rounded_number(value));
      }
      all.push_back(static_cast<int>(edge.kind));
    }
  }
  if (!moment.plan.empty()) json["plan"] = rounded_numbers(moment.plan);
  if (!moment.directions.empty()) json["directions"] = rounded_numbers(moment.directions);
  if (!moment.length_unit.empty()) json["unit"] = moment.length_unit;
  if (moment.goal) json["goal"] = rounded_numbers(*moment.goal);
  return json.is_null() ? std::string() : to_text_with_valid_utf8(json);
}

void RetainedParts::update_from(const recordings::RunMoment& from) {
  const auto replace = [this](auto& kept, const auto& update) {
    if (update.empty()) return;
    kept = update;
    ++replacement_count;
  };
  if (!from.references.empty()) moment.reference_views = from.reference_views;
  replace(moment.length_unit, from.length_unit);
  replace(moment.references, from.references);
  replace(moment.regions, from.regions);
  replace(moment.walls, from.walls);
  replace(moment.edges, from.edges);
  replace(moment.plan, from.plan);
  replace(moment.directions, from.directions);
  if (from.goal) {
    moment.goal = from.goal;
    ++replacement_count;
  }
}

std::string moments_to_json(const std::vector<PastMoment>& past) {
  Json all = Json::array();
  for (const PastMoment& moment : past) {
    Json entry{moment.stamp_s};
    if (moment.pose) {
      for (Json& value : rounded_numbers(*moment.pose)) entry.push_back(std::move(value));
    } else {
      for (int i = 0; i < 3; ++i) entry.push_back(nullptr);
    }
    entry.push_back(moment.probability ? rounded_number(*moment.probability) : Json());
    entry.push_back(moment.sure);
    entry.push_back(moment.state);
    entry.push_back(moment.truth ? rounded_number(moment.truth->x_m) : Json());
    entry.push_back(moment.truth ? rounded_number(moment.truth->y_m) : Json());
    all.push_back(std::move(entry));
  }
  return to_text_with_valid_utf8(all);
}

}  // namespace panonav::viewer
