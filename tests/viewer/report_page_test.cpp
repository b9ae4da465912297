#include "panonav_viewer/report_page.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"
#include "support/report_pages.hpp"
#include "support/temporary_folder.hpp"
#include "support/viewer_peer.hpp"

namespace panonav::viewer {
using namespace testing;
namespace {

/// Writes pages into a folder of its own.
class ReportPages : public InTemporaryFolder {
 protected:
  [[nodiscard]] std::string write(const ReportPage& page, std::string_view generator = {}) const {
    page.write(folder.path(), "index.html", generator);
    return bytes_of(folder / "index.html");
  }
  /// Returns the data of the only plot of a page.
  [[nodiscard]] json data_of(const ReportPlot& plot) const {
    ReportPage page("t", "l");
    page.add_plots({plot});
    const auto panels = panels_of(write(page));
    EXPECT_EQ(panels.size(), 1U);
    return panels.empty() ? json() : panels.front().data;
  }
};

TEST_F(ReportPages, TextOfAnyKindIsShownAsItIs) {
  const std::string hostile = "<script>x</script> & \"q\" 'a'";
  const std::string shown = "&lt;script&gt;x&lt;/script&gt; &amp; &quot;q&quot; &#39;a&#39;";
  ReportPage page(hostile + "title", hostile + "lead");
  page.begin_section(hostile + "section");
  page.begin_part(hostile + "part", {hostile + "value", hostile + "meaning"});
  page.add_text(hostile + "text");
  page.add_figures({{hostile + "figure", hostile + "unit"}});
  page.add_table({hostile + "head"}, {{hostile + "cell"}});
  page.add_thumbnails({{"", hostile + "caption"}});
  page.add_link(hostile + "file", hostile + "link");
  page.add_commands({hostile + "command"});
  const std::string text = text_of_page(write(page, "panonav test"));
  for (const char* where :
       {"title", "lead", "section", "part", "value", "meaning", "text", "figure", "unit", "head",
        "cell", "caption", "file", "link", "command"}) {
    EXPECT_TRUE(contains(text, shown + where));
  }
  EXPECT_EQ(text.find("<script>x"), std::string::npos);
  EXPECT_TRUE(contains(text, "panonav test"));
}

TEST_F(ReportPages, PartsAreNumberedAndLinkedAtTheTop) {
  ReportPage page("t", "l");
  page.begin_part("first", {"1 m", "wide"});
  page.add_text("between");
  page.begin_part("second", {"2 m", "long"});
  const std::string text = text_of_page(write(page));
  const std::size_t overview =
      text.find("<a href=\"#part2\"><small>2. second</small><b>2 m</b>long");
  ASSERT_NE(overview, std::string::npos);
  EXPECT_LT(text.find("<a href=\"#part1\"><small>1. first</small><b>1 m</b>wide"), overview);
  EXPECT_LT(overview, text.find("<h2 id=\"part1\">1. first</h2>"));
  EXPECT_LT(text.find("<p>between</p>"), text.find("<h2 id=\"part2\">2. second</h2>"));
}

TEST_F(ReportPages, TablesHaveAsManyCellsAsTheirHeader) {
  ReportPage page("t", "l");
  page.add_table({"a", "b"}, {{"1", "2"}, {"3", "4"}});
  EXPECT_TRUE(contains(write(page),
                       "<tr><th>a</th><th>b</th></tr>\n"
                       "<tr><td class=\"short\" data-name=\"a\">1</td>"
                       "<td class=\"short\" data-name=\"b\">2</td></tr>\n"
                       "<tr><td class=\"short\" data-name=\"a\">3</td>"
                       "<td class=\"short\" data-name=\"b\">4</td></tr>\n"));
  EXPECT_THROW(page.add_table({"a", "b"}, {{"1", "2"}, {"3"}}), ContractError);
}

TEST_F(ReportPages, TablesHaveNoColumnThatIsEmptyInAllRows) {
  ReportPage page("t", "l");
  page.add_table({"a", "b", "c", "d"}, {{"", "2", "", "4"}, {"", "", "", "5"}});
  const std::string text = write(page);
  EXPECT_TRUE(contains(text, "<tr><th>b</th><th>d</th></tr>\n"));
  EXPECT_TRUE(contains(text, "data-name=\"b\"></td><td class=\"short\" data-name=\"d\">5</td>"));
  ReportPage bare("t", "l");
  bare.add_table({"a", "b"}, {});
  EXPECT_TRUE(contains(write(bare), "<tr><th>a</th><th>b</th></tr>\n"));
}

TEST_F(ReportPages, PicturesOfTheFolderAreEmbeddedByteForByte) {
  const Image image(4, 3, 3);
  const std::vector<std::uint8_t> png = encode_png(image.view());
  const std::vector<std::uint8_t> jpeg = encode_jpeg(image.view());
  const std::string svg = "<svg xmlns='x'></svg>";
  folder.write("a.png", std::string(png.begin(), png.end()));
  folder.write("b.jpg", std::string(jpeg.begin(), jpeg.end()));
  folder.write("c.svg", svg);
  ReportPage page("t", "l");
  page.add_pictures({{"a.png", "png"}, {"b.jpg", "jpeg"}, {"c.svg", "svg"}});
  page.add_pictures({{make_data_url("image/png", png), "already"}});
  const std::string written = write(page);
  EXPECT_EQ(pictures_of(written), 4U);
  const auto source = [&](const std::string& alt) {
    const std::string begin = "alt=\"" + alt + "\" src=\"";
    const std::size_t at = written.find(begin) + begin.size();
    return written.substr(at, written.find('"', at) - at);
  };
  EXPECT_TRUE(source("png").starts_with("data:image/png;base64,"));
  EXPECT_TRUE(source("jpeg").starts_with("data:image/jpeg;base64,"));
  EXPECT_TRUE(source("svg").starts_with("data:image/svg+xml;base64,"));
  EXPECT_EQ(bytes_of_url(source("png")), png);
  EXPECT_EQ(bytes_of_url(source("jpeg")), jpeg);
  EXPECT_EQ(bytes_of_url(source("svg")), std::vector<std::uint8_t>(svg.begin(), svg.end()));
  EXPECT_EQ(source("already"), source("png"));
  page.add_pictures({{"absent.png", "absent"}});
  EXPECT_THROW(page.write(folder.path(), "other.html"), FileError);
  EXPECT_FALSE(std::filesystem::exists(folder / "other.html"));
}

TEST_F(ReportPages, AStoryBeginsThePageAndLinksToItsParts) {
  ReportPage page("t", "l");
  page.add_text("afterwards");
  const MapPlot map{.title = "a map", .layers = {{.dots = {{1.0, 2.0}}}}};
  page.add_story({{.title = "drawn",
                   .shown = ReportPlot{map, ""},
                   .value = "1 m",
                   .meaning = "error",
                   .part = 3},
                  {.title = "taken",
                   .shown = ReportPicture{make_data_url("image/png", {}), "hall"},
                   .value = "2 m",
                   .meaning = "path length"}},
                 "Begin here", {"panonav demo"});
  const std::string written = write(page);
  EXPECT_EQ(plots_of(written), std::vector<std::string>{"a map"});
  EXPECT_TRUE(contains(written, "<h2><a href=\"#part3\">drawn</a></h2>"));
  EXPECT_TRUE(contains(written, "<h2><a href=\"#part1\">taken</a></h2>"));
  EXPECT_TRUE(contains(written, "<p><b>2 m</b> path length</p>"));
  EXPECT_TRUE(contains(written, "<h2>Begin here</h2><pre>panonav demo\n</pre>"));
  EXPECT_LT(written.find("Begin here"), written.find("<p>afterwards</p>"));
}

TEST_F(ReportPages, CurvesKeepTheirNumbers) {
  LinePlot plot{.title = "curve",
                .x_label = "x [m]",
                .y_label = "y [m]",
                .series = {{.label = "a", .style = SeriesStyle::points}},
                .log_x = true,
                .log_y = true,
                .x_range = std::pair(1.0, 10.0),
                .y_range = std::pair(0.5, 2.0),
                .x_tick_labels = {"one"}};
  plot.series[0].add(1.23456789, std::nan(""), 0.25, 0.75);
  EXPECT_EQ(data_of({plot, ""}), json::parse(R"({
    "title": "curve", "x_label": "x [m]", "y_label": "y [m]",
    "series": [{"label": "a", "style": "points", "x": [1.23457], "y": [null], "low": [0.25],
                "high": [0.75]}],
    "log_x": true, "log_y": true, "x_range": [1.0, 10.0], "y_range": [0.5, 2.0],
    "names": ["one"]})"));
  plot.series[0].x.push_back(2.0);
  EXPECT_THROW((void)data_of({plot, ""}), ContractError);
}

TEST_F(ReportPages, MapsKeepTheirLayersAndFrames) {
  const MapLayer layer{.label = "bad \xff",
                       .colour = PlotColour::vermilion,
                       .circles = {{1.00004, 2.0}},
                       .crosses = {{3.0, 4.0}},
                       .lines = {{{0.0, 0.0}, {1.0, 1.0}}},
                       .filled_polygons = {{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}},
                       .dots = {{5.0, 6.0}},
                       .squares = {{7.0, 8.0}}};
  const json drawn = json::parse(R"({"label": "bad \ufffd", "colour": "vermilion",
    "circles": [1.0, 2.0], "crosses": [3.0, 4.0], "lines": [[0.0, 0.0, 1.0, 1.0]],
    "polygons": [[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]], "dots": [5.0, 6.0], "squares": [7.0, 8.0]})");
  const MapPlot first{.title = "first",
                      .layers = {layer},
                      .unit = "cells",
                      .shown = std::pair(Point2{4.0, -1.0}, Point2{-2.0, 3.0})};
  const json one = data_of({first, ""});
  EXPECT_EQ(one["frames"], json::array({{{"title", "first"}, {"layers", {drawn}}}}));
  EXPECT_EQ(one["unit"], "cells");
  EXPECT_EQ(one["shown"], json::parse("[-2.0, -1.0, 4.0, 3.0]"));  // lower corner first
  EXPECT_FALSE(one.contains("backdrop"));
  const json unfolding = data_of(
      {MapAnimation{.title = "all", .frames = {first, {.title = "second"}}, .backdrop = {layer}},
       ""});
  EXPECT_EQ(unfolding["title"], "all");
  EXPECT_EQ(unfolding["backdrop"], json::array({drawn}));
  ASSERT_EQ(unfolding["frames"].size(), 2U);
  EXPECT_EQ(unfolding["frames"][1], json::parse(R"({"title": "second", "layers": []})"));
  EXPECT_THROW((void)data_of({MapAnimation{.title = "none"}, ""}), ContractError);
}

TEST_F(ReportPages, HeatMapsKeepTheirCells) {
  const HeatMap map{.title = "heat",
                    .value_label = "error [m]",
                    .columns = 2,
                    .rows = 1,
                    .first_cell = {0.5, -0.5},
                    .spacing_m = 0.25,
                    .values = {0.75, std::nan("")},
                    .crosses = {{1.0, 2.0}}};
  EXPECT_EQ(data_of({map, ""}), json::parse(R"({"title": "heat", "heat": {"columns": 2, "rows": 1,
    "first": [0.5, -0.5], "spacing": 0.25, "values": [0.75, null], "label": "error [m]",
    "crosses": [1.0, 2.0]}})"));
}

