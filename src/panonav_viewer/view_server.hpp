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

/// Input that a viewer may send to the run by a click on the map.
enum class ViewerInput {
  none,
  goal,  ///< goal position, without a heading
  pose,  ///< pose of the robot
};

struct ViewServerOptions {
  std::string address = "127.0.0.1";  ///< IPv4 address on which to listen
  int port = 0;                       ///< 0 .. 65535; 0: a free one
  std::string title = "panonav";      ///< of the page
  std::size_t max_viewers = 8;        ///< connected at a time; further ones are refused
  /// True if the run is a replay of a recording: it waits for the first viewer, then proceeds at
  /// the pace of its time stamps, and viewers may pause it, step it, and change its pace. Two
  /// seconds after the last viewer has left it continues without waiting.
  bool replay = false;
  ViewerInput takes = ViewerInput::none;  ///< accepted input; any other is refused
  /// Returns the picture (PNG or JPEG) of the reference `name`, empty if there is none; it is
  /// called on a separate thread and may be slow. If not set, viewers get no pictures of
  /// references.
  std::function<std::vector<std::uint8_t>(const std::string& name)> thumbnail;
};

/// Shows a run in browsers while it runs: a page over HTTP, moments as server-sent events, pictures
/// on request. The server's thread encodes each moment or picture once, when the first viewer
/// requests it. A slow viewer misses moments, but never delays a live run or other viewers.
/// References, edges, plan and the path so far are stored for viewers that connect later.
///
/// The address of the page contains a random token of 128 bits. Requests are refused if they lack
/// the token, come from a page of another origin, or use a host name other than "localhost" (DNS
/// rebinding).
class ViewServer {
 public:
  /// Starts to listen. Throws Error if address and port are not available, ContractError if the
  /// port is out of range.
  explicit ViewServer(const ViewServerOptions& options = {});
  /// Notifies viewers of the end of the run; connected viewers get 0.3 s to load the last pictures.
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  /// Returns the address to open in a browser: "http://127.0.0.1:41234/6f3a.../".
  [[nodiscard]] std::string url() const;
  /// Adds a moment of the run. In a live run it never waits: it moves the moment and stores its
  /// pose. In a replay it waits until the moment is due.
  void add(recordings::RunMoment moment);
  [[nodiscard]] std::size_t viewers() const;
  /// Returns the latest pose or goal that a viewer has set, and clears it. Input is dropped if the
  /// run does not accept it, if it is not finite, or if it is more than 10 m outside the bounding
  /// box of the references.
  [[nodiscard]] std::optional<ReferencePose> consume_viewer_input();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::viewer
