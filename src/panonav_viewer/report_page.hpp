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

/// A picture of a report with its caption: the name of a file in the page's folder, or the picture
/// itself as a URL by `make_data_url`.
struct ReportPicture {
  std::string file;
  std::string caption;
};

/// A map as an animation. The title of each frame names its step.
struct MapAnimation {
  std::string title;
  std::vector<MapPlot> frames = {};     ///< at least one
  std::vector<MapLayer> backdrop = {};  ///< layers behind all frames
};

/// A plot that the page draws from numbers, with its caption.
struct ReportPlot {
  std::variant<LinePlot, HeatMap, MapPlot, PicturePlot, MapAnimation> plot;
  std::string caption;
};

/// A card at the beginning of a page: a picture or plot with its main number.
struct StoryCard {
  std::string title;
  std::variant<ReportPicture, ReportPlot> shown;
  std::string value;    ///< main number
  std::string meaning;  ///< what the number and the picture mean
  int part = 1;         ///< number of the part to which the card links
};

/// A direction marked in a view.
struct ViewMark {
  double azimuth_rad = 0.0;
  PlotColour colour = PlotColour::grey;
  bool is_dashed_line = false;  ///< a dashed line through the view, not only an arrow
};
/// A panoramic view; azimuth decreases to the right, forward is in the middle.
struct ReportView {
  Panorama panorama;
  std::vector<ViewMark> marks;
  std::string caption;
};

/// A report as one HTML page, which needs neither network nor other files. It contains its parts in
/// the order of the calls: text, main numbers, tables, pictures, plots and runs. Plots and runs are
/// drawn by the page's own scripts, in dark and light; animations start when they become visible,
/// one at a time. A page without plots and runs has no scripts.
class ReportPage {
 public:
  ReportPage(std::string title, std::string lead);

  /// Begins the page with cards, and with command lines to start with.
  void add_story(const std::vector<StoryCard>& cards, std::string_view commands_title,
                 const std::vector<std::string>& command_lines);
  void begin_section(std::string_view title);
  /// Begins a numbered section. Its main number is also shown at the top of the page, as a link to
  /// the section.
  void begin_part(std::string_view title,
                  const std::pair<std::string, std::string>& value_and_meaning);
  void add_text(std::string_view paragraph);
  /// Adds main numbers in large type: "0.09 m" "median error".
  void add_figures(const std::vector<std::pair<std::string, std::string>>& value_and_meaning);
  /// Adds a table without the columns that are empty in all rows. Throws ContractError unless each
  /// row has as many cells as the header.
  void add_table(std::vector<std::string> header, std::vector<std::vector<std::string>> rows);
  /// Adds pictures, next to each other if the window is wide enough. `write` reads the files.
  void add_pictures(const std::vector<ReportPicture>& pictures);
  /// Adds small pictures; for an empty file name only the caption is shown.
  void add_thumbnails(const std::vector<ReportPicture>& pictures);
  /// Adds plots, next to each other if the window is wide enough. Throws ContractError as
  /// `write_plot`.
  void add_plots(const std::vector<ReportPlot>& plots);
  /// Adds views above each other, so that directions can be compared.
  void add_views(const std::vector<ReportView>& views);
  /// Adds the run with those panels for which it has data: map, pictures, facts, route and
  /// timeline.
  void add_run(const RunPage& run);
  /// Adds a link to a file next to the page: "mission.log" "Read each decision".
  void add_link(std::string_view file, std::string_view text);
  /// Adds command lines.
  void add_commands(const std::vector<std::string>& command_lines);

  /// Writes the page into `folder`, complete or not at all, with the pictures of `folder` embedded.
  /// `generator` is the name of the program, as "panonav track", by which a later run recognises
  /// its own page. Throws FileError, also if a picture is missing.
  void write(const std::filesystem::path& folder, std::string_view file = "index.html",
             std::string_view generator = {}) const;

 private:
  void add_figure(const ReportPicture& picture);

  std::string title_;
  std::string lead_;
  std::string overview_;  // HTML of the links to all parts
  std::string story_;
  /// Pieces of HTML, each followed by a picture (file name or data URL) or an empty text.
  std::vector<std::pair<std::string, std::string>> body_;
  int parts_ = 0;
};

}  // namespace panonav::viewer