TEST_F(ReportPages, PicturesOverAxesHaveTheirHighestRowFirst) {
  PicturePlot plot{.title = "route",
                   .x_label = "azimuth",
                   .y_label = "path [m]",
                   .x_range = {180.0, -180.0},
                   .y_range = {0.0, 2.0},
                   .columns = 1,
                   .rows = 2,
                   .values = {0.0F, 1.0F},
                   .x_tick = 90.0,
                   .y_tick = 0.5};
  const json data = data_of({plot, ""});
  EXPECT_EQ(data["x_range"], json::parse("[180.0, -180.0]"));
  EXPECT_EQ(data["x_tick"], 90.0);
  EXPECT_EQ(data["y_tick"], 0.5);
  const Image image = decode_image(bytes_of_url(data["image"].get<std::string>()), "route");
  ASSERT_EQ(image.width(), 1);
  ASSERT_EQ(image.height(), 2);
  EXPECT_EQ(image.pixels().front(), 255);
  EXPECT_EQ(image.pixels().back(), 0);
  write_plot(folder / "route.svg", plot);
  EXPECT_TRUE(contains(bytes_of(folder / "route.svg"), "path [m]"));
  plot.values.pop_back();
  EXPECT_THROW((void)data_of({plot, ""}), ContractError);
}

