#include "panonav_server/localisation_server.hpp"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav_server/access.hpp"
#include "panonav_server/http_server.hpp"
#include "panonav_server/internal/picture_request.hpp"
#include "panonav_server/json_answer.hpp"
#include "panonav_server/loaded_memory.hpp"
#include "panonav_server/metrics.hpp"
#include "panonav_server/place_json.hpp"
#include "panonav_server/upload_page.hpp"

namespace panonav::server {

namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

constexpr std::size_t max_picture_bytes = std::size_t{16} << 20U;
constexpr std::size_t max_in_flight_bytes = std::size_t{64} << 20U;
constexpr std::size_t max_waiting_bytes = std::size_t{128} << 20U;
/// Deadline of an answer, after which the client gets status 503 and should retry. It is longer
/// than a memory's server may be silent and than a full queue takes.
constexpr std::chrono::seconds request_deadline(30);
constexpr std::chrono::seconds time_for_last_answers(5);

bool is_valid_memory_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  });
}

}  // namespace

struct LocalisationServer::Implementation {
  /// A request to a memory; it is dropped when its client leaves.
  struct Job {
    std::string memory;
    std::string picture;  ///< to localise; empty: return thumbnail of `view`
    std::string view;
    std::optional<PictureSource> narrow_source;  ///< layout of a narrow picture
    Clock::time_point came = Clock::now();
    std::atomic<bool> answered = false;  ///< true once `answer` is set
    HttpAnswer answer;
  };
  /// A group of memories with its own threads: one lane for all memory files, and one for each
  /// memory on a server, because a server may be silent for a while.
  struct Lane {
    std::vector<std::string> memories;
    std::condition_variable came;  // notified of a job or the end
    std::deque<std::pair<std::weak_ptr<Job>, std::size_t>> waiting;
    std::size_t waiting_bytes = 0;
    std::vector<std::thread> workers;
    std::thread watcher;
  };

  Implementation(std::span<const ServedMemory> memories,
                 const LocalisationServerOptions& server_options)
      : options(server_options) {
    require(!memories.empty(), "memories", 0, "at least one");
    require(options.threads >= 0 && options.threads <= 1024, "threads", options.threads,
            "0 .. 1024");
    require(options.max_waiting >= 1, "max_waiting", 0, "at least 1");
    for (const ServedMemory& memory : memories) {
      if (!is_valid_memory_name(memory.name)) {
        throw ContractError("name of a memory", to_readable_line(memory.name),
                            "1 to 64 letters, digits, '-', '_' and '.'");
      }
      const auto [at, is_new] = served.try_emplace(memory.name);
      if (!is_new) {
        throw ContractError("name of a memory", memory.name, "a name that no other memory has");
      }
      at->second.memory = memory;
      at->second.watch.emplace(memory.path);
      at->second.loaded = std::make_shared<LoadedMemory>(memory.path, options);
      Lane& lane = is_server_address(memory.path) ? lanes.emplace_back() : lanes.front();
      lane.memories.push_back(memory.name);
      lane_by_memory[memory.name] = &lane;
    }
    const auto cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    server.emplace(
        HttpServerOptions{.address = options.address,
                          .port = options.port,
                          // Without a referrer, browsers would hide the origin of the form.
                          .headers = "X-Content-Type-Options: nosniff\r\n"
                                     "Referrer-Policy: same-origin\r\n"
                                     "Cross-Origin-Resource-Policy: same-origin\r\n"
                                     "Content-Security-Policy: " +
                                     std::string(page_policy) +
                                     "\r\n"
                                     "Cache-Control: no-store\r\n",
                          .max_body = max_picture_bytes,
                          .max_bodies = max_in_flight_bytes,
                          .judge_head = [this](const auto& head) { return check_access(head); },
                          .last_answers = time_for_last_answers},
        [this](HttpRequest request) { return answer(std::move(request)); });
    for (Lane& lane : lanes) {
      if (lane.memories.empty()) continue;
      for (int i = 0; i < (options.threads == 0 ? cores : options.threads); ++i) {
        lane.workers.emplace_back([this, &lane] { answer_jobs(lane); });
      }
      lane.watcher = std::thread([this, &lane] { watch(lane); });
    }
  }

  ~Implementation() {
    {
      const std::lock_guard lock(mutex);
      ending = true;
      last_answer = Clock::now() + time_for_last_answers;
    }
    ended.notify_all();
    for (Lane& lane : lanes) lane.came.notify_all();
    for (Lane& lane : lanes) {
      if (lane.watcher.joinable()) lane.watcher.join();
      for (std::thread& worker : lane.workers) worker.join();
    }
    server.reset();
  }

  // ---- on the HTTP thread

