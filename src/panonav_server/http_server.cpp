#include "panonav_server/http_server.hpp"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <exception>
#include <list>
#include <thread>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav_server/internal/http_head.hpp"

namespace panonav::server {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::size_t max_connections = 256;
/// Memory of libmicrohttpd for one connection: the head, and pieces of its answer.
constexpr std::size_t connection_bytes = 4 * max_head_bytes;
/// Send buffer of the system for a slow reader; with a larger one, streamed parts would arrive too
/// late to be useful.
constexpr int send_buffer_bytes = 256 * 1024;
constexpr unsigned request_timeout_s = 5;
constexpr unsigned idle_timeout_s = 30;  ///< between two requests of a trusted client
constexpr double min_body_bytes_per_s = 100e3;
constexpr milliseconds poll_interval(400);

enum class Stage {
  idle,  ///< no byte of the next request yet
  reading,
  answering,
};

struct Connection {
  MHD_Connection* handle = nullptr;
  int socket = -1;
  Stage stage = Stage::idle;
  Clock::time_point last_activity = Clock::now();  ///< of the last received bytes or stage change
  Clock::time_point deadline =
      last_activity + std::chrono::seconds(request_timeout_s);  ///< late after this
  bool trusted = false;  ///< sent a head that `judge_head` trusts
  bool evicted = false;
  bool suspended = false;  ///< waits for `more` or `later`
  bool has_head = false;
  int refused_body = 0;  ///< status of an answer for which the rest of the body is skipped; 0: none
  HttpRequest request;
  std::function<std::optional<std::string>()> more;
  std::function<std::optional<HttpAnswer>()> later;
  std::optional<HttpAnswer> answer;
  std::string piece;     ///< of `more`
  std::size_t sent = 0;  ///< of `piece`

  void enter_stage(Stage next) {
    stage = next;
    last_activity = Clock::now();
    const bool is_pause = stage == Stage::idle && trusted;
    deadline = last_activity + std::chrono::seconds(is_pause ? idle_timeout_s : request_timeout_s);
  }
  /// Extends the deadline of a body by the time for `bytes` more, but never to more than the
  /// time-out from now.
  void extend_deadline(std::size_t bytes) {
    last_activity = Clock::now();
    deadline = std::min(
        deadline + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(
                       static_cast<double>(bytes) / min_body_bytes_per_s)),
        last_activity + std::chrono::seconds(request_timeout_s));
  }
  [[nodiscard]] bool is_late() const {
    // During answers, libmicrohttpd itself detects clients that accept nothing.
    return stage != Stage::answering && Clock::now() > deadline;
  }
  /// Rank in which connections are evicted to make room, lowest first; nullopt: not evicted.
  [[nodiscard]] std::optional<int> eviction_rank() const {
    if (evicted || (trusted && stage == Stage::answering)) return std::nullopt;
    if (!trusted) return 0;
    return stage == Stage::idle ? 1 : 2;
  }
  /// Shuts the socket; libmicrohttpd closes the connection when it reads the end.
  void evict() {
    evicted = true;
    resume();
    shutdown(socket, SHUT_RDWR);
  }
  void suspend() {
    suspended = true;
    MHD_suspend_connection(handle);
  }
  void resume() {
    if (std::exchange(suspended, false)) MHD_resume_connection(handle);
  }
};

Connection& get_connection(MHD_Connection* handle) {
  return *static_cast<Connection*>(
      MHD_get_connection_info(handle, MHD_CONNECTION_INFO_SOCKET_CONTEXT)->socket_context);
}

/// Copies the next part of a stream into the buffer of libmicrohttpd.
ssize_t copy_next_part(void* connection, std::uint64_t /*position*/, char* buffer,
                       std::size_t size) {
  Connection& one = *static_cast<Connection*>(connection);
  if (one.evicted) return MHD_CONTENT_READER_END_WITH_ERROR;
  if (one.sent == one.piece.size()) {
    auto text = one.more();
    if (!text) return MHD_CONTENT_READER_END_OF_STREAM;
    one.piece = std::move(*text);
    one.sent = 0;
    if (one.piece.empty()) {
      one.suspend();
      return 0;
    }
  }
  const std::size_t count = one.piece.copy(buffer, size, one.sent);
  one.sent += count;
  return static_cast<ssize_t>(count);
}

