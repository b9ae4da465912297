#include "panonav_viewer/report_page.hpp"

#include <algorithm>
#include <numbers>
#include <type_traits>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_viewer/plot_json.hpp"

namespace panonav::viewer {

namespace {

std::string element(std::string_view name, std::string_view text) {
  std::string result = "<";
  result.append(name).append(">").append(escape_html(text));
  return result.append("</").append(name).append(">");
}

std::string make_table_head(const std::vector<std::string>& names) {
  std::string row = "<tr>";
  for (const auto& name : names) row += element("th", name);
  return row + "</tr>\n";
}

/// Returns a row whose cells also have the names of their columns, for narrow screens, on which
/// each cell has its own line. The lines of short cells are not broken.
std::string make_table_row(const std::vector<std::string>& names,
                           const std::vector<std::string>& texts) {
  constexpr std::size_t max_short_size = 24;
  std::string row = "<tr>";
  for (std::size_t i = 0; i < texts.size(); ++i) {
    row += "<td" + std::string(texts[i].size() <= max_short_size ? " class=\"short\"" : "") +
           " data-name=\"" + escape_html(names[i]) + "\">" + escape_html(texts[i]) + "</td>";
  }
  return row + "</tr>\n";
}

/// Removes the columns that are empty in all rows.
void remove_empty_columns(std::vector<std::string>& header,
                          std::vector<std::vector<std::string>>& rows) {
  for (std::size_t i = header.size(); i-- > 0;) {
    if (rows.empty() || std::ranges::any_of(rows, [i](const auto& row) { return !row[i].empty(); }))
      continue;
    const auto at = static_cast<std::ptrdiff_t>(i);
    header.erase(header.begin() + at);
    for (auto& row : rows) row.erase(row.begin() + at);
  }
}

std::string make_panel(std::string_view name, std::string_view title, const std::string& json,
                       std::string_view caption) {
  return "<figure>" + (title.empty() ? std::string() : element("h3", title)) + "<pn-" +
         std::string(name) + ">" + data_element(json) + "</pn-" + std::string(name) + ">" +
         (caption.empty() ? std::string() : element("figcaption", caption)) + "</figure>\n";
}

std::string make_command_block(const std::vector<std::string>& command_lines) {
  std::string html = "<pre>";
  for (const auto& line : command_lines) html += escape_html(line) + "\n";
  return html + "</pre>\n";
}

std::string make_plot_element(const ReportPlot& report_plot) {
  return std::visit(
      [&](const auto& plot) {
        using Plot = std::decay_t<decltype(plot)>;
        if constexpr (std::is_same_v<Plot, MapAnimation>) {
          return make_panel("plan", plot.title,
                            plot_to_json(plot.title, plot.frames, plot.backdrop),
                            report_plot.caption);
        } else if constexpr (std::is_same_v<Plot, MapPlot>) {
          return make_panel("plan", plot.title, plot_to_json(plot.title, {plot}),
                            report_plot.caption);
        } else if constexpr (std::is_same_v<Plot, HeatMap>) {
          return make_panel("plan", plot.title, plot_to_json(plot), report_plot.caption);
        } else {
          return make_panel("chart", plot.title, plot_to_json(plot), report_plot.caption);
        }
      },
      report_plot.plot);
}

/// Returns the picture in a file as a data URL: PNG, JPEG or SVG.
std::string embed_file(const std::filesystem::path& path) {
  constexpr std::size_t max_bytes = std::size_t{64} << 20U;
  const auto bytes = read_file(path, max_bytes);
  if (path.extension() == ".svg") return make_data_url("image/svg+xml", bytes);
  const bool png = image_format(bytes, path.string()) == ImageFormat::png;
  return make_data_url(png ? "image/png" : "image/jpeg", bytes);
}

std::string make_view_element(const ReportView& view) {
  const Image picture = to_picture(view.panorama);
  // Equal scales of both angles would show true shapes, but a view of few rows must still be
  // visible.
  const double shape =
      std::clamp(static_cast<double>(picture.width()) / picture.height(), 2.5, 10.0);
  std::string html =
      "<figure><div class=\"view\"><img style=\"aspect-ratio:" + format_fixed(shape, 2) +
      "\" alt=\"" + escape_html(view.caption) + "\" src=\"" +
      make_data_url("image/jpeg", encode_jpeg(picture.view())) + "\">";
  for (const ViewMark& mark : view.marks) {
    const double percent = 50.0 - mark.azimuth_rad * 50.0 / std::numbers::pi;
    html += "<i" + std::string(mark.is_dashed_line ? "" : " class=\"arrow\"") +
            " style=\"left:" + format_fixed(percent, 2) + "%;--key:var(--" +
            std::string(to_string(mark.colour)) + ")\"></i>";
  }
  return html + "</div>" + element("figcaption", view.caption) + "</figure>\n";
}

}  // namespace

ReportPage::ReportPage(std::string title, std::string lead)
    : title_(std::move(title)), lead_(std::move(lead)) {}

void ReportPage::begin_section(std::string_view title) {
  body_.emplace_back(element("h2", title) + "\n", "");
}

void ReportPage::begin_part(std::string_view title,
                            const std::pair<std::string, std::string>& value_and_meaning) {
  const std::string number = std::to_string(++parts_);
  const std::string numbered = number + ". " + std::string(title);
  overview_ += "<a href=\"#part" + number + "\">" + element("small", numbered) +
               element("b", value_and_meaning.first) + escape_html(value_and_meaning.second) +
               "</a>\n";
  body_.emplace_back("<h2 id=\"part" + number + "\">" + escape_html(numbered) + "</h2>\n", "");
}

void ReportPage::add_text(std::string_view paragraph) {
  body_.emplace_back(element("p", paragraph) + "\n", "");
}

void ReportPage::add_figures(
    const std::vector<std::pair<std::string, std::string>>& value_and_meaning) {
  std::string html = "<div class=\"figures\">\n";
  for (const auto& [value, meaning] : value_and_meaning) {
    html += "<div>" + element("b", value) + escape_html(meaning) + "</div>\n";
  }
  body_.emplace_back(html + "</div>\n", "");
}

void ReportPage::add_table(std::vector<std::string> header,
                           std::vector<std::vector<std::string>> rows) {
  for (const auto& row : rows) {
    require(row.size() == header.size(), "cells of a table row", static_cast<double>(row.size()),
            "as many as the header has");
  }
  remove_empty_columns(header, rows);
  std::string html =
      "<div class=\"wide\" tabindex=\"0\"><table class=\"rows\">\n" + make_table_head(header);
  for (const auto& row : rows) html += make_table_row(header, row);
  body_.emplace_back(html + "</table></div>\n", "");
}

void ReportPage::add_figure(const ReportPicture& picture) {
  if (!picture.file.empty()) {
    const bool plot = std::filesystem::path(picture.file).extension() == ".svg";
    body_.emplace_back("<figure><img" + std::string(plot ? " class=\"plot\"" : "") + " alt=\"" +
                           escape_html(picture.caption) + "\" src=\"",
                       picture.file);
    body_.emplace_back("\">", "");
  } else {
    body_.emplace_back("<figure>", "");
  }
  body_.emplace_back(element("figcaption", picture.caption) + "</figure>\n", "");
}

void ReportPage::add_pictures(const std::vector<ReportPicture>& pictures) {
  body_.emplace_back("<div class=\"pictures\">\n", "");
  for (const auto& picture : pictures) add_figure(picture);
  body_.emplace_back("</div>\n", "");
}

void ReportPage::add_thumbnails(const std::vector<ReportPicture>& pictures) {
  body_.emplace_back("<div class=\"pictures small\">\n", "");
  for (const auto& picture : pictures) add_figure(picture);
  body_.emplace_back("</div>\n", "");
}

void ReportPage::add_plots(const std::vector<ReportPlot>& plots) {
  std::string html = "<div class=\"pictures\">\n";
  for (const auto& plot : plots) html += make_plot_element(plot);
  body_.emplace_back(html + "</div>\n", "");
}

void ReportPage::add_views(const std::vector<ReportView>& views) {
  std::string html = "<div class=\"pictures above\">\n";
  for (const auto& view : views) html += make_view_element(view);
  body_.emplace_back(html + "</div>\n", "");
}

void ReportPage::add_run(const RunPage& run) {
  body_.emplace_back(run.element(), "");
}

void ReportPage::add_link(std::string_view file, std::string_view text) {
  body_.emplace_back(
      "<p class=\"link\"><a href=\"" + escape_html(file) + "\">" + escape_html(text) + "</a></p>\n",
      "");
}

void ReportPage::add_commands(const std::vector<std::string>& command_lines) {
  body_.emplace_back(make_command_block(command_lines), "");
}

void ReportPage::add_story(const std::vector<StoryCard>& cards, std::string_view commands_title,
                           const std::vector<std::string>& command_lines) {
  story_ = "<div class=\"story\">\n";
  for (const StoryCard& card : cards) {
    story_ += "<section><h2><a href=\"#part" + std::to_string(card.part) + "\">" +
              escape_html(card.title) + "</a></h2>";
    if (const auto* picture = std::get_if<ReportPicture>(&card.shown)) {
      story_ += "<figure><img alt=\"" + escape_html(picture->caption) + "\" src=\"" +
                escape_html(picture->file) + "\"></figure>\n";
    } else {
      story_ += make_plot_element(std::get<ReportPlot>(card.shown));
    }
    story_ +=
        "<p>" + element("b", card.value) + " " + escape_html(card.meaning) + "</p></section>\n";
  }
  story_ += "</div>\n<div class=\"begin\">" + element("h2", commands_title) +
            make_command_block(command_lines) + "</div>\n";
}

void ReportPage::write(const std::filesystem::path& folder, std::string_view file,
                       std::string_view generator) const {
  std::string body =
      "<main>\n" + element("h1", title_) + "\n<p class=\"lead\">" + escape_html(lead_) + "</p>\n";
  body += story_;
  if (!overview_.empty()) body += "<nav class=\"figures\">\n" + overview_ + "</nav>\n";
  for (const auto& [html, picture] : body_) {
    body += html;
    if (picture.empty()) continue;
    body += picture.starts_with("data:") ? escape_html(picture) : embed_file(folder / picture);
  }
  const std::string page = make_page(title_, generator, body + "</main>");
  write_file(folder / file, std::string_view(page));
}

}  // namespace panonav::viewer
