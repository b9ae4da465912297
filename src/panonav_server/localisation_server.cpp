#include "panonav_server/localisation_server.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_server/http_server.hpp"
#include "panonav_server/loaded_memory.hpp"
#include "panonav_server/metrics.hpp"
#include "panonav_server/place_json.hpp"

namespace panonav::server {

namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

constexpr std::size_t max_picture_bytes = std::size_t{16} << 20U;
constexpr std::size_t max_in_flight_bytes = std::size_t{64} << 20U;
constexpr std::size_t max_waiting_bytes = std::size_t{128} << 20U;
constexpr ImageLimits picture_limits{
    .side_px = 16384, .area_px = 33'554'432, .scanned_px = std::int64_t{16} * 33'554'432};

bool is_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  });
}

/// Empty where the text is no name.
std::string decode_percent(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    unsigned value = 0;
    const std::string_view digits = text.substr(i + 1, 2);
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    if (digits.size() != 2 || error != std::errc() || end != digits.data() + 2) return {};
    decoded += static_cast<char>(value);
    i += 2;
  }
  return decoded;
}

HttpAnswer make_json_answer(const ordered_json& document, int status = 200) {
  return {.status = status,
          .type = "application/json",
          .content = document.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n"};
}

HttpAnswer make_refusal(int status, std::string_view why) {
  return make_json_answer({{"error", to_readable_line(std::string(why))}}, status);
}

}  // namespace

struct LocalisationServer::Implementation {
  /// A picture that waits for its answer, as long as its client does.
  struct Job {
    std::string memory;
    std::string picture;
    Clock::time_point came = Clock::now();
    std::atomic<bool> answered = false;  ///< then `answer` is there
    HttpAnswer answer;
  };

