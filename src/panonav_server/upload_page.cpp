#include "panonav_server/upload_page.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "web.hpp"

namespace panonav::server {

namespace {

using nlohmann::json;

std::string escape_html(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

/// Encodes all bytes but letters and digits for a path.
std::string encode_percent(std::string_view text) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string encoded;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (is_plain) {
      encoded += c;
    } else {
      encoded.append("%").append(1, digits[byte >> 4U]).append(1, digits[byte & 15U]);
    }
  }
  return encoded;
}

/// Returns the value of a parameter of a header: `name="value"` or name=value.
std::string_view find_parameter(std::string_view header, std::string_view name) {
  const std::string key = "; " + std::string(name) + "=";
  const std::size_t at = header.find(key);
  if (at == header.npos) return {};
  std::string_view value = header.substr(at + key.size());
  if (value.starts_with('"')) {
    value.remove_prefix(1);
    return value.substr(0, value.find('"'));
  }
  return value.substr(0, value.find_first_of("; \r\n"));
}

std::string format_row(std::string_view term, const std::string& text) {
  return "<dt>" + std::string(term) + "</dt><dd>" + escape_html(text) + "</dd>";
}

/// Formats the rotation of the camera relative to a view.
std::string format_turn(double heading_rad) {
  const double turn_deg = degrees(heading_rad);
  if (std::abs(turn_deg) < 0.5) return "not, relative to this view";
  return format_fixed(std::abs(turn_deg), 0) + " degrees to the " +
         (turn_deg > 0.0 ? "left" : "right") + " relative to this view";
}

std::string format_pose(const json& place) {
  std::string rows;
  if (const json& position = place["position"]; position.is_object()) {
    std::string text = "x " + format_fixed(position["x_m"].get<double>(), 2) + " m, y " +
                       format_fixed(position["y_m"].get<double>(), 2) + " m";
    if (position["radius_m"].is_number()) {
      constexpr double smallest_shown_m = 0.01;  // a bound of 0.00 m would not be true
      text += ", with 95 % probability within " +
              format_fixed(std::max(position["radius_m"].get<double>(), smallest_shown_m), 2) +
              " m";
    }
    rows += format_row("Position", text);
  } else {
    rows += format_row("Position", "not known: the memory has no positions of these views");
  }
  if (place["heading_rad"].is_number()) {
    rows += format_row("Heading", format_fixed(degrees(place["heading_rad"].get<double>()), 0) +
                                      " degrees, counter-clockwise from the x axis of the map");
  }
  return rows;
}

std::string format_other_views(const json& matches) {
  constexpr std::size_t max_listed = 5;
  std::string names;
  for (std::size_t i = 1; i < std::min(matches.size(), max_listed); ++i) {
    names += (i > 1 ? ", " : "") + matches[i]["file"].get<std::string>();
  }
  return names.empty() ? "" : "<p>Next similar views: " + escape_html(names) + "</p>";
}

std::string format_place(const json& place) {
  const bool known = place["known"].get<bool>();
  const json& matches = place["matches"];
  std::string text =
      std::string("<section class=\"") + (known ? "known" : "unknown") + "\"><h2>" +
      (known ? "Known place" : "Unknown place") + "</h2><dl>" +
      format_row("Probability",
                 format_fixed(100.0 * place["known_probability"].get<double>(), 0) + " %");
  if (known) text += format_pose(place);
  if (matches.empty()) return text + "</dl></section>\n";
  const std::string best = matches[0]["file"].get<std::string>();
  if (known && matches[0]["heading_rad"].is_number()) {
    text += format_row("Camera turned", format_turn(matches[0]["heading_rad"].get<double>()));
  }
  text +=
      "</dl><figure><img src=\"/v1/memories/" + encode_percent(place["memory"].get<std::string>()) +
      "/views/" + encode_percent(best) +
      "/picture\" alt=\"No thumbnail of this view is stored.\"><figcaption>Most similar view: " +
      escape_html(best) + (known ? "" : ", probably another place") + "</figcaption></figure>";
  return text + format_other_views(matches) + "</section>\n";
}

/// Formats the JSON of an answer or error as a part of the page.
std::string format_answer(std::string_view answer) {
  const json document = json::parse(answer, nullptr, false);
  if (document.is_object() && document.contains("known")) return format_place(document);
  std::string why(answer);
  if (document.is_object() && document.contains("error")) {
    why = document["error"].get<std::string>();
  }
  return "<section class=\"error\" role=\"alert\"><h2>No answer</h2><p>" + escape_html(why) +
         "</p></section>\n";
}

std::string format_memories(std::span<const PageMemory> memories, std::string_view selected) {
  const auto label = [](const PageMemory& memory) {
    return escape_html(memory.name) + ", " + format_count(memory.views, "view");
  };
  if (memories.size() == 1) {
    return "<p>Memory: " + label(memories[0]) +
           "</p><input type=\"hidden\" name=\"memory\" value=\"" + escape_html(memories[0].name) +
           "\">\n";
  }
  std::string text = "<label for=\"memory\">Memory</label>\n<select id=\"memory\" name=\"memory\">";
  for (const PageMemory& memory : memories) {
    text += "<option value=\"" + escape_html(memory.name) + "\"" +
            (memory.name == selected ? " selected" : "") + ">" + label(memory) + "</option>";
  }
  return text + "</select>\n";
}

}  // namespace

