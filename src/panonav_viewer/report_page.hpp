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

/// A picture of a report: a file in the folder of the page, or the picture itself as `data_url`,
/// and what a person should see in it.
struct ReportPicture {
  std::string file;
  std::string caption;
};

/// A map from above that unfolds, step by step. The title of each frame says which step it is.
struct UnfoldingMap {
  std::string title;
  std::vector<MapPlot> frames = {};     ///< at least one
  std::vector<MapLayer> backdrop = {};  ///< what stays, behind all frames
};

/// A plot that the page draws from numbers, with its caption.
struct ReportPlot {
  std::variant<LinePlot, HeatMap, MapPlot, PicturePlot, UnfoldingMap> plot;
  std::string caption;
};

/// One of the pictures that a page begins with.
struct StoryCard {
  std::string title;
  std::variant<ReportPicture, ReportPlot> shown;
  std::string value;    ///< main figure
  std::string meaning;  ///< of it, and of what is seen
  int part = 1;         ///< that tells more
};

/// A direction that a view marks.
struct ViewMark {
  double azimuth_rad = 0.0;
  PlotColour colour = PlotColour::grey;
  bool through = false;  ///< a dashed line through the view, not only an arrow above it
};
/// A view all around, clockwise, forward in the middle.
struct ReportView {
  Panorama panorama;
  std::vector<ViewMark> marks;
  std::string caption;
};

/// A report as one HTML page with everything in it: it opens from a file, without network, and
/// needs nothing beside it. It holds parts in the order in which they are added: text, figures,
/// tables, pictures, plots and runs. Plots and runs are drawn by the page's own scripts, in dark
/// and light; those that move start by themselves, one at a time, when they come into sight. A page
/// without these has no scripts.
class ReportPage {
 public:
  ReportPage(std::string title, std::string lead);

  /// Begins the page with its subject: pictures with their figures, and how to begin.
  void add_story(const std::vector<StoryCard>& cards, std::string_view commands_title,
                 const std::vector<std::string>& command_lines);
  void begin_section(std::string_view title);
  /// A numbered section. Its main figure stands at the top of the page, too, and leads here.
  void begin_part(std::string_view title,
                  const std::pair<std::string, std::string>& value_and_meaning);
  void add_text(std::string_view paragraph);
  /// Numbers that matter most, large: "0.09 m" "median error".
  void add_figures(const std::vector<std::pair<std::string, std::string>>& value_and_meaning);
  /// Throws ContractError when a row has another number of cells than the header.
  void add_table(const std::vector<std::string>& header,
                 const std::vector<std::vector<std::string>>& rows);
  /// Side by side where the window is wide enough. Files are read by `write`.
  void add_pictures(const std::vector<ReportPicture>& pictures);
  /// The same, small; those without a picture have their caption alone.
  void add_thumbnails(const std::vector<ReportPicture>& pictures);
  /// Side by side where the window is wide enough. Throws ContractError as `write_plot`.
  void add_plots(const std::vector<ReportPlot>& plots);
  /// One above the other, so that directions can be compared.
  void add_views(const std::vector<ReportView>& views);
  /// The run with its panels: map, pictures, facts, route and timeline, as far as it has them.
  void add_run(const RunPage& run);
  /// A file beside the page to open: "mission.log" "Read each decision".
  void add_link(std::string_view file, std::string_view text);
  /// Command lines as typed.
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