/// Queues an answer with `headers` (each ended by "\r\n"), and moves its `more` to the connection.
MHD_Result queue_answer(Connection& one, HttpAnswer answer, std::string_view headers) {
  one.enter_stage(Stage::answering);
  const auto status = static_cast<unsigned>(answer.status);
  if (answer.content.empty() && status >= 400) {
    answer.content = std::string(MHD_get_reason_phrase_for(status)) + ".\n";
  }
  MHD_Response* response = nullptr;
  if (answer.more) {
    one.more = std::move(answer.more);
    response = MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, send_buffer_bytes,
                                                 &copy_next_part, &one, nullptr);
    MHD_set_response_options(response, MHD_RF_HTTP_1_0_COMPATIBLE_STRICT, MHD_RO_END);
  } else {
    response = MHD_create_response_from_buffer(answer.content.size(), answer.content.data(),
                                               MHD_RESPMEM_MUST_COPY);
  }
  while (!headers.empty()) {
    const std::size_t colon = headers.find(": ");
    const std::size_t end = headers.find("\r\n");
    MHD_add_response_header(response, std::string(headers.substr(0, colon)).c_str(),
                            std::string(headers.substr(colon + 2, end - colon - 2)).c_str());
    headers.remove_prefix(end + 2);
  }
  if (status != 204) MHD_add_response_header(response, "Content-Type", answer.type.c_str());
  if (status >= 400) MHD_add_response_header(response, "Connection", "close");
  if (status == 401) {  // browsers then ask the user for a password
    MHD_add_response_header(response, "WWW-Authenticate", "Basic realm=\"panonav\"");
  }
  const MHD_Result queued = MHD_queue_response(one.handle, status, response);
  MHD_destroy_response(response);
  return queued;
}

}  // namespace

bool is_same_origin(const HttpRequest& request) {
  const std::string name = request.host.substr(0, request.host.rfind(':'));
  in_addr ignored{};
  return (name == "localhost" || inet_pton(AF_INET, name.c_str(), &ignored) == 1) &&
         (request.origin.empty() || request.origin == "http://" + request.host);
}

bool is_same_secret(std::string_view sent, std::string_view secret) {
  if (sent.size() != secret.size()) return false;
  unsigned differing = 0;
  for (std::size_t i = 0; i < secret.size(); ++i) {
    differing |= static_cast<unsigned char>(sent[i]) ^ static_cast<unsigned char>(secret[i]);
  }
  return differing == 0;
}