  Implementation(std::span<const ServedMemory> memories,
                 const LocalisationServerOptions& server_options)
      : options(server_options) {
    require(!memories.empty(), "memories", 0, "at least one");
    require(options.threads >= 0 && options.threads <= 1024, "threads", options.threads,
            "0 .. 1024");
    require(options.max_waiting >= 1, "max_waiting", 0, "at least 1");
    for (const ServedMemory& memory : memories) {
      if (!is_name(memory.name)) {
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
    }
    const auto cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    server.emplace(HttpServerOptions{.address = options.address,
                                     .port = options.port,
                                     .headers = "X-Content-Type-Options: nosniff\r\n"
                                                "Referrer-Policy: no-referrer\r\n"
                                                "Cross-Origin-Resource-Policy: same-origin\r\n"
                                                "Content-Security-Policy: default-src 'none'; "
                                                "frame-ancestors 'none'\r\n"
                                                "Cache-Control: no-store\r\n",
                                     .max_body = max_picture_bytes,
                                     .max_bodies = max_in_flight_bytes,
                                     .judge_head = [this](const auto& head) { return judge(head); },
                                     .last_answers = std::chrono::seconds(5)},
                   [this](HttpRequest request) { return answer(std::move(request)); });
    for (int i = 0; i < (options.threads == 0 ? cores : options.threads); ++i) {
      workers.emplace_back([this] { work(); });
    }
    watcher = std::thread([this] { watch(); });
  }

  ~Implementation() {
    {
      const std::lock_guard lock(mutex);
      ending = true;
    }
    came.notify_all();
    ended.notify_all();
    watcher.join();
    for (std::thread& worker : workers) worker.join();
    server.reset();
  }

  // ---- on the thread that speaks HTTP

  HttpAnswer answer(HttpRequest request) {
    HttpAnswer result = answer_to(std::move(request));
    if (result.status >= 400) {
      const std::lock_guard lock(mutex);
      ++refused[result.status];
    }
    return result;
  }

  /// Refuses strangers before their bodies are read. `/health` is for everybody and earns no trust.
  HeadVerdict judge(const HttpRequest& head) {
    if (head.path == "/health") return {};
    std::optional<HttpAnswer> refusal;
    if (options.token.empty()) {
      if (!is_own_page(head)) {
        refusal = make_refusal(403,
                               "without a token this server answers programs that call it by its "
                               "number or as localhost");
      }
    } else {
      constexpr std::string_view bearer = "Bearer ";
      const std::string_view sent = head.authorization;
      if (!sent.starts_with(bearer) || !is_same_secret(sent.substr(bearer.size()), options.token)) {
        refusal =
            make_refusal(401, "the token of this server is missing: Authorization: Bearer TOKEN");
      }
    }
    if (!refusal) return {.is_trusted = true};
    const std::lock_guard lock(mutex);
    ++refused[refusal->status];
    return {.refusal = std::move(refusal)};
  }

  HttpAnswer answer_to(HttpRequest request) {
    constexpr std::string_view memories = "/v1/memories";
    const std::string_view path = request.path;
    if (path == "/health") {
      if (request.method != "GET") return make_refusal(405, "allowed: GET");
      const std::lock_guard lock(mutex);
      return make_json_answer({{"status", ending ? "ending" : "ok"}}, ending ? 503 : 200);
    }
    if (path == "/metrics" || path == memories || path == "/") {
      if (request.method != "GET") return make_refusal(405, "allowed: GET");
      if (path == "/metrics") return metrics();
      return list();
    }
    if (!path.starts_with(memories) || path.size() < memories.size() + 2 ||
        path[memories.size()] != '/') {
      return make_refusal(404, "no such path; GET /v1/memories lists what there is");
    }
    const std::string_view rest = path.substr(memories.size() + 1);
    const std::size_t slash = std::min(rest.find('/'), rest.size());
    const std::string name(rest.substr(0, slash));
    const std::string_view below = rest.substr(slash);
    {
      const std::lock_guard lock(mutex);
      if (!served.contains(name)) {
        return make_refusal(404,
                            "no memory " + name + "; GET /v1/memories lists those that there are");
      }
    }
    if (below == "/localise") {
      if (request.method != "POST") return make_refusal(405, "allowed: POST, with a PNG or JPEG");
      return enqueue(name, std::move(request.body));
    }
    if (request.method != "GET") return make_refusal(405, "allowed: GET");
    if (below.empty()) return make_json_answer(describe(name));
    constexpr std::string_view views = "/views/";
    constexpr std::string_view picture = "/picture";
    if (below.starts_with(views) && below.ends_with(picture) &&
        below.size() > views.size() + picture.size()) {
      return thumbnail(name, decode_percent(below.substr(
                                 views.size(), below.size() - views.size() - picture.size())));
    }
    return make_refusal(404, "no such path; allowed: localise and views/NAME/picture");
  }

  HttpAnswer enqueue(const std::string& name, std::string picture) {
    auto job = std::make_shared<Job>();
    job->memory = name;
    const std::size_t bytes = picture.size();
    job->picture = std::move(picture);
    {
      const std::lock_guard lock(mutex);
      if (ending || waiting.size() >= options.max_waiting ||
          waiting_bytes + bytes > max_waiting_bytes) {
        return make_refusal(
            503, ending ? "the server is ending" : "too many pictures wait; try again in a moment");
      }
      waiting_bytes += bytes;
      waiting.emplace_back(job, bytes);
    }
    came.notify_one();
    return {.later = [job]() -> std::optional<HttpAnswer> {
      if (!job->answered) return std::nullopt;
      return std::move(job->answer);
    }};
  }

  HttpAnswer list() {
    std::vector<std::string> names;
    {
      const std::lock_guard lock(mutex);
      for (const auto& [name, one] : served) names.push_back(name);
    }
    auto found = ordered_json::array();
    for (const std::string& name : names) found.push_back(describe(name));
    return make_json_answer({{"memories", std::move(found)}});
  }

  [[nodiscard]] std::shared_ptr<LoadedMemory> loaded(const std::string& name) const {
    const std::lock_guard lock(mutex);
    return served.at(name).loaded;
  }

  [[nodiscard]] ordered_json describe(const std::string& name) const {
    const auto memory = loaded(name);
    const SignatureShape& shape = memory->file.header().shape;
    return {{"name", name},
            {"views", memory->recogniser.size()},
            {"rows", shape.rows},
            {"components", shape.components}};
  }

  [[nodiscard]] HttpAnswer thumbnail(const std::string& name, const std::string& view) const {
    const auto memory = loaded(name);
    try {
      const auto picture = memory->thumbnail(view);
      if (!picture) return make_refusal(404, "the memory has no view of that name with a picture");
      const bool jpeg = image_format(*picture, "the picture") == ImageFormat::jpeg;
      return {.type = jpeg ? "image/jpeg" : "image/png",
              .content = std::string(picture->begin(), picture->end())};
    } catch (const Error& error) {
      return make_refusal(500, error.what());
    }
  }

  HttpAnswer metrics() const {
    const std::lock_guard lock(mutex);
    std::string text = describe_metric("panonav_localisations_total", "counter",
                                       "Pictures that were answered, by memory and answer.");
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
                            "Time in which a picture was decoded and answered.") +
            answering.text("panonav_localisation_seconds");
    text += describe_metric("panonav_waiting_seconds", "histogram",
                            "Time for which a picture waited for a thread.") +
            queueing.text("panonav_waiting_seconds");
    text += describe_metric("panonav_waiting", "gauge", "Pictures that wait for a thread.") +
            "panonav_waiting " + std::to_string(waiting.size()) + "\n";
    text += describe_memories(served);
    text += describe_metric("process_resident_memory_bytes", "gauge",
                            "Memory that the process holds.") +
            "process_resident_memory_bytes " + std::to_string(resident_bytes()) + "\n";
    return {.type = "text/plain; version=0.0.4; charset=utf-8", .content = std::move(text)};
  }

