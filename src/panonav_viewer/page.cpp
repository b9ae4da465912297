#include "panonav_viewer/page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_viewer/plot_json.hpp"
#include "web.hpp"

namespace panonav::viewer {

namespace {

using Json = nlohmann::ordered_json;

/// Escapes the characters that must not occur in a data URL.
std::string encode_percent(std::string_view text) {
  std::string encoded;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = byte >= 0x20 && byte < 0x7F && c != '%' && c != '#' && c != '<';
    if (plain) {
      encoded += c;
    } else {
      encoded += '%';
      encoded += "0123456789ABCDEF"[byte >> 4U];
      encoded += "0123456789ABCDEF"[byte & 15U];
    }
  }
  return encoded;
}

/// Returns an import map that gives each module a data URL with its text, because browsers do not
/// load modules from files next to a page that is itself a file.
std::string import_map() {
  const std::array modules{
      std::pair{"store", web::store_js},       std::pair{"draw", web::draw_js},
      std::pair{"sight", web::sight_js},       std::pair{"map", web::map_js},
      std::pair{"pictures", web::pictures_js}, std::pair{"facts", web::facts_js},
      std::pair{"timeline", web::timeline_js}, std::pair{"plot", web::plot_js},
      std::pair{"plan", web::plan_js},         std::pair{"chart", web::chart_js},
      std::pair{"route", web::route_js},       std::pair{"card", web::card_js},
      std::pair{"main", web::main_js}};
  Json imports;
  for (const auto& [name, text] : modules) {
    imports["panonav/" + std::string(name)] =
        "data:text/javascript;charset=utf-8," + encode_percent(text);
  }
  return Json{{"imports", imports}}.dump();
}

}  // namespace

std::string make_page(std::string_view title, std::string_view generator, std::string body) {
  const std::string generator_element =
      generator.empty() ? std::string()
                        : "<meta name=\"generator\" content=\"" + escape_html(generator) + "\">\n";
  const bool has_run_elements = body.find("<pn-") != std::string::npos;
  const std::string imports = has_run_elements
                                  ? "<script type=\"importmap\">" + import_map() + "</script>\n"
                                  : std::string();
  constexpr std::string_view starting =
      "<script type=\"module\">import 'panonav/main';</script>\n<noscript><p>This page "
      "needs scripts to show runs and plots. Scripts are switched off in this "
      "browser.</p></noscript>\n";
  const std::string_view scripts = has_run_elements ? starting : std::string_view();
  const std::array filled{std::pair{std::string_view("{{title}}"), escape_html(title)},
                          std::pair{std::string_view("{{generator}}"), generator_element},
                          std::pair{std::string_view("{{style}}"), std::string(web::viewer_css)},
                          std::pair{std::string_view("{{imports}}"), imports},
                          std::pair{std::string_view("{{scripts}}"), std::string(scripts)},
                          std::pair{std::string_view("{{body}}"), std::move(body)}};
  std::string html;
  for (std::string_view left = web::index_html; !left.empty();) {
    const std::size_t at = left.find("{{");
    html += left.substr(0, at);
    if (at == std::string_view::npos) break;
    left.remove_prefix(at);
    const auto found = std::ranges::find_if(
        filled, [left](const auto& entry) { return left.starts_with(entry.first); });
    html += found != filled.end() ? std::string_view(found->second) : left.substr(0, 2);
    left.remove_prefix(found != filled.end() ? found->first.size() : 2);
  }
  return html;
}

std::string escape_html(std::string_view text) {
  std::string html;
  for (const char c : to_readable_line(text)) {
    switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        html += c;
    }
  }
  return html;
}

std::string data_element(std::string_view json) {
  std::string safe = "<script type=\"application/json\">";
  safe.reserve(json.size() + 64);
  for (const char c : json) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe + "</script>";
}

