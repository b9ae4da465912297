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

/// The page that shows a run, and the run as an element of a report (report_page.hpp).
namespace panonav::viewer {

/// Returns a page that reads "events" and "picture/N/NAME" relative to its own address. Buttons of
/// a replay post to "control", and clicks too if `accepted_input`, "goal" or "pose", states what
/// the run accepts.
[[nodiscard]] std::string live_page(std::string_view title, bool replay,
                                    std::string_view accepted_input = "");

/// Returns the page for a viewer who opened an address without its secret part: it says where the
/// complete address is, and nothing about the run.
[[nodiscard]] std::string entrance_page();

/// A robot's position along a remembered route at one moment.
struct RouteMark {
  std::optional<double> along_m;       ///< of the matched line; nullopt: not on the route
  std::optional<double> true_along_m;  ///< nullopt: unknown
  /// Sectors in which the scene differs from the recorded route: from, to, in degrees,
  /// counter-clockwise, left positive.
  std::vector<std::pair<double, double>> changed_deg;
};

/// A page with a finished run, which starts to play when it is opened. Images (panorama and best
/// match) are stored for about 300 evenly spaced moments; for at most 600 if there are more moments
/// than expected.
class RunPage {
 public:
  /// `moments` is the expected number of moments.
  RunPage(std::string title, std::size_t moments);
  void add(const recordings::RunMoment& moment);
  /// Shows no path, because the images are not in the order of a path.
  void set_unordered() noexcept { unordered_ = true; }
  /// Adds an image of the remembered route over azimuth and path length, with a mark per moment.
  void set_route(const PicturePlot& panorama, const std::vector<RouteMark>& marks);

  /// Returns the number of moments.
  [[nodiscard]] std::size_t size() const noexcept { return moments_.size(); }
  /// Returns a page that needs no other files.
  [[nodiscard]] std::string html() const;
  /// Returns the HTML element that shows the run, to be part of a page.
  [[nodiscard]] std::string element() const;

 private:
  [[nodiscard]] std::string json() const;

  std::string title_;
  std::size_t every_;                  // every n-th moment has images
  std::vector<std::string> moments_;   // JSON of each moment
  std::vector<std::string> pictures_;  // JSON of each moment's images; empty: none
  std::string route_;                  // JSON of the route; empty: none
  bool unordered_ = false;
  RetainedParts retained_;
};

/// Returns an HTML page with embedded styles and scripts. `body` is HTML; `generator` is the
/// name of the program and may be empty.
[[nodiscard]] std::string make_page(std::string_view title, std::string_view generator,
                                    std::string body);

/// Escapes text for elements and quoted attributes of HTML.
[[nodiscard]] std::string escape_html(std::string_view text);
/// Returns a script element that contains JSON data.
[[nodiscard]] std::string data_element(std::string_view json);

}  // namespace panonav::viewer
