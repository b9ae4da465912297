#include "panonav_viewer/view_server.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <future>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_server/http_server.hpp"
#include "panonav_viewer/moment_json.hpp"
#include "panonav_viewer/page.hpp"
#include "panonav_viewer/reference_pictures.hpp"

namespace panonav::viewer {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto answer_headers =
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n"
    "Content-Security-Policy: default-src 'self'; script-src 'unsafe-inline' data:; "
    "style-src 'unsafe-inline'; img-src 'self' blob: data:; frame-ancestors 'none'\r\n"
    "Cache-Control: no-store\r\n";

std::string make_random_token() {
  std::random_device device;
  std::string text;
  for (int i = 0; i < 32; ++i) text += "0123456789abcdef"[device() & 15U];
  return text;
}

std::optional<std::size_t> parse_index(std::string_view text) {
  std::size_t number = 0;
  return read_number(text, number) ? std::optional(number) : std::nullopt;
}

std::string_view to_string(ViewerInput wish) {
  switch (wish) {
    case ViewerInput::goal:
      return "goal";
    case ViewerInput::pose:
      return "pose";
    case ViewerInput::none:
      break;
  }
  return "";
}

/// A moment for viewers: its JSON and pictures are encoded once, on the server's thread.
class Frame {
 public:
  Frame(recordings::RunMoment moment, std::size_t number)
      : moment_(std::move(moment)), number_(number) {}

  [[nodiscard]] std::size_t number() const noexcept { return number_; }
  /// Returns the size of its pictures in bytes.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return moment_.encoded_picture.size() +
           (moment_.picture ? moment_.picture->pixels().size() : 0) +
           (moment_.panorama ? moment_.panorama->values().size_bytes() : 0);
  }
  const std::string& json() {
    if (json_.empty()) json_ = moment_to_json(moment_, number_);
    return json_;
  }
  /// Returns the JPEG or PNG of "camera", "panorama" or "best"; empty if there is none.
  const std::string& picture(const std::string& which) {
    const auto found = pictures_.find(which);
    return found != pictures_.end() ? found->second : pictures_[which] = encode_picture(which);
  }

 private:
  [[nodiscard]] std::string encode_picture(const std::string& which) {
    std::vector<std::uint8_t> bytes;
    if (which == "best") {
      if (!moment_.best_match.empty()) return reencode_as_jpeg(moment_.best_match);
    } else if (which == "panorama" && moment_.panorama) {
      const Image image = to_picture(*moment_.panorama);
      bytes = encode_jpeg(image.view());
    } else if (which == "camera" && moment_.picture) {
      bytes = encode_jpeg(moment_.picture->view());
    } else if (which == "camera") {
      bytes = moment_.encoded_picture;
    }
    return {bytes.begin(), bytes.end()};
  }

  const recordings::RunMoment moment_;
  const std::size_t number_;
  std::string json_;
  std::map<std::string, std::string> pictures_;
};

std::string format_event(const std::string& name, const std::string& data) {
  return "event: " + name + "\ndata: " + data + "\n\n";
}

}  // namespace

struct ViewServer::Implementation {
  explicit Implementation(const ViewServerOptions& server_options)
      : options(server_options),
        token(make_random_token()),
        page(live_page(options.title, options.replay, to_string(options.takes))),
        entrance(entrance_page()),
        server({.address = options.address,
                .port = options.port,
                .headers = answer_headers,
                .judge_head = [this](const auto& head) { return verify_request(head); }},
               [this](const server::HttpRequest& request) { return answer(request); }) {}

  ~Implementation() {
    reference_pictures.stop();
    std::unique_lock lock(mutex);
    ended = true;
    if (viewer_count == 0) return;
    server.wake_up();
    changed.wait_for(lock, std::chrono::seconds(1), [this] { return viewer_count == 0; });
    lock.unlock();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }

  /// Refuses requests without the token or from another origin.
  [[nodiscard]] server::HeadVerdict verify_request(const server::HttpRequest& head) const {
    if (head.path.starts_with('/') && server::is_same_origin(head) &&
        server::is_same_secret(std::string_view(head.path).substr(1, token.size()), token)) {
      return {.is_trusted = true};
    }
    // Who opens the address without its secret part, or with a part of it, reads what to do.
    if (head.method == "GET" && server::is_same_origin(head)) {
      return {.refusal = server::HttpAnswer{
                  .status = 404, .type = "text/html; charset=utf-8", .content = entrance}};
    }
    return {.refusal = server::HttpAnswer{.status = 404}};
  }

