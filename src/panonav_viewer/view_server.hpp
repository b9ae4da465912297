#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panonav_recordings/run_recorder.hpp"

namespace panonav::viewer {

/// Wishes that a viewer may send to the run by a click on the map.
enum class ViewerInput {
  none,
  goal,  ///< where to go; without a heading
  pose,  ///< where the robot is
};

struct ViewServerOptions {
  std::string address = "127.0.0.1";  ///< an IPv4 address of this machine, to listen at
  int port = 0;                       ///< 0 .. 65535; 0: a free one
  std::string title = "panonav";      ///< of the page
  std::size_t max_viewers = 8;        ///< at a time; further ones are refused
  /// The run is one of a recording: it waits for the first viewer, continues at the pace of its
  /// stamps, and viewers may hold it, take it step by step, and change its pace. Two seconds after
  /// the last viewer has left it continues without waiting.
  bool replay = false;
  ViewerInput takes = ViewerInput::none;  ///< anything else is refused
  /// Returns the picture (PNG or JPEG) of a reference by its name, empty where there is none; it is
  /// called on a thread of its own and may be slow. Empty: viewers get no pictures of references.
  std::function<std::vector<std::uint8_t>(const std::string& name)> thumbnail;
};

/// Shows a run in browsers while it runs: a page over HTTP, moments as server-sent events, pictures
/// on request. A thread encodes a moment or picture once, when the first viewer requests it. A slow
/// viewer misses moments and never delays a live run or other viewers. References, edges, plan and
/// the path so far are kept for later viewers.
///
/// The address of the page holds a random token of 128 bits. Requests without it get nothing, and
/// neither does a page of another origin, or one that used a name other than "localhost" (DNS
/// rebinding).
class ViewServer {
 public:
  /// Begins to listen. Throws Error if address and port are not available, ContractError if the
  /// port is out of range.
  explicit ViewServer(const ViewServerOptions& options = {});
  /// Notifies viewers of the end of the run; connected ones get 0.3 s for the last pictures.
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  /// "http://127.0.0.1:41234/6f3a.../": to open in a browser.
  [[nodiscard]] std::string url() const;
  /// A live run never waits here. Cost: that of moving the moment, and of noting its pose. Of a
  /// replay waits until it is the moment's turn.
  void add(recordings::RunMoment moment);
  [[nodiscard]] std::size_t viewers() const;
  /// Returns the latest pose or goal that a viewer has set, and clears it. Those that the run does
  /// not accept, that are not finite or lie more than 10 m outside the bounding box of the reported
  /// references are dropped.
  [[nodiscard]] std::optional<ReferencePose> consume_viewer_input();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::viewer
