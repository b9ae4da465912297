#include "reporting/plot.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

/// Works in its own folder, so that a command that gnuplot is led to run leaves its file there.
class Plot : public InTemporaryFolder {
 protected:
  Plot() : before_(fs::current_path()) { fs::current_path(folder.path()); }
  ~Plot() override { fs::current_path(before_); }

  /// What lies in the folder.
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
  EXPECT_TRUE(contains(svg, ">" + shown + " two lines \xEF\xBF\xBD<"));
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

TEST_F(Plot, LeavesNothingWhereGnuplotFails) {
  EXPECT_THROW(write_plot("there/is/no/folder.png", LinePlot{}), FileError);
  const MapPlot wrong{.layers = {{.colour = "no colour", .dots = {{1.0, 1.0}, {2.0, 2.0}}}}};
  EXPECT_TRUE(contains(message_of<FileError>([&] { write_plot("map.png", wrong); }),
                       "map.png: gnuplot failed"));
  EXPECT_TRUE(files().empty());
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
}  // namespace panonav::testing