  [[nodiscard]] server::HttpAnswer answer(const server::HttpRequest& request) {
    const auto make_status_answer = [](int status) { return server::HttpAnswer{.status = status}; };
    const std::string_view resource = std::string_view(request.path).substr(1 + token.size());
    if ((options.replay || options.takes != ViewerInput::none) && resource == "/control") {
      if (request.method != "POST") return make_status_answer(405);
      return make_status_answer(handle_control(request.body) ? 204 : 400);
    }
    if (request.method != "GET") return make_status_answer(405);
    if (resource == "/") return {.type = "text/html; charset=utf-8", .content = page};
    if (resource == "/events") return events();
    constexpr std::string_view views = "/view/";
    if (resource.starts_with(views)) {
      const auto number = parse_index(resource.substr(views.size()));
      return number ? reference(*number) : make_status_answer(404);
    }
    constexpr std::string_view pictures = "/picture/";
    if (!resource.starts_with(pictures)) return make_status_answer(404);
    const std::string_view rest = resource.substr(pictures.size());
    const std::size_t slash = rest.find('/');
    const auto number = parse_index(rest.substr(0, slash));
    if (slash == std::string_view::npos || !number) return make_status_answer(404);
    return picture(*number, std::string(rest.substr(slash + 1)));
  }

  /// Returns the picture of a reference by its index among the references sent.
  [[nodiscard]] server::HttpAnswer reference(std::size_t number) {
    std::string name;
    {
      const std::lock_guard lock(mutex);
      const auto& known = retained.moment.reference_views;
      if (!options.thumbnail || number >= known.size()) return {.status = 404};
      name = known[number].name;
    }
    auto started = reference_pictures.read(std::move(name), [this] { server.wake_up(); });
    if (!started) return {.status = 503};
    const auto picture = std::make_shared<std::future<std::string>>(std::move(*started));
    return {.later = [picture]() -> std::optional<server::HttpAnswer> {
      if (picture->wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
        return std::nullopt;
      }
      std::string bytes;
      try {
        bytes = picture->get();
      } catch (const std::exception&) {  // no memory, invalid picture, or the viewer ends
        return server::HttpAnswer{.status = 500};
      }
      if (bytes.empty()) return server::HttpAnswer{.status = 404};
      return server::HttpAnswer{.type = "image/jpeg", .content = std::move(bytes)};
    }};
  }

  [[nodiscard]] server::HttpAnswer picture(std::size_t number, const std::string& which) {
    std::shared_ptr<Frame> frame;
    {
      const std::lock_guard lock(mutex);
      const auto found = std::ranges::find_if(
          frames, [number](const auto& kept) { return kept->number() == number; });
      if (found != frames.end()) frame = *found;
    }
    const std::string* const bytes = frame ? &frame->picture(which) : nullptr;
    if (bytes == nullptr || bytes->empty()) return {.status = 404};
    return {.type = bytes->starts_with("\x89PNG") ? "image/png" : "image/jpeg", .content = *bytes};
  }

  /// Sends the events to one viewer while it is connected.
  class Viewer {
   public:
    explicit Viewer(Implementation& all) : all_(all) {
      {
        const std::lock_guard lock(all.mutex);
        ++all.viewer_count;
      }
      all.changed.notify_all();
    }
    ~Viewer() {
      {
        const std::lock_guard lock(all_.mutex);
        --all_.viewer_count;
        all_.last_disconnected = Clock::now();
      }
      all_.changed.notify_all();
    }
    Viewer(const Viewer&) = delete;
    Viewer& operator=(const Viewer&) = delete;

