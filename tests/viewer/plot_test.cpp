#include "panonav_viewer/plot.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::viewer {
using namespace testing;
namespace {

namespace fs = std::filesystem;

/// Works in its own folder, so that a command that a name is mistaken for leaves its file there.
class Plot : public InTemporaryFolder {
 protected:
  Plot() : before_(fs::current_path()) { fs::current_path(folder.path()); }
  ~Plot() override { fs::current_path(before_); }

  /// Names of the files in the folder.
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& file : fs::directory_iterator(folder.path())) {
      names.push_back(file.path().filename().string());
    }
    std::ranges::sort(names);
    return names;
  }

 private:
  fs::path before_;
};

TEST_F(Plot, ShowsTextOfAnyKindAsItIs) {
  const std::string hostile = "a`touch run`b 'q' \"d\" @x %s <i>&amp; {/Symbol a} a_b^c \\n";
  const std::string shown = "a`touch run`b 'q' \"d\" @x %s &lt;i>&amp;amp; {/Symbol a} a_b^c \\n";
  const LinePlot plot{
      .title = hostile + "\ntwo\tlines\x01\xFF",
      .x_label = hostile + "x",
      .y_label = hostile + "y",
      .series = {{.label = hostile + "k", .x = {1.0, 2.0}, .y = {1.0, 3.0}}},
      .x_tick_labels = {"`touch run` 'q' \"d\" @x %s <i>", "50% of " + std::string(90, 'y')}};
  write_plot("line.svg", plot);
  const std::string svg = bytes_of("line.svg");
  EXPECT_TRUE(contains(svg, ">" + shown + " two lines %FF<"));
  for (const char* mark : {"x", "y", "k"}) EXPECT_TRUE(contains(svg, shown + mark + "<"));
  EXPECT_TRUE(contains(svg, ">`touch run` 'q' \"d\" @x %s &lt;i><"));
  EXPECT_TRUE(
      contains(svg, ">50% of " + std::string(15, 'y') + "..." + std::string(22, 'y') + "<"));

  const MapPlot map{.title = hostile,
                    .layers = {{.label = hostile + "l", .lines = {{{0.0, 0.0}, {1.0, 2.0}}}}}};
  write_plot("map.svg", map);
  EXPECT_TRUE(contains(bytes_of("map.svg"), shown + "l<"));
  write_plot("maps.svg", {map, map}, 2);
  EXPECT_TRUE(contains(bytes_of("maps.svg"), shown + "l<"));
  HeatMap heat{.title = hostile, .value_label = hostile + "v", .columns = 2, .rows = 1};
  heat.values = {1.0, 2.0};
  write_plot("heat.svg", heat);
  EXPECT_TRUE(contains(bytes_of("heat.svg"), shown + "v<"));
  write_plot("line.png", plot);
  EXPECT_GT(fs::file_size("line.png"), 2000U);
  EXPECT_EQ(files(),
            (std::vector<std::string>{"heat.svg", "line.png", "line.svg", "map.svg", "maps.svg"}));
}

TEST_F(Plot, TheAxesOfAMapSayTheirUnit) {
  MapPlot map{.layers = {{.lines = {{{0.0, 0.0}, {1.0, 2.0}}}}}};
  write_plot("metres.svg", map);
  map.unit = "cells";
  write_plot("cells.svg", map);
  EXPECT_TRUE(contains(bytes_of("metres.svg"), "x [m]"));
  EXPECT_TRUE(contains(bytes_of("cells.svg"), "y [cells]"));
  EXPECT_FALSE(contains(bytes_of("cells.svg"), "[m]"));
}

TEST_F(Plot, WritesToAPathOfAnyName) {
  const LinePlot plot{.title = "t", .series = {{.x = {1.0, 2.0}, .y = {1.0, 3.0}}}};
  std::vector<std::string> names{"\"; system 'touch run'.svg",
                                 "'.`touch run`.svg",
                                 "-e system('touch run').svg",
                                 "line\nsystem 'touch run'\n.svg",
                                 "v`touch run`.svg",
                                 "|touch run;.svg",
                                 "~.svg"};
  for (const std::string& name : names) {
    write_plot(name, plot);
    EXPECT_TRUE(contains(bytes_of(name), "</svg>")) << name;
  }
  std::ranges::sort(names);
  EXPECT_EQ(files(), names);
}

