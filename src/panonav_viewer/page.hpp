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

/// Reads "events" and "picture/N/NAME" beside its own address; of a replay its buttons post to
/// "control", and so do clicks where the run takes a "goal" or a "pose".
[[nodiscard]] std::string live_page(std::string_view title, bool replay,
                                    std::string_view takes = "");

/// A robot's position along a remembered route at one moment.
struct RouteMark {
  std::optional<double> along_m;       ///< of the matched line; empty: not on the route
  std::optional<double> true_along_m;  ///< where it is known
  /// Directions in which the scene is not as remembered: from, to, degrees, left positive,
  /// counter-clockwise.
  std::vector<std::pair<double, double>> changed_deg;
};

/// A run that is over, with its moments in it: it plays by itself. Pictures (panorama and best
/// match) are those of about 300 moments, evenly chosen; of at most 600 where more moments come
/// than were expected.
class RunPage {
 public:
  /// `moments`: that are expected.
  RunPage(std::string title, std::size_t moments);
  void add(const recordings::RunMoment& moment);
  /// Its pictures follow no path: none is drawn.
  void unordered() noexcept { unordered_ = true; }
  /// Picture of the remembered route over azimuth and path length, with a mark for each moment.
  void route(const PicturePlot& panorama, const std::vector<RouteMark>& marks);

  /// Moments that were added.
  [[nodiscard]] std::size_t size() const noexcept { return moments_.size(); }
  /// A page of its own, which needs no other file.
  [[nodiscard]] std::string html() const;
  /// The part of a page that shows it.
  [[nodiscard]] std::string element() const;

 private:
  [[nodiscard]] std::string json() const;

  std::string title_;
  std::size_t every_;                  // moment with pictures
  std::vector<std::string> moments_;   // JSON
  std::vector<std::string> pictures_;  // likewise, of each moment; empty: none
  std::string route_;                  // likewise, empty: none
  bool unordered_ = false;
  StayingParts staying_;
};

/// One HTML text with styles and scripts in it. `body` is HTML; `generator`: what made it, for
/// machines, may be empty.
[[nodiscard]] std::string whole_page(std::string_view title, std::string_view generator,
                                     std::string body);

/// Text of any origin as HTML shows it, in elements and between the quotes of attributes.
[[nodiscard]] std::string html_escaped(std::string_view text);
/// JSON within a script element.
[[nodiscard]] std::string data_element(std::string_view json);

}  // namespace panonav::viewer