    std::optional<std::string> more() {
      if (sent_end_) return std::nullopt;
      std::string text;
      std::vector<std::shared_ptr<Frame>> unsent;
      {
        const std::lock_guard lock(all_.mutex);
        if (!greeted_) {
          text = "retry: 500\n" + format_event("past", moments_to_json(all_.past));
          if (!all_.frames.empty()) next_ = all_.frames.back()->number();
          greeted_ = true;
        }
        if (retained_ != all_.retained.replacement_count) {
          text += format_event("retained", retained_to_json(all_.retained.moment));
          retained_ = all_.retained.replacement_count;
        }
        for (const auto& frame : all_.frames) {
          if (frame->number() >= next_) unsent.push_back(frame);
        }
        sent_end_ = all_.ended;
      }
      for (const auto& frame : unsent) {
        text += format_event("moment", frame->json());
        next_ = frame->number() + 1;
      }
      if (sent_end_) text += format_event("ended", "{}");
      const auto now = Clock::now();
      // A comment line detects viewers that left without closing the connection.
      if (text.empty() && now - last_sent_ > std::chrono::seconds(2)) text = ": still there\n\n";
      if (!text.empty()) last_sent_ = now;
      return text;
    }

   private:
    Implementation& all_;
    bool greeted_ = false;
    bool sent_end_ = false;
    std::size_t next_ = 0;      // index of the next frame to send
    std::size_t retained_ = 0;  // as of `RetainedParts::times`
    Clock::time_point last_sent_ = Clock::now();
  };

  [[nodiscard]] server::HttpAnswer events() {
    if (viewer_count >= options.max_viewers) return {.status = 503};
    return {.type = "text/event-stream",
            .more = [viewer = std::make_shared<Viewer>(*this)] { return viewer->more(); }};
  }