  HttpAnswer answer(HttpRequest request) {
    HttpAnswer result = dispatch(std::move(request));
    if (result.status >= 400) {
      const std::lock_guard lock(mutex);
      ++refused[result.status];
    }
    return result;
  }

  /// Refuses requests without a valid token or origin before their bodies are read. Everybody may
  /// read `/health`, but is not trusted for it.
  HeadVerdict check_access(const HttpRequest& head) {
    if (head.path == "/health") return {};
    auto refusal = find_refusal(head, options.token);
    if (!refusal) return {.is_trusted = true};
    const std::lock_guard lock(mutex);
    ++refused[refusal->status];
    return {.refusal = std::move(refusal)};
  }

  HttpAnswer dispatch(HttpRequest request) {
    constexpr std::string_view memories = "/v1/memories";
    const std::string_view path = request.path;
    if (path == "/health") {
      if (request.method != "GET") return make_error(405, "allowed: GET");
      const std::lock_guard lock(mutex);
      return make_json_answer({{"status", ending ? "ending" : "ok"}}, ending ? 503 : 200);
    }
    if (path == "/" && request.method == "POST") return answer_form(request);
    if (path == "/" && request.method == "GET" && accepts_html(request)) return make_page({}, "");
    if (path == "/metrics" || path == memories || path == "/" || path == "/page.css") {
      if (request.method != "GET") return make_error(405, "allowed: GET");
      if (path == "/page.css") {
        return {.type = "text/css; charset=utf-8", .content = std::string(upload_page_style())};
      }
      if (path == "/metrics") return metrics();
      return list();
    }
    if (!path.starts_with(memories) || path.size() < memories.size() + 2 ||
        path[memories.size()] != '/') {
      return make_error(404, "no such path; GET /v1/memories lists what there is");
    }
    const std::string_view rest = path.substr(memories.size() + 1);
    const std::size_t slash = std::min(rest.find('/'), rest.size());
    const std::string name(rest.substr(0, slash));
    const std::string_view below = rest.substr(slash);
    if (!served.contains(name)) {
      return make_error(404, "no memory " + name + "; GET /v1/memories lists those that there are");
    }
    if (below == "/localise") {
      if (request.method != "POST") return make_error(405, "allowed: POST, with a PNG or JPEG");
      if (request.body.empty()) return make_error(422, "the body is empty; allowed: a PNG or JPEG");
      try {
        return enqueue(name, std::move(request.body), "", read_narrow_source(request.arguments));
      } catch (const ContractError& error) {
        return make_error(400, error.what());
      }
    }
    if (request.method != "GET") return make_error(405, "allowed: GET");
    if (below.empty()) return make_json_answer(describe(name));
    constexpr std::string_view views = "/views/";
    constexpr std::string_view picture = "/picture";
    if (below.starts_with(views) && below.ends_with(picture) &&
        below.size() > views.size() + picture.size()) {
      const auto view =
          decode_percent(below.substr(views.size(), below.size() - views.size() - picture.size()));
      return enqueue(name, "", view.value_or(""));
    }
    return make_error(404, "no such path; allowed: localise and views/NAME/picture");
  }

  HttpAnswer enqueue(const std::string& name, std::string picture, std::string view,
                     std::optional<PictureSource> narrow_source = std::nullopt) {
    auto job = std::make_shared<Job>();
    job->memory = name;
    const std::size_t bytes = picture.size();
    job->picture = std::move(picture);
    job->view = std::move(view);
    job->narrow_source = std::move(narrow_source);
    Lane& lane = *lane_by_memory.at(name);
    {
      const std::lock_guard lock(mutex);
      if (ending || lane.waiting.size() >= options.max_waiting ||
          lane.waiting_bytes + bytes > max_waiting_bytes) {
        return make_error(
            503, ending ? "the server is ending" : "too many images wait; try again in a moment");
      }
      lane.waiting_bytes += bytes;
      lane.waiting.emplace_back(job, bytes);
    }
    lane.came.notify_one();
    return {.later = [job]() -> std::optional<HttpAnswer> {
      if (job->answered) return std::move(job->answer);
      if (Clock::now() < job->came + request_deadline) return std::nullopt;
      return make_error(503, "there was no answer in time; try again in a moment");
    }};
  }

  /// Returns the page with the answer to the image of its form.
  HttpAnswer answer_form(const HttpRequest& request) {
    auto form = read_upload_form(request.content_type, request.body);
    if (!form) return make_page(make_error(400, "the request is not the form of this page"), "");
    const std::string name = form->memory;
    if (!served.contains(name)) {
      return make_page(make_error(404, "there is no memory " + name), name);
    }
    if (form->picture.empty()) {
      return make_page(make_error(422, "no image was chosen; choose a PNG or JPEG file"), name);
    }
    HttpAnswer answer = enqueue(name, std::move(form->picture), "");
    if (!answer.later) return make_page(answer, name);
    return {.later = [this, name, later = std::move(answer.later)]() -> std::optional<HttpAnswer> {
      const auto found = later();
      return found ? std::optional(make_page(*found, name)) : std::nullopt;
    }};
  }