TEST_F(Plot, LeavesNothingWhereItFails) {
  EXPECT_THROW(write_plot("there/is/no/folder.png", LinePlot{}), FileError);
  const LinePlot wrong{.series = {{.x = {1.0, 2.0}, .y = {1.0, 3.0}}},
                       .log_x = true,
                       .x_range = std::pair(-2.0, -1.0)};
  EXPECT_THROW(write_plot("map.png", wrong), ContractError);
  EXPECT_TRUE(files().empty());
}

TEST_F(Plot, NoNameOfAProcessIsInTheWayAndWhatAKillLeftIsTakenOver) {
  const std::string process = "a.svg." + std::to_string(getpid());
  for (const char* what : {".part", ".svg", ".log"}) fs::create_directory(process + what);
  std::ofstream(".a.svg.tmp") << "left";
  write_plot("a.svg", LinePlot{.series = {{.x = {1.0, 2.0}, .y = {1.0, 3.0}}}});
  EXPECT_TRUE(contains(bytes_of("a.svg"), "</svg>"));
  EXPECT_EQ(files().size(), 4U);
}

int times(const std::string& text, const std::string& part) {
  int count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; ++at) ++count;
  return count;
}

/// Heights of the frames around the plots of a picture.
std::vector<double> frame_heights(const std::string& svg) {
  static const std::regex frame(R"re(d='M([0-9.]+),([0-9.]+) L\1,([0-9.]+) L[^']*Z)re");
  std::vector<double> heights;
  for (std::sregex_iterator i(svg.begin(), svg.end(), frame), end; i != end; ++i) {
    heights.push_back(std::stod((*i)[3].str()) - std::stod((*i)[2].str()));
  }
  return heights;
}

TEST_F(Plot, PanelsHaveOneSizeAndOneLegendWithoutEmptyEntries) {
  const MapLayer way{.label = "a way", .lines = {{{0.0, 0.0}, {3.0, 2.0}}}};
  MapPlot many{.title = "many", .layers = {way}};
  for (int i = 0; i < 9; ++i) {
    many.layers.push_back({.label = "one of many kinds of marks " + std::to_string(i),
                           .colour = static_cast<PlotColour>(i),
                           .dots = {{0.1 * i, 1.0}}});
  }
  many.layers.push_back({.label = "of nothing"});
  write_plot("maps.svg", {many, MapPlot{.title = "one", .layers = {way}}}, 2);
  const std::string svg = bytes_of("maps.svg");
  EXPECT_EQ(times(svg, ">a way<"), 1);
  EXPECT_EQ(times(svg, ">one of many kinds of marks 4<"), 1);
  EXPECT_FALSE(contains(svg, "of nothing"));
  EXPECT_FALSE(contains(svg, "<title>")) << "a browser shows it under the mouse";
  const auto heights = frame_heights(svg);
  ASSERT_GE(heights.size(), 2U);
  EXPECT_NEAR(std::ranges::min(heights), std::ranges::max(heights), 0.02);

  write_plot("line.svg", LinePlot{.series = {{.label = "some", .x = {1.0, 2.0}, .y = {1.0, 3.0}},
                                             {.label = "of nothing"}}});
  EXPECT_TRUE(contains(bytes_of("line.svg"), ">some<"));
  EXPECT_FALSE(contains(bytes_of("line.svg"), "of nothing"));
  write_plot("nothing.svg", LinePlot{.series = {{.label = "of nothing"}}, .log_y = true});
  EXPECT_TRUE(contains(bytes_of("nothing.svg"), "</svg>"));
}

TEST_F(Plot, LabelsOfManyTicksDoNotOverlap) {
  LinePlot plot{.series = {{.style = SeriesStyle::bars}}};
  for (int i = 0; i < 120; ++i) {
    plot.series[0].add(i, 1.0);
    plot.x_tick_labels.push_back("tick " + std::to_string(i));
  }
  write_plot("bars.svg", plot);
  EXPECT_LE(times(bytes_of("bars.svg"), ">tick "), 45);
  EXPECT_GE(times(bytes_of("bars.svg"), ">tick "), 20);
  EXPECT_TRUE(contains(bytes_of("bars.svg"), "rotate(-40"));
  plot.x_tick_labels.resize(3);
  write_plot("few.svg", plot);
  EXPECT_FALSE(contains(bytes_of("few.svg"), "rotate(-40")) << "there is room";
}