std::optional<UploadForm> read_upload_form(std::string_view content_type, std::string_view body) {
  constexpr std::size_t max_boundary_bytes = 70;  // RFC 2046
  const std::string_view boundary = find_parameter(content_type, "boundary");
  if (!content_type.starts_with("multipart/form-data") || boundary.empty() ||
      boundary.size() > max_boundary_bytes) {
    return std::nullopt;
  }
  const std::string delimiter = "\r\n--" + std::string(boundary);
  if (!body.starts_with(std::string_view(delimiter).substr(2))) return std::nullopt;
  body.remove_prefix(delimiter.size() - 2);
  UploadForm form;
  while (body.starts_with("\r\n")) {
    const std::size_t head_end = body.find("\r\n\r\n");
    if (head_end == body.npos) return std::nullopt;
    const std::string_view head = body.substr(0, head_end);
    body.remove_prefix(head_end + 4);
    const std::size_t end = body.find(delimiter);
    if (end == body.npos) return std::nullopt;
    const std::string_view content = body.substr(0, end);
    body.remove_prefix(end + delimiter.size());
    const std::string_view name = find_parameter(head, "name");
    if (name == "memory") form.memory = content;
    if (name == "image" && form.picture.empty()) form.picture = content;
  }
  return body.starts_with("--") ? std::optional(std::move(form)) : std::nullopt;
}

std::string make_upload_page(std::span<const PageMemory> memories, std::string_view selected,
                             std::string_view answer) {
  std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>panonav: where is this image from?</title>\n"
      "<link rel=\"stylesheet\" href=\"/page.css\"></head>\n<body><main>\n"
      "<h1>Where is this image from?</h1>\n";
  if (!answer.empty()) page += format_answer(answer);
  page += "<form method=\"post\" action=\"/\" enctype=\"multipart/form-data\">\n";
  page += format_memories(memories, selected);
  page +=
      "<label for=\"file\">Choose an image or drop it here\n"
      "<small>PNG or JPEG of at most 16 MB, of the same kind as the images of the memory</small>"
      "</label>\n"
      "<input id=\"file\" type=\"file\" name=\"image\" accept=\"image/png,image/jpeg,image/*\">\n"
      "<label for=\"photo\">Or take a photo <small>with a phone or tablet</small></label>\n"
      "<input id=\"photo\" class=\"photo\" type=\"file\" name=\"image\" accept=\"image/*\" "
      "capture=\"environment\">\n"
      "<button type=\"submit\">Find the place</button>\n</form>\n"
      "<p><small>Programs send the image with POST to /v1/memories/NAME/localise and get JSON; "
      "<a href=\"/v1/memories\">/v1/memories</a> lists the memories.</small></p>\n"
      "</main></body></html>\n";
  return page;
}

std::string_view upload_page_style() {
  return web::page_css;
}

bool accepts_html(const HttpRequest& request) {
  return request.accept.find("text/html") != request.accept.npos;
}

}  // namespace panonav::server