TEST_F(ReportPages, ViewsMarkTheirDirectionsFromTheMiddle) {
  ReportPage page("t", "l");
  // The page shows left directions, whose azimuths are positive, on the left.
  const double left_rad = std::numbers::pi / 2.0;
  page.add_views({{Panorama(4, 16, std::nullopt),
                   {{left_rad, PlotColour::green, false}, {-left_rad, PlotColour::blue, true}},
                   "seen"}});
  const std::string text = text_of_page(write(page));
  EXPECT_TRUE(contains(text, "<i class=\"arrow\" style=\"left:25.00%;--key:var(--green)\">"));
  EXPECT_TRUE(contains(text, "<i style=\"left:75.00%;--key:var(--blue)\">"));
  EXPECT_TRUE(contains(text, "aspect-ratio:4.00"));
  EXPECT_TRUE(contains(text, "<figcaption>seen</figcaption>"));
}

TEST_F(ReportPages, RunsKeepTheirPicturesChangesAndRoute) {
  RunPage run("run", 2);
  recordings::RunMoment first = moment_at(0.0);
  first.panorama = Panorama(4, 16, std::nullopt);
  const Image best(8, 6, 3);
  first.best_match = encode_png(best.view());
  run.add(first);
  recordings::RunMoment second = moment_at(1.0);
  second.goal = Pose2{7.0, 8.0, 0.0};
  run.add(second);
  run.set_unordered();
  run.set_route({.title = "route", .columns = 1, .rows = 1, .values = {0.5F}},
                {{.along_m = 1.5, .changed_deg = {{-10.04, 20.06}}}, {.true_along_m = 2.5}});
  EXPECT_EQ(run.size(), 2U);
  ReportPage page("t", "l");
  page.add_run(run);
  const auto panels = panels_of(write(page));
  ASSERT_EQ(panels.size(), 1U);
  EXPECT_EQ(panels[0].name, "run");
  const json& data = panels[0].data;
  const auto picture = [&](const char* name) {
    return decode_image(bytes_of_url(data["moments"][0]["data"][name].get<std::string>()), name);
  };
  EXPECT_EQ(picture("panorama").width(), 16);
  EXPECT_EQ(picture("best").width(), 8);
  EXPECT_EQ(data["moments"][1]["data"], json::object());
  EXPECT_FALSE(data["moments"][0].contains("changes"));
  EXPECT_EQ(data["moments"][1]["changes"]["goal"], json::parse("[7.0, 8.0, 0.0]"));
  EXPECT_EQ(data["unordered"], true);
  EXPECT_EQ(data["route"]["marks"], json::parse("[[1.5, null, [-10.0, 20.1]], [null, 2.5, []]]"));
}

TEST_F(ReportPages, RunsOfMoreMomentsThanExpectedKeepHalfOfTheirPictures) {
  RunPage run("run", 1);
  const Panorama panorama(4, 16, std::nullopt);
  for (int i = 0; i < 650; ++i) {
    recordings::RunMoment moment = moment_at(i);
    moment.panorama = panorama;
    run.add(moment);
  }
  ReportPage page("t", "l");
  page.add_run(run);
  const auto panels = panels_of(write(page));
  ASSERT_EQ(panels.size(), 1U);
  const json& moments = panels[0].data["moments"];
  ASSERT_EQ(moments.size(), 650U);
  for (std::size_t i = 0; i < moments.size(); ++i) {
    EXPECT_EQ(moments[i].contains("data"), i % 2 == 0) << i;
  }
}

}  // namespace
}  // namespace panonav::viewer
