#include "reports/track_animation.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "assets.hpp"
#include "panonav/io/atomic_file.hpp"
#include "reporting/plot.hpp"

namespace panonav::command {

namespace {

using nlohmann::ordered_json;

// To the millimetre: the page is drawn, not computed with.
double rounded(double value) {
  constexpr double steps = 1000.0;
  return std::round(value * steps) / steps;
}

ordered_json pose_json(const Pose2& pose) {
  return {rounded(pose.x_m), rounded(pose.y_m), rounded(pose.heading_rad)};
}

ordered_json image_json(const TrackedImage& image) {
  const MonteCarloEstimate& estimate = image.estimate;
  auto particles = ordered_json::array();
  for (const Pose2& point : image.particles) {
    particles.push_back(rounded(point.x_m));
    particles.push_back(rounded(point.y_m));
  }
  ordered_json truth;
  if (image.truth) {
    truth = {rounded(image.truth->x_m), rounded(image.truth->y_m)};
    if (image.truth->heading_rad) truth.push_back(rounded(*image.truth->heading_rad));
  }
  const auto error = position_error_m(image);
  return {{"file", image.file},
          {"state", name_of(estimate.state)},
          {"pose", estimate.pose ? pose_json(*estimate.pose) : ordered_json()},
          {"ground_truth", std::move(truth)},
          {"error", error ? ordered_json(rounded(*error)) : ordered_json()},
          {"modes", estimate.modes.size()},
          {"count", estimate.particles},
          {"injected", estimate.injected},
          {"particles", std::move(particles)}};
}

/// Text that may stand within a script element.
std::string script_text(const ordered_json& json) {
  const std::string text = json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

/// Everywhere where the template names it.
void fill(std::string& page, std::string_view place, std::string_view text) {
  for (std::size_t at = 0; (at = page.find(place, at)) != std::string::npos; at += text.size()) {
    page.replace(at, place.size(), text);
  }
}

}  // namespace

void write_track_animation(const std::filesystem::path& path, const VisualMemory& memory,
                           double spacing_m, const std::vector<TrackedImage>& images) {
  auto references = ordered_json::array();
  for (const ViewId view : memory.views()) {
    if (const auto& pose = memory.info(view).pose) {
      references.push_back({rounded(pose->x_m), rounded(pose->y_m)});
    }
  }
  auto played = ordered_json::array();
  for (const TrackedImage& image : images) played.push_back(image_json(image));
  const ordered_json run{{"spacing", rounded(spacing_m)},
                         {"references", std::move(references)},
                         {"images", std::move(played)}};
  std::string page(assets::track_player_html);
  fill(page, "{{style}}", assets::track_player_css);
  fill(page, "{{script}}", assets::track_player_js);
  for (const auto& [name, colour] :
       {std::pair{"{{black}}", PlotColour::black}, std::pair{"{{blue}}", PlotColour::blue},
        std::pair{"{{grey}}", PlotColour::grey}, std::pair{"{{orange}}", PlotColour::orange},
        std::pair{"{{sky}}", PlotColour::sky}, std::pair{"{{vermilion}}", PlotColour::vermilion}}) {
    fill(page, name, hex(colour));
  }
  page.replace(page.find("{{run}}"), 7, script_text(run));  // last: names in it may be anything
  write_file(path, std::string_view(page));
}

}  // namespace panonav::command