/// Runs libmicrohttpd, which parses requests and sends answers, on a thread of ours. Its time-outs
/// only limit the gap between two bytes, and it makes no room for new connections, so late requests
/// and the oldest strangers are evicted here.
struct HttpServer::Implementation {
  Implementation(const HttpServerOptions& server_options, Handler request_handler)
      : options(server_options), handler(std::move(request_handler)) {
    require(options.port >= 0 && options.port <= 65535, "port", options.port, "0 .. 65535");
    start_daemon();
    if (daemon == nullptr || wake < 0) {
      throw Error("cannot listen at " + options.address + ", port " + std::to_string(options.port) +
                  "; allowed: an IPv4 address of this machine, and a port that is free (0 finds " +
                  "one)");
    }
    // The thread blocks all signals, so that they reach the threads that expect them.
    sigset_t all;
    sigset_t before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    thread = std::thread([this] { serve(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }

  ~Implementation() {
    ended = true;
    wake_up();
    thread.join();
    MHD_stop_daemon(daemon);
    close(wake);
  }

  void start_daemon() {
    sockaddr_in socket_address{};
    socket_address.sin_family = AF_INET;
    socket_address.sin_port = htons(static_cast<std::uint16_t>(options.port));
    if (inet_pton(AF_INET, options.address.c_str(), &socket_address.sin_addr) != 1) return;
    const auto keep_escaped = [](void*, MHD_Connection*, char* text) { return std::strlen(text); };
    daemon = MHD_start_daemon(
        MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_SUPPRESS_DATE_NO_CLOCK, 0, nullptr,
        nullptr, &on_request_data, this, MHD_OPTION_SOCK_ADDR,
        reinterpret_cast<sockaddr*>(&socket_address), MHD_OPTION_STRICT_FOR_CLIENT,
        is_lenient_version() ? 0 : 1,
        // Evicted connections still exist for a moment.
        MHD_OPTION_CONNECTION_LIMIT, static_cast<unsigned>(2 * max_connections),
        MHD_OPTION_CONNECTION_TIMEOUT, request_timeout_s, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
        connection_bytes, MHD_OPTION_NOTIFY_CONNECTION, &on_connection_change, this,
        MHD_OPTION_NOTIFY_COMPLETED, &on_request_completed, nullptr, MHD_OPTION_UNESCAPE_CALLBACK,
        static_cast<std::size_t (*)(void*, MHD_Connection*, char*)>(keep_escaped), nullptr,
        MHD_OPTION_END);
  }

  void wake_up() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = write(wake, &one, sizeof(one));
  }

  void serve() {
    const int events = MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd;
    std::optional<Clock::time_point> last;  // when to stop sending answers
    Clock::time_point last_poll{};
    while (!last || (Clock::now() < *last && is_sending_answers())) {
      std::array<pollfd, 2> waiting{pollfd{wake, POLLIN, 0}, pollfd{events, POLLIN, 0}};
      MHD_UNSIGNED_LONG_LONG due_ms = 0;
      const bool is_due = MHD_get_timeout(daemon, &due_ms) == MHD_YES && due_ms == 0;
      poll(waiting.data(), waiting.size(), is_due ? 0 : last ? 50 : 500);
      std::uint64_t wake_ups = 0;
      const bool was_woken = read(wake, &wake_ups, sizeof(wake_ups)) > 0;
      if (was_woken || Clock::now() - last_poll > poll_interval) {
        std::ranges::for_each(connections, &Implementation::poll_connection);
        last_poll = Clock::now();
      }
      std::ranges::for_each(connections, &Implementation::check_first_byte);
      MHD_run(daemon);
      if (ended && !last) {
        last = Clock::now() + options.last_answers;
        close(MHD_quiesce_daemon(daemon));
      }
    }
    std::ranges::for_each(connections, &Connection::evict);
    MHD_run(daemon);
  }

  /// Calls `later` of a connection that waits for it; evicts the connection if it is late or its
  /// client has left.
  static void poll_connection(Connection& one) {
    if (one.evicted) return;
    if (!one.suspended) {
      if (one.is_late()) one.evict();
      return;
    }
    pollfd client{one.socket, POLLRDHUP, 0};
    if (poll(&client, 1, 0) > 0) return one.evict();
    if (one.later && !(one.answer = one.later())) return;
    one.resume();
  }

  /// Starts the time-out of a request at its first byte. libmicrohttpd skips bytes that cannot
  /// begin a request, such as a TLS handshake; here they are refused.
  static void check_first_byte(Connection& one) {
    char first = 0;
    if (one.stage != Stage::idle || one.evicted ||
        recv(one.socket, &first, 1, MSG_PEEK | MSG_DONTWAIT) != 1) {
      return;
    }
    one.enter_stage(Stage::reading);
    if (std::isalpha(static_cast<unsigned char>(first)) != 0 || first == '*') return;
    constexpr std::string_view refusal = "HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n";
    send(one.socket, refusal.data(), refusal.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    one.evict();
  }

  /// True while answers other than streams are being sent.
  bool is_sending_answers() const {
    return std::ranges::any_of(connections, [](const Connection& one) {
      return !one.evicted && one.stage == Stage::answering && !one.more;
    });
  }

  static void on_connection_change(void* self, MHD_Connection* handle, void** context,
                                   MHD_ConnectionNotificationCode code) {
    auto& connections = static_cast<Implementation*>(self)->connections;
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
      connections.remove_if([&](const Connection& one) { return &one == *context; });
      return;
    }
    const auto staying = std::ranges::count(connections, false, &Connection::evicted);
    Connection* leaving = nullptr;
    for (Connection& other : connections) {
      const auto order = [](const Connection& of) {
        return std::pair(*of.eviction_rank(), of.last_activity);
      };
      if (other.eviction_rank() && (leaving == nullptr || order(other) < order(*leaving))) {
        leaving = &other;
      }
    }
    Connection& one = connections.emplace_back();
    *context = &one;
    one.handle = handle;
    one.socket = MHD_get_connection_info(handle, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
    setsockopt(one.socket, SOL_SOCKET, SO_SNDBUF, &send_buffer_bytes, sizeof(send_buffer_bytes));
    if (static_cast<std::size_t>(staying) < max_connections) return;
    (leaving == nullptr ? &one : leaving)->evict();
  }

  static void on_request_completed(void* /*self*/, MHD_Connection* handle, void** /*request*/,
                                   MHD_RequestTerminationCode /*why*/) {
    Connection& one = get_connection(handle);
    one.more = nullptr;
    one.later = nullptr;
    one.answer.reset();
    one.has_head = false;
    one.refused_body = 0;
    one.request = {};
    one.enter_stage(Stage::idle);
    MHD_set_connection_option(handle, MHD_CONNECTION_OPTION_TIMEOUT, idle_timeout_s);
  }

  /// Called by libmicrohttpd with the head, with each piece of the body, at its end, and again when
  /// a suspended connection is resumed.
  static MHD_Result on_request_data(void* self, MHD_Connection* handle, const char* path,
                                    const char* method, const char* version, const char* data,
                                    std::size_t* size, void** /*request*/) {
    auto& server = *static_cast<Implementation*>(self);
    Connection& one = get_connection(handle);
    if (one.evicted) return MHD_NO;
    if (!one.has_head) return server.handle_head(one, path, method, version);
    if (*size > 0) {
      server.append_body_part(one, {data, std::exchange(*size, 0)});
      return MHD_YES;
    }
    if (one.refused_body != 0) {
      return queue_answer(one, {.status = one.refused_body}, server.options.headers);
    }
    if (!one.answer) server.answer_request(one);
    if (one.later && !one.answer) one.answer = one.later();
    if (one.answer)
      return queue_answer(one, *std::exchange(one.answer, std::nullopt), server.options.headers);
    one.suspend();
    return MHD_YES;
  }

  MHD_Result handle_head(Connection& one, const char* path, const char* method,
                         const char* version) {
    one.has_head = true;
    one.request = {.method = method, .path = path};
    if (one.stage == Stage::idle) one.enter_stage(Stage::reading);
    MHD_set_connection_option(one.handle, MHD_CONNECTION_OPTION_TIMEOUT, request_timeout_s);
    HttpHead head = read_http_head(one.handle, method, version, options.max_body, one.request);
    if (head.status == 0 && head.body_bytes > 0 && exceeds_body_limit(0)) head.status = 503;
    if (head.status != 0) return queue_answer(one, {.status = head.status}, options.headers);
    HeadVerdict verdict = judge(one.request);
    one.trusted = one.trusted || verdict.is_trusted;
    if (verdict.refusal) return queue_answer(one, std::move(*verdict.refusal), options.headers);
    one.enter_stage(Stage::reading);  // the body has its own time-out
    return MHD_YES;
  }

  [[nodiscard]] HeadVerdict judge(const HttpRequest& head) const {
    try {
      return options.judge_head ? options.judge_head(head) : HeadVerdict{.is_trusted = true};
    } catch (const std::exception&) {
      return {.refusal = HttpAnswer{.status = 500}};
    }
  }

  /// True if a further `more` bytes of bodies would exceed the limit; for 0, if the limit is
  /// reached.
  [[nodiscard]] bool exceeds_body_limit(std::size_t more) const {
    std::size_t bytes = more;
    for (const Connection& one : connections) bytes += one.request.body.size();
    return bytes >= std::max(options.max_bodies, options.max_body) + (more > 0 ? 1 : 0);
  }

  void append_body_part(Connection& one, std::string_view piece) const {
    one.extend_deadline(piece.size());
    if (one.refused_body != 0) return;
    if (exceeds_body_limit(piece.size())) {
      one.refused_body = 503;
      one.request.body = {};
      return;
    }
    one.request.body += piece;
  }

  /// Calls the handler and sets `answer` or `later`.
  void answer_request(Connection& one) {
    if (one.later) return;
    one.enter_stage(Stage::answering);
    try {
      one.answer = handler(std::move(one.request));
    } catch (const std::exception&) {
      one.answer = HttpAnswer{.status = 500};
    }
    one.later = std::move(one.answer->later);
    if (one.later) one.answer.reset();
  }

  const HttpServerOptions options;
  const Handler handler;
  const int wake = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  MHD_Daemon* daemon = nullptr;
  std::list<Connection> connections;  // used only by the thread; oldest first
  std::atomic<bool> ended = false;
  std::thread thread;
};

HttpServer::HttpServer(const HttpServerOptions& options, Handler handler)
    : implementation_(std::make_unique<Implementation>(options, std::move(handler))) {}

HttpServer::~HttpServer() = default;

int HttpServer::port() const {
  return MHD_get_daemon_info(implementation_->daemon, MHD_DAEMON_INFO_BIND_PORT)->port;
}

void HttpServer::wake_up() {
  implementation_->wake_up();
}

}  // namespace panonav::server