  // ---- on the threads that answer

  void work() {
    std::unique_lock lock(mutex);
    while (true) {
      came.wait(lock, [this] { return ending || !waiting.empty(); });
      if (waiting.empty()) return;  // and it is ending
      const auto job = waiting.front().first.lock();
      waiting_bytes -= waiting.front().second;
      waiting.pop_front();
      if (!job) continue;  // its client has gone
      const auto from = Clock::now();
      queueing.add(from - job->came);
      const std::shared_ptr<LoadedMemory> memory = served.at(job->memory).loaded;
      lock.unlock();
      bool known = false;
      HttpAnswer answer = localise(*job, *memory, known);
      lock.lock();
      if (answer.status == 200) {
        answering.add(Clock::now() - from);
        Served& one = served.at(job->memory);
        ++(known ? one.known : one.unknown);
      } else {
        ++refused[answer.status];
      }
      job->answer = std::move(answer);
      job->answered = true;
      server->poke();
    }
  }

  static HttpAnswer localise(const Job& job, const LoadedMemory& memory, bool& known) {
    bool decoded = false;
    try {
      const auto* const bytes = reinterpret_cast<const std::uint8_t*>(job.picture.data());
      const Observation observation(
          decode_image(std::span(bytes, job.picture.size()), "the picture", picture_limits));
      decoded = true;
      const Place place = memory.recogniser.localise(observation);
      known = place.known;
      ordered_json json{{"memory", job.memory}};
      json.update(place_json(place));
      return make_json_answer(json);
    } catch (const FileError& error) {  // the picture's, or the memory's server
      return make_refusal(decoded ? 503 : 422, error.what());
    } catch (const Error& error) {
      return make_refusal(422, error.what());
    } catch (const std::exception& error) {
      return make_refusal(500, error.what());
    }
  }

  // ---- on the thread that reads changed memories again

  void watch() {
    std::chrono::milliseconds pause = options.look_every;
    std::unique_lock lock(mutex);
    while (!ended.wait_for(lock, pause, [this] { return ending; })) {
      pause = options.look_every;
      for (auto& [name, one] : served) {
        lock.unlock();
        const auto from = Clock::now();
        std::shared_ptr<LoadedMemory> again;
        std::string fault;
        if (const auto searched = loaded(name); !searched->recogniser.is_held()) {
          if (refresh(name, searched->recogniser, fault)) {
            lock.lock();
            ++(fault.empty() ? one.reloads : one.failed_reloads);
            lock.unlock();
          }
          lock.lock();
          continue;
        }
        const bool same = !one.watch->has_changed();
        if (!same) {
          try {
            again = std::make_shared<LoadedMemory>(one.memory.path, options);
          } catch (const std::exception& error) {
            fault = to_readable_line(error.what());
          }
          // A memory that grows all the time leaves time to answer.
          pause = std::max(pause, std::chrono::duration_cast<std::chrono::milliseconds>(
                                      10 * (Clock::now() - from)));
          if (options.note) {
            options.note(name + ": " +
                         (again ? "the memory was changed; " +
                                      std::to_string(again->recogniser.size()) + " views"
                                : "the memory was changed and cannot be read; the memory stays as "
                                  "it was: " +
                                      fault));
          }
        }
        lock.lock();
        if (same) continue;
        ++(again ? one.reloads : one.failed_reloads);
        if (again) one.loaded.swap(again);
        lock.unlock();
        again.reset();
        lock.lock();
      }
    }
  }

  /// Returns true if the memory was changed, or its server lost; then `fault` says why. A fault is
  /// reported once, until the server is back.
  bool refresh(const std::string& name, PlaceRecogniser& searched, std::string& fault) {
    bool changed = false;
    try {
      changed = searched.refresh();
    } catch (const std::exception& error) {
      fault = to_readable_line(error.what());
    }
    const bool was_reported = !fault.empty() && !lost.insert(name).second;
    if (fault.empty()) lost.erase(name);
    if (!changed && (fault.empty() || was_reported)) return false;
    if (options.note) {
      options.note(name + ": " +
                   (changed
                        ? "the memory was changed; " + std::to_string(searched.size()) + " views"
                        : "the memory cannot be searched: " + fault));
    }
    return true;
  }

  const LocalisationServerOptions options;
  std::set<std::string> lost;  // memories whose server is away; of the watcher
  mutable std::mutex mutex;
  std::condition_variable came;          // a picture, or the end
  std::condition_variable ended;         // for the watcher
  std::map<std::string, Served> served;  // names stay; `watch` is of the watcher
  std::deque<std::pair<std::weak_ptr<Job>, std::size_t>> waiting;
  std::size_t waiting_bytes = 0;
  std::map<int, std::uint64_t> refused;
  Histogram answering;
  Histogram queueing;
  bool ending = false;
  std::optional<HttpServer> server;
  std::vector<std::thread> workers;
  std::thread watcher;
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