  /// Handles a control message: {"play": true or false}, {"step": 1} or {"speed": 2} of a replay;
  /// {"goal": [x, y]} or {"pose": [x, y, heading or null]} if the run accepts it. Returns false for
  /// any other message.
  bool handle_control(const std::string& text) {
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object()) return false;
    const std::lock_guard lock(mutex);
    if (json.contains("goal") || json.contains("pose")) return take(json);
    if (!options.replay) return false;
    const auto speed = json.value("speed", nlohmann::json(pace.speed));
    const auto playing = json.value("play", nlohmann::json(pace.playing));
    const auto steps = json.value("step", nlohmann::json(0U));
    constexpr double min_speed = 0.1;
    constexpr double max_speed = 100.0;
    if (!speed.is_number() || speed < min_speed || speed > max_speed || !playing.is_boolean() ||
        !steps.is_number_unsigned() || steps > 1000U) {
      return false;
    }
    pace.speed = speed;
    pace.playing = playing;
    pace.steps += steps.get<std::size_t>();
    changed.notify_all();
    return true;
  }

  /// Stores a goal or pose that a viewer sent as the only member of its message; returns false if
  /// it is invalid or not accepted.
  bool take(const nlohmann::json& json) {
    const std::string key(to_string(options.takes));
    if (key.empty() || json.size() != 1 || !json.contains(key)) return false;
    const auto& values = json[key];
    const std::size_t size = options.takes == ViewerInput::pose ? 3 : 2;
    if (!values.is_array() || values.size() != size) return false;
    ReferencePose pose;
    if (!values[0].is_number() || !values[1].is_number()) return false;
    pose.x_m = values[0].get<double>();
    pose.y_m = values[1].get<double>();
    if (size == 3 && !values[2].is_null()) {
      if (!values[2].is_number()) return false;
      pose.heading_rad = values[2].get<double>();
      constexpr double max_heading = 6.3;  // slightly above one full turn, 2 pi
      if (!(std::abs(*pose.heading_rad) <= max_heading)) return false;
    }
    const auto& known = retained.moment.references;
    if (known.empty()) return false;
    constexpr double margin_m = 10.0;
    const auto is_near = [&](double value, double Point2::*axis) {
      const auto [low, high] = std::ranges::minmax(known, {}, axis);
      return value >= low.*axis - margin_m && value <= high.*axis + margin_m;
    };
    if (!is_near(pose.x_m, &Point2::x_m) || !is_near(pose.y_m, &Point2::y_m)) return false;
    wish = pose;
    return true;
  }

  /// Returns when the moment with this time stamp is due.
  void wait_for_turn(std::unique_lock<std::mutex>& lock, double stamp_s) {
    // Time stamps may jump, as in recordings of two days or when a clock is set back.
    constexpr double max_gap_s = 2.0;
    constexpr auto reload_grace = std::chrono::seconds(2);  // a page being reloaded is back by then
    if (!pace.last_s) changed.wait(lock, [this] { return viewer_count > 0; });
    const double gap_s = pace.last_s ? std::clamp(stamp_s - *pace.last_s, 0.0, max_gap_s) : 0.0;
    pace.last_s = stamp_s;
    while (pace.steps == 0) {
      const auto due = pace.released + std::chrono::duration_cast<Clock::duration>(
                                           std::chrono::duration<double>(gap_s / pace.speed));
      const auto now = Clock::now();
      const bool has_no_viewer = viewer_count == 0;
      if ((pace.playing && now >= due) ||
          (has_no_viewer && now >= last_disconnected + reload_grace))
        break;
      if (pace.playing && !has_no_viewer) {
        changed.wait_until(lock, due);
      } else if (has_no_viewer) {
        changed.wait_until(lock, pace.playing ? std::min(due, last_disconnected + reload_grace)
                                              : last_disconnected + reload_grace);
      } else {
        changed.wait(lock);
      }
    }
    if (pace.steps > 0) --pace.steps;
    if (viewer_count == 0 && !pace.playing) pace.playing = true;  // the viewer that paused has left
    pace.released = Clock::now();
  }

  void add(recordings::RunMoment moment) {
    {
      std::unique_lock lock(mutex);
      if (options.replay) wait_for_turn(lock, moment.stamp_s);
      past.push_back({moment.stamp_s, moment.pose,
                      moment.truth ? std::optional(moment.truth->position()) : std::nullopt,
                      moment.probability, moment.sure, moment.state});
      // Drop every second moment of a long run whenever the list is full.
      constexpr std::size_t max_past = 4096;
      if (past.size() == max_past) {
        for (std::size_t i = 1; 2 * i < past.size(); ++i) past[i] = std::move(past[2 * i]);
        past.resize(max_past / 2);
      }
      retained.update_from(moment);
      frames.push_back(std::make_shared<Frame>(std::move(moment), number++));
      kept_bytes += frames.back()->bytes();
      // Keep some frames, because a viewer requests the pictures of a moment some time after its
      // event.
      const std::size_t max_frames = viewer_count > 0 ? 16 : 1;
      constexpr std::size_t max_bytes = 64U << 20U;
      while (frames.size() > max_frames || (frames.size() > 1 && kept_bytes > max_bytes)) {
        kept_bytes -= frames.front()->bytes();
        frames.pop_front();
      }
      if (viewer_count == 0) return;
    }
    server.wake_up();
  }

  const ViewServerOptions options;
  const std::string token;
  const std::string page;
  const std::string entrance;
  std::atomic<std::size_t> viewer_count = 0;  // changed only under the mutex
  std::mutex mutex;                           // guards the following members up to the server
  std::condition_variable changed;
  std::deque<std::shared_ptr<Frame>> frames;
  std::size_t kept_bytes = 0;  // size of the pictures in all frames
  std::vector<PastMoment> past;
  RetainedParts retained;
  std::optional<ReferencePose> wish;
  struct {
    bool playing = true;
    double speed = 1.0;
    std::size_t steps = 0;
    std::optional<double> last_s;  // stamp of the previous moment
    Clock::time_point released;
  } pace;
  Clock::time_point last_disconnected;  // when the last viewer disconnected
  std::size_t number = 0;
  bool ended = false;
  ReferencePictures reference_pictures{options.thumbnail};
  server::HttpServer server;  // last, because its thread uses the other members
};

ViewServer::ViewServer(const ViewServerOptions& options)
    : implementation_(std::make_unique<Implementation>(options)) {}

ViewServer::~ViewServer() = default;

std::string ViewServer::url() const {
  return "http://" + implementation_->options.address + ":" +
         std::to_string(implementation_->server.port()) + "/" + implementation_->token + "/";
}

void ViewServer::add(recordings::RunMoment moment) {
  implementation_->add(std::move(moment));
}

std::optional<ReferencePose> ViewServer::consume_viewer_input() {
  const std::lock_guard lock(implementation_->mutex);
  return std::exchange(implementation_->wish, std::nullopt);
}

std::size_t ViewServer::viewers() const {
  return implementation_->viewer_count;
}

}  // namespace panonav::viewer
