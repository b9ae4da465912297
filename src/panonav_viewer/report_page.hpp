#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "panonav/panorama/panorama.hpp"
#include "panonav_viewer/page.hpp"
#include "panonav_viewer/picture_plot.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::viewer {

/// A picture of a report with its caption: a file in the folder of the page, or the picture itself
/// as `data_url`.
struct ReportPicture {
  std::string file;
  std::string caption;
};

/// A map from above as an animation. The title of each frame names its step.
struct UnfoldingMap {
  std::string title;
  std::vector<MapPlot> frames = {};     ///< at least one
  std::vector<MapLayer> backdrop = {};  ///< layers behind all frames
};

/// A plot that the page draws from numbers, with its caption.
struct ReportPlot {
  std::variant<LinePlot, HeatMap, MapPlot, PicturePlot, UnfoldingMap> plot;
  std::string caption;
};

/// A picture at the beginning of a page.
struct StoryCard {
  std::string title;
  std::variant<ReportPicture, ReportPlot> shown;
  std::string value;    ///< main figure
  std::string meaning;  ///< meaning of the figure and the picture
  int part = 1;         ///< number of the part with details
};

/// A direction that a view marks.
struct ViewMark {
  double azimuth_rad = 0.0;
  PlotColour colour = PlotColour::grey;
  bool through = false;  ///< a dashed line through the view, not only an arrow above it
};
/// A panoramic view, clockwise, forward in the middle.
struct ReportView {
  Panorama panorama;
  std::vector<ViewMark> marks;
  std::string caption;
};

/// A report as one HTML page, which needs neither network nor other files. It holds parts in the
/// order in which they are added: text, figures, tables, pictures, plots and runs. Plots and runs
/// are drawn by the page's own scripts, in dark and light; animations start by themselves, one at a
/// time, when they become visible. A page without plots and runs has no scripts.
class ReportPage {
 public:
  ReportPage(std::string title, std::string lead);

  /// Begins the page with pictures, their figures, and first commands.
  void add_story(const std::vector<StoryCard>& cards, std::string_view commands_title,
                 const std::vector<std::string>& command_lines);
  void begin_section(std::string_view title);
  /// Begins a numbered section. Its main figure is shown at the top of the page, too, and links to
  /// it.
  void begin_part(std::string_view title,
                  const std::pair<std::string, std::string>& value_and_meaning);
  void add_text(std::string_view paragraph);
  /// Adds the main numbers, large: "0.09 m" "median error".
  void add_figures(const std::vector<std::pair<std::string, std::string>>& value_and_meaning);
  /// Adds a table. Throws ContractError when a row has another number of cells than the header.
  void add_table(const std::vector<std::string>& header,
                 const std::vector<std::vector<std::string>>& rows);
  /// Adds pictures, side by side if the window is wide enough. Files are read by `write`.
  void add_pictures(const std::vector<ReportPicture>& pictures);
  /// Adds small pictures; those without a picture have their caption alone.
  void add_thumbnails(const std::vector<ReportPicture>& pictures);
  /// Adds plots, side by side if the window is wide enough. Throws ContractError as `write_plot`.
  void add_plots(const std::vector<ReportPlot>& plots);
  /// Adds views, one above the other, so that directions can be compared.
  void add_views(const std::vector<ReportView>& views);
  /// Adds the run with its panels: map, pictures, facts, route and timeline, as far as it has them.
  void add_run(const RunPage& run);
  /// Adds a link to a file next to the page: "mission.log" "Read each decision".
  void add_link(std::string_view file, std::string_view text);
  /// Adds command lines.
  void add_commands(const std::vector<std::string>& command_lines);

  /// Writes the page into `folder`, whole or not at all, with the pictures of `folder` in it.
  /// `generator`: "panonav track", by which a later run knows its own page. Throws FileError, also
  /// when a picture is not there.
  void write(const std::filesystem::path& folder, std::string_view file = "index.html",
             std::string_view generator = {}) const;

 private:
  void add_figure(const ReportPicture& picture);

  std::string title_;
  std::string lead_;
  std::string overview_;  // a link for each part
  std::string story_;
  /// HTML, each followed by the address of a picture: a file, or the picture itself; or nothing.
  std::vector<std::pair<std::string, std::string>> body_;
  int parts_ = 0;
};

}  // namespace panonav::viewer