TEST_F(Plot, ColourBarsBeginAtZeroAndHeatMapsAreSmallPictures) {
  HeatMap map{.value_label = "distance [m]", .columns = 4, .rows = 3};
  map.values.assign(12, 0.0);
  write_plot("zero.svg", map);
  EXPECT_FALSE(contains(bytes_of("zero.svg"), ">-1</text>"));
  for (const std::size_t empty : {0U, 4U, 8U}) map.values[empty] = std::nan("");
  write_plot("holes.svg", map);
  EXPECT_TRUE(contains(bytes_of("holes.svg"), "</svg>"));
  map.columns = map.rows = 200;
  map.values.clear();
  for (int i = 0; i < 40000; ++i) map.values.push_back(0.5 + i / 40000.0);
  write_plot("large.svg", map);
  const std::string svg = bytes_of("large.svg");
  EXPECT_TRUE(contains(svg, "image-rendering:pixelated"));
  EXPECT_LT(svg.size(), 200000U);
  EXPECT_TRUE(contains(svg, ">0</text>"));
}

/// Colour as seen with one kind of cones missing (Machado et al. 2009, severity 1), in CIE L*a*b*.
std::array<double, 3> seen(PlotColour colour, const std::array<double, 9>& matrix) {
  std::array<double, 3> linear{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double value =
        std::stoi(std::string(to_css_colour(colour).substr(1 + 2 * c, 2)), nullptr, 16) / 255.0;
    linear[c] = value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
  }
  const auto times_rgb = [&](const std::array<double, 9>& m, const std::array<double, 3>& v) {
    std::array<double, 3> result{};
    for (std::size_t i = 0; i < 9; ++i) result[i / 3] += m[i] * v[i % 3];
    return result;
  };
  auto rgb = times_rgb(matrix, linear);
  for (double& value : rgb) value = std::clamp(value, 0.0, 1.0);
  auto xyz =
      times_rgb({0.4339, 0.3762, 0.1899, 0.2126, 0.7152, 0.0722, 0.0177, 0.1095, 0.8730}, rgb);
  for (double& value : xyz)
    value = value > 0.008856 ? std::cbrt(value) : 7.787 * value + 16.0 / 116;
  return {116.0 * xyz[1] - 16.0, 500.0 * (xyz[0] - xyz[1]), 200.0 * (xyz[1] - xyz[2])};
}

TEST(PlotColours, StayApartForColourBlindReaders) {
  const std::vector<std::array<double, 9>> eyes{
      {1, 0, 0, 0, 1, 0, 0, 0, 1},
      {0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998},
      {0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881},
      {1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367,
       0.303900}};
  // Lines and marks; red and green of a traffic light differ by 7 for a tenth of all men.
  for (int a = 0; a <= static_cast<int>(PlotColour::black); ++a) {
    for (int b = 0; b < a; ++b) {
      for (const auto& eye : eyes) {
        const auto one = seen(static_cast<PlotColour>(a), eye);
        const auto other = seen(static_cast<PlotColour>(b), eye);
        EXPECT_GT(std::hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]), 15.0)
            << to_css_colour(static_cast<PlotColour>(a)) << " and "
            << to_css_colour(static_cast<PlotColour>(b));
      }
    }
  }
}

TEST_F(Plot, LongTextIsShortened) {
  const std::string name = "begin" + std::string(4000, 'x') +
                           "\xC3\xA4"
                           "end";
  write_plot("a.svg", LinePlot{.title = name, .series = {{.x = {1.0, 2.0}, .y = {1.0, 3.0}}}});
  const std::string svg = bytes_of("a.svg");
  EXPECT_EQ(svg.find(std::string(200, 'x')), std::string::npos);
  EXPECT_TRUE(contains(svg, "begin" + std::string(73, 'x') + "..." + std::string(74, 'x') +
                                "\xC3\xA4"
                                "end<"));
}

}  // namespace
}  // namespace panonav::viewer