  /// Returns the page with the JSON of an answer in words.
  HttpAnswer make_page(const HttpAnswer& shown, const std::string& memory) const {
    std::vector<PageMemory> memories;
    for (const auto& [name, one] : served)
      memories.push_back({name, loaded(name)->recogniser.size()});
    return {.status = shown.status,
            .type = "text/html; charset=utf-8",
            .content = make_upload_page(memories, memory, shown.content)};
  }

  HttpAnswer list() {
    auto found = ordered_json::array();
    for (const auto& [name, one] : served) found.push_back(describe(name));
    return make_json_answer({{"memories", std::move(found)}});
  }

  [[nodiscard]] std::shared_ptr<LoadedMemory> loaded(const std::string& name) const {
    const std::lock_guard lock(mutex);
    return served.at(name).loaded;
  }

  [[nodiscard]] ordered_json describe(const std::string& name) const {
    const auto memory = loaded(name);
    const SignatureShape& shape = memory->shape;
    return {{"name", name},
            {"views", memory->recogniser.size()},
            {"rows", shape.rows},
            {"components", shape.components}};
  }

  HttpAnswer metrics() const {
    const std::lock_guard lock(mutex);
    std::string text = describe_metric("panonav_localisations_total", "counter",
                                       "Images that were answered, by memory and answer.");
    for (const auto& [name, one] : served) {
      const std::string memory = "panonav_localisations_total{memory=\"" + name + "\",answer=\"";
      text += memory + "known\"} " + std::to_string(one.known) + "\n";
      text += memory + "unknown\"} " + std::to_string(one.unknown) + "\n";
    }
    text += describe_metric("panonav_refused_total", "counter",
                            "Requests that got an error, by status.");
    for (const auto& [status, times] : refused) {
      text += "panonav_refused_total{status=\"" + std::to_string(status) + "\"} " +
              std::to_string(times) + "\n";
    }
    text += describe_metric("panonav_localisation_seconds", "histogram",
                            "Time in which an image was decoded and answered.") +
            answer_times.text("panonav_localisation_seconds");
    text += describe_metric("panonav_waiting_seconds", "histogram",
                            "Time for which an image waited for a thread.") +
            queue_times.text("panonav_waiting_seconds");
    std::size_t waiting = 0;
    for (const Lane& lane : lanes) waiting += lane.waiting.size();
    text += describe_metric("panonav_waiting", "gauge", "Images that wait for a thread.") +
            "panonav_waiting " + std::to_string(waiting) + "\n";
    text += describe_memories(served);
    text += describe_metric("process_resident_memory_bytes", "gauge",
                            "Memory that the process holds.") +
            "process_resident_memory_bytes " + std::to_string(resident_bytes()) + "\n";
    return {.type = "text/plain; version=0.0.4; charset=utf-8", .content = std::move(text)};
  }

  // ---- on the worker threads

  void answer_jobs(Lane& lane) {
    std::unique_lock lock(mutex);
    while (true) {
      lane.came.wait(lock, [&] { return ending || !lane.waiting.empty(); });
      if (lane.waiting.empty()) return;  // the server is ending
      const auto job = lane.waiting.front().first.lock();
      lane.waiting_bytes -= lane.waiting.front().second;
      lane.waiting.pop_front();
      if (!job) continue;  // its client has gone
      const auto from = Clock::now();
      Served& one = served.at(job->memory);
      const bool is_picture = !job->picture.empty();
      bool known = false;
      HttpAnswer answer;
      if (ending && from > last_answer) {
        answer = make_error(503, "the server is ending");
      } else if (job->came < one.failed) {
        // Otherwise each job would wait for the silent server in turn.
        answer = make_error(503, describe_unreadable(job->memory));
      } else {
        if (is_picture) queue_times.add(from - job->came);
        const std::shared_ptr<LoadedMemory> memory = one.loaded;
        lock.unlock();
        answer = is_picture ? localise(*job, *memory, known) : thumbnail(*job, *memory);
        lock.lock();
      }
      if (answer.status >= 400) {
        ++refused[answer.status];
      } else if (is_picture) {
        answer_times.add(Clock::now() - from);
        ++(known ? one.known : one.unknown);
      }
      job->answer = std::move(answer);
      job->answered = true;
      server->wake_up();
    }
  }

