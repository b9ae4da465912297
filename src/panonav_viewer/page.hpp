#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panonav_recordings/run_recorder.hpp"
#include "panonav_viewer/data_url.hpp"
#include "panonav_viewer/moment_json.hpp"
#include "panonav_viewer/picture_plot.hpp"

/// The page that shows a run, and the run as a part of a report (report_page.hpp).
namespace panonav::viewer {

/// Returns a page that reads "events" and "picture/N/NAME" relative to its own address. Buttons of
/// a replay post to "control", and so do clicks if the run accepts a "goal" or a "pose".
[[nodiscard]] std::string live_page(std::string_view title, bool replay,
                                    std::string_view takes = "");

/// A robot's position along a remembered route at one moment.
struct RouteMark {
  std::optional<double> along_m;       ///< of the matched line; empty: not on the route
  std::optional<double> true_along_m;  ///< where it is known
  /// Directions in which the scene differs from the route's: from, to, degrees, left positive,
  /// counter-clockwise.
  std::vector<std::pair<double, double>> changed_deg;
};

/// A page with a finished run, which plays by itself. Images (panorama and best match) are those of
/// about 300 evenly chosen moments; of at most 600 if there are more moments than expected.
class RunPage {
 public:
  /// `moments`: expected number of moments.
  RunPage(std::string title, std::size_t moments);
  void add(const recordings::RunMoment& moment);
  /// Draws no path, as the pictures follow none.
  void unordered() noexcept { unordered_ = true; }
  /// Adds a picture of the remembered route over azimuth and path length, with a mark for each
  /// moment.
  void route(const PicturePlot& panorama, const std::vector<RouteMark>& marks);

  /// Returns the number of moments.
  [[nodiscard]] std::size_t size() const noexcept { return moments_.size(); }
  /// Returns a page that needs no other file.
  [[nodiscard]] std::string html() const;
  /// Returns the part of a page that shows the run.
  [[nodiscard]] std::string element() const;

 private:
  [[nodiscard]] std::string json() const;

  std::string title_;
  std::size_t every_;                  // moment with pictures
  std::vector<std::string> moments_;   // JSON
  std::vector<std::string> pictures_;  // likewise, of each moment; empty: none
  std::string route_;                  // likewise, empty: none
  bool unordered_ = false;
  RetainedParts retained_;
};

/// Returns an HTML page with styles and scripts in it. `body` is HTML; `generator`: name of the
/// program, may be empty.
[[nodiscard]] std::string make_page(std::string_view title, std::string_view generator,
                                    std::string body);

/// Returns text escaped for elements and quoted attributes of HTML.
[[nodiscard]] std::string escape_html(std::string_view text);
/// Returns JSON within a script element.
[[nodiscard]] std::string data_element(std::string_view json);

}  // namespace panonav::viewer