std::string live_page(std::string_view title, bool replay, std::string_view accepted_input) {
  return make_page(
      title, {},
      "<pn-run class=\"whole\" data-title=\"" + escape_html(title) + "\">" +
          data_element(
              Json{{"live", "events"}, {"replay", replay}, {"takes", accepted_input}}.dump()) +
          "</pn-run>");
}

std::string entrance_page() {
  return make_page(
      "panonav", {},
      "<main>\n<h1>This address is not complete</h1>\n<p>A run of panonav is shown here, but the "
      "address of its page is longer, so that only those who know it can see the run.</p>\n"
      "<p>panonav printed the complete address when the run started, in a line that begins with "
      "<b>Open http://</b>. Open this address, or copy all of it, up to the last slash.</p>\n"
      "<p>Each run has a new address. An address of an earlier run does not work any more.</p>\n"
      "</main>");
}

RunPage::RunPage(std::string title, std::size_t moments)
    : title_(std::move(title)), every_(std::max<std::size_t>(1, (moments + 299) / 300)) {}

void RunPage::add(const recordings::RunMoment& moment) {
  const std::size_t number = moments_.size();
  moments_.push_back(moment_to_json(moment, number));
  pictures_.emplace_back();
  retained_.update_from(moment);
  // Store changes of retained parts with the moment at which they occur.
  recordings::RunMoment changed;
  changed.plan = moment.plan;
  changed.directions = moment.directions;
  changed.goal = moment.goal;
  if (const std::string changes = retained_to_json(changed); !changes.empty()) {
    moments_.back().back() = ',';
    moments_.back() += "\"changes\":" + changes + "}";
  }
  if (number % every_ != 0) return;
  if (number / every_ >= 600) {  // more moments came than were expected
    every_ *= 2;
    for (std::size_t i = 0; i < number; ++i) {
      if (i % every_ != 0) pictures_[i].clear();
    }
    if (number % every_ != 0) return;
  }
  Json pictures = Json::object();
  if (moment.panorama) {
    const Image image = to_picture(*moment.panorama);
    pictures["panorama"] = make_data_url("image/jpeg", encode_jpeg(image.view()));
  }
  if (!moment.best_match.empty()) {
    const Image best = decode_image(moment.best_match, "best match", {.side_px = 4096});
    pictures["best"] = make_data_url("image/jpeg", encode_jpeg(best.view()));
  }
  pictures_.back() = pictures.dump();
}

void RunPage::set_route(const PicturePlot& panorama, const std::vector<RouteMark>& marks) {
  Json all = Json::array();
  for (const RouteMark& mark : marks) {
    Json changed = Json::array();
    for (const auto& [from, to] : mark.changed_deg) {
      changed.push_back(std::round(10.0 * from) / 10.0);
      changed.push_back(std::round(10.0 * to) / 10.0);
    }
    all.push_back({mark.along_m ? Json(*mark.along_m) : Json(),
                   mark.true_along_m ? Json(*mark.true_along_m) : Json(), std::move(changed)});
  }
  route_ = plot_to_json(panorama);
  route_.back() = ',';
  route_ += "\"marks\":" + all.dump() + "}";
}

std::string RunPage::json() const {
  const std::string retained = retained_to_json(retained_.moment);
  std::string all = "{\"moments\":[";
  for (std::size_t i = 0; i < moments_.size(); ++i) {
    if (i > 0) all += ",\n";
    all += moments_[i];
    if (pictures_[i].empty()) continue;
    all.back() = ',';
    all += "\"data\":" + pictures_[i] + "}";
  }
  return all + "],\"retained\":" + (retained.empty() ? "{}" : retained) +
         (unordered_ ? ",\"unordered\":true" : "") +
         (route_.empty() ? "" : ",\"route\":" + route_) + "}";
}

std::string RunPage::element() const {
  return "<pn-run>" + data_element(json()) + "</pn-run>\n";
}

std::string RunPage::html() const {
  return make_page(title_, {},
                   "<pn-run class=\"whole\" data-title=\"" + escape_html(title_) + "\">" +
                       data_element(json()) + "</pn-run>");
}

}  // namespace panonav::viewer