  HttpAnswer localise(const Job& job, const LoadedMemory& memory, bool& known) {
    std::optional<Observation> observation;
    try {
      observation = decode_observation(job.picture, job.narrow_source);
    } catch (const Error& error) {
      return make_error(422, error.what());
    } catch (const std::exception&) {
      return make_error(500, "the image cannot be decoded");
    }
    try {
      const Place place = memory.recogniser.localise(*observation);
      known = place.known;
      ordered_json json{{"memory", job.memory}};
      json.update(place_json(place));
      rename_lengths(json, memory.unit);
      return make_json_answer(json);
    } catch (const FileError& error) {
      return make_memory_error(503, job.memory, error);
    } catch (const Error& error) {
      return make_error(422, error.what());
    } catch (const std::exception& error) {
      return make_memory_error(500, job.memory, error);
    }
  }

  HttpAnswer thumbnail(const Job& job, LoadedMemory& memory) {
    bool is_silent = memory.is_on_server;
    try {
      const auto picture = memory.thumbnail(job.view);
      is_silent = false;
      if (!picture) return make_error(404, "the memory has no view of that name with an image");
      const bool jpeg = image_format(*picture, "the image") == ImageFormat::jpeg;
      return {.type = jpeg ? "image/jpeg" : "image/png",
              .content = std::string(picture->begin(), picture->end())};
    } catch (const std::exception& error) {
      return make_memory_error(is_silent ? 503 : 500, job.memory, error);
    }
  }

  /// Reports the fault to the operator only, because it may contain addresses, which clients must
  /// not learn.
  HttpAnswer make_memory_error(int status, const std::string& name, const std::exception& error) {
    report_loss(name, to_readable_line(error.what()));
    const std::lock_guard lock(mutex);
    // Only 503 concerns the whole memory; other errors concern this one request.
    if (status == 503) served.at(name).failed = Clock::now();
    return make_error(status, describe_unreadable(name));
  }
  static std::string describe_unreadable(const std::string& name) {
    return "the memory " + name + " cannot be read now; try again in a moment";
  }

  /// Reports to `options.note` that a memory cannot be read, only once until it can be read again.
  /// Returns true if it reported.
  bool report_loss(const std::string& name, const std::string& fault) {
    {
      const std::lock_guard lock(mutex);
      if (std::exchange(served.at(name).is_lost, true)) return false;
    }
    if (options.note)
      options.note(name + ": the memory cannot be read; what was loaded stays: " + fault);
    return true;
  }

  // ---- on the watcher thread of a lane, which reloads changed memories

  void watch(Lane& lane) {
    std::chrono::milliseconds pause = options.poll_interval;
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, pause, [this] { return ending; })) {
      pause = options.poll_interval;
      for (const std::string& name : lane.memories) {
        if (ending) return;
        lock.unlock();
        const auto from = Clock::now();
        // A memory that changes all the time must leave time for answers.
        if (update(name)) {
          pause = std::max(pause, std::chrono::duration_cast<std::chrono::milliseconds>(
                                      10 * (Clock::now() - from)));
        }
        lock.lock();
      }
    }
  }

  /// Reloads a memory if it has changed. Returns true if it was reloaded, or that failed.
  bool update(const std::string& name) {
    Served& one = served.at(name);
    std::string fault;
    std::shared_ptr<LoadedMemory> again;
    const auto now = loaded(name);
    try {
      if (!now->recogniser.is_memory_held()) {
        if (now->recogniser.refresh()) again = now;
      } else if (one.watch->has_changed()) {
        again = std::make_shared<LoadedMemory>(one.memory.path, options);
      }
    } catch (const std::exception& error) {
      fault = to_readable_line(error.what());
    }
    if (!fault.empty() && !report_loss(name, fault)) return true;
    if (again && options.note) {
      options.note(name + ": reloaded; " + format_count(again->recogniser.size(), "view"));
    }
    const std::lock_guard lock(mutex);
    one.is_lost = !fault.empty();
    if (!again && fault.empty()) return false;
    ++(again ? one.reloads : one.failed_reloads);
    if (again) one.loaded.swap(again);
    return true;
  }

  const LocalisationServerOptions options;
  mutable std::mutex mutex;
  std::condition_variable ended;         // notified at the end, for the watchers
  std::map<std::string, Served> served;  // keys are fixed; only watchers use `watch`
  std::list<Lane> lanes{1};              // the first has all memory files
  std::map<std::string, Lane*> lane_by_memory;
  std::map<int, std::uint64_t> refused;
  Histogram answer_times;
  Histogram queue_times;
  bool ending = false;
  Clock::time_point last_answer;  // deadline once it is ending
  std::optional<HttpServer> server;
};

LocalisationServer::LocalisationServer(std::span<const ServedMemory> memories,
                                       const LocalisationServerOptions& options)
    : implementation_(std::make_unique<Implementation>(memories, options)) {}

LocalisationServer::~LocalisationServer() = default;

std::string LocalisationServer::url() const {
  return "http://" + implementation_->options.address + ":" +
         std::to_string(implementation_->server->port());
}

}  // namespace panonav::server
