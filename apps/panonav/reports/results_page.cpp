#include "reports/results_page.hpp"

#include <utility>
#include <vector>

#include "reports/report_page.hpp"

namespace panonav::command {

namespace {

void add_table(viewer::ReportPage& page, std::span<const lab::ResultRow> rows) {
  const auto header = lab::table_header();
  std::vector<std::vector<std::string>> lines;
  for (const lab::ResultRow& row : rows) {
    lines.push_back(lab::table_cells(row));
    if (row.target && !row.holds()) lines.back().back() = "NO";
  }
  page.add_table({header.begin(), header.end()}, lines);
}

// Adds a table of rows with a target, then one of rows without.
void add_tables(viewer::ReportPage& page, std::vector<lab::ResultRow> rows) {
  const std::size_t judged = lab::move_targets_first(rows);
  const std::span<const lab::ResultRow> all(rows);
  if (judged > 0) add_table(page, all.first(judged));
  if (judged == all.size()) return;
  page.add_text("Results without a target:");
  add_table(page, all.subspan(judged));
}

void add_counts(viewer::ReportPage& page, const lab::TargetCount& count, std::size_t rows) {
  page.add_figures(
      {{std::to_string(count.held) + " of " + std::to_string(count.judged), "targets met"},
       {std::to_string(rows - count.judged), "other results without a target"}});
}

void add_misses(viewer::ReportPage& page, const lab::ResultsDocument& document) {
  page.begin_section("Targets that were not met");
  const auto misses = lab::list_misses(document);
  for (const std::string& line : misses) page.add_text(line);
  if (misses.empty()) page.add_text("None.");
}

}  // namespace

void write_paper_page(const std::filesystem::path& folder, const ReproducedPaper& paper,
                      const std::string& lead, const lab::Reproduction& reproduction) {
  viewer::ReportPage page(std::string(paper.title), lead);
  add_counts(page, lab::count_targets(reproduction.rows), reproduction.rows.size());
  add_misses(
      page,
      {.version = {}, .command = {}, .papers = {{std::string(paper.name), {}, reproduction.rows}}});
  page.begin_section("Published and measured results");
  add_tables(page, reproduction.rows);
  page.begin_section("Images");
  std::vector<viewer::ReportPicture> pictures;
  for (const auto& picture : reproduction.pictures) {
    pictures.push_back({picture.file.string(), picture.caption});
  }
  page.add_pictures(pictures);
  page.write(folder);
}

void write_results_page(const std::filesystem::path& folder, const lab::ResultsDocument& document) {
  viewer::ReportPage page("Results: published and measured values",
                          "Written by panonav " + document.version + ":");
  page.add_commands({document.command});
  std::size_t rows = 0;
  for (const lab::PaperResults& paper : document.papers) rows += paper.rows.size();
  add_counts(page, lab::count_targets(document), rows);
  add_misses(page, document);
  for (const lab::PaperResults& paper : document.papers) {
    page.begin_section(paper.title);
    page.add_link(paper.paper + "/index.html", "Page of this paper with images");
    add_tables(page, paper.rows);
  }
  page.write(folder);
}

}  // namespace panonav::command
