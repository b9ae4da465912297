#include "reports/report_page.hpp"

#include <utility>

#include "assets.hpp"
#include "cli/session.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav::command {

namespace {

// Text as HTML shows it, in elements and between the quotes of attributes.
std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : readable_line(text)) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      case '\'':
        result += "&#39;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string element(std::string_view name, std::string_view text) {
  std::string result = "<";
  result.append(name).append(">").append(escaped(text));
  return result.append("</").append(name).append(">");
}

std::string table_row(std::string_view cell, const std::vector<std::string>& texts) {
  std::string row = "<tr>";
  for (const auto& text : texts) row += element(cell, text);
  return row + "</tr>\n";
}

}  // namespace

void prepare_report_folder(const std::filesystem::path& folder, std::string_view own_file,
                           std::string_view verb) {
  namespace fs = std::filesystem;
  std::error_code error;
  const bool there = fs::exists(folder, error);
  const bool ours = fs::exists(folder / own_file, error);
  if (there && (!fs::is_directory(folder, error) || (!ours && !fs::is_empty(folder, error)))) {
    throw FileError(folder.string(), "is there already and was not made by panonav " +
                                         std::string(verb) +
                                         "; allowed: a new folder, or that of an earlier one");
  }
  fs::create_directories(folder, error);
  if (error) throw FileError(folder.string(), "cannot be made: " + error.message());
}

ReportPage::ReportPage(std::string title, std::string lead)
    : title_(std::move(title)), lead_(std::move(lead)) {}

void ReportPage::section(std::string_view title) {
  body_ += element("h2", title) + "\n";
}

void ReportPage::part(std::string_view title,
                      const std::pair<std::string, std::string>& value_and_meaning) {
  const std::string number = std::to_string(++parts_);
  const std::string numbered = number + ". " + std::string(title);
  overview_ += "<a href=\"#part" + number + "\">" + element("small", numbered) +
               element("b", value_and_meaning.first) + escaped(value_and_meaning.second) + "</a>\n";
  body_ += "<h2 id=\"part" + number + "\">" + escaped(numbered) + "</h2>\n";
}

void ReportPage::text(std::string_view paragraph) {
  body_ += element("p", paragraph) + "\n";
}

void ReportPage::figures(
    const std::vector<std::pair<std::string, std::string>>& value_and_meaning) {
  body_ += "<div class=\"figures\">\n";
  for (const auto& [value, meaning] : value_and_meaning) {
    body_ += "<div>" + element("b", value) + escaped(meaning) + "</div>\n";
  }
  body_ += "</div>\n";
}

void ReportPage::table(const std::vector<std::string>& header,
                       const std::vector<std::vector<std::string>>& rows) {
  body_ += "<table>\n" + table_row("th", header);
  for (const auto& row : rows) {
    require(row.size() == header.size(), "cells of a table row", static_cast<double>(row.size()),
            "as many as the header has");
    body_ += table_row("td", row);
  }
  body_ += "</table>\n";
}

void ReportPage::pictures(const std::vector<ReportPicture>& pictures) {
  body_ += "<div class=\"pictures\">\n";
  for (const auto& picture : pictures) {
    const std::string file = escaped(picture.file);
    body_ += "<figure><a href=\"" + file + "\"><img src=\"" + file + "\" alt=\"" +
             escaped(picture.caption) + "\"></a>" + element("figcaption", picture.caption) +
             "</figure>\n";
  }
  body_ += "</div>\n";
}

void ReportPage::thumbnails(const std::vector<ReportPicture>& pictures) {
  body_ += "<div class=\"pictures small\">\n";
  for (const auto& [file, caption] : pictures) {
    const std::string image =
        file.empty() ? "" : "<img src=\"" + escaped(file) + "\" alt=\"" + escaped(caption) + "\">";
    body_ += "<figure>" + image + element("figcaption", caption) + "</figure>\n";
  }
  body_ += "</div>\n";
}

void ReportPage::link(std::string_view file, std::string_view text) {
  body_ += "<p class=\"link\"><a href=\"" + escaped(file) + "\">" + escaped(text) + "</a></p>\n";
}

void ReportPage::commands(const std::vector<std::string>& command_lines) {
  body_ += "<pre>";
  for (const auto& line : command_lines) body_ += escaped(line) + "\n";
  body_ += "</pre>\n";
}

void ReportPage::write(const std::filesystem::path& folder, std::string_view file) const {
  std::string page = "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  page += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  page += element("title", title_) + "\n<style>\n";
  page.append(assets::report_css)
      .append("</style>\n</head>\n<body>\n")
      .append(element("h1", title_))
      .append("\n<p class=\"lead\">" + escaped(lead_) + "</p>\n");
  if (!overview_.empty()) page += "<nav class=\"figures\">\n" + overview_ + "</nav>\n";
  page.append(body_).append("</body>\n</html>\n");
  write_file(folder / file, std::string_view(page));
}

void tell_report(const std::filesystem::path& folder, Session& session) {
  if (session.json()) return;
  session.print("Open " + session.strong((folder / "index.html").string()) + " in a browser.");
}

}  // namespace panonav::command
