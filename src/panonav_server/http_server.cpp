#include "panonav_server/http_server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <exception>
#include <list>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::server {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t max_head = 8192;
constexpr std::size_t max_connections = 64;
constexpr int send_buffer = 256 * 1024;
constexpr auto patience = std::chrono::seconds(5);
constexpr auto idle_patience = std::chrono::seconds(30);  // between two requests

/// A file descriptor that is closed with its owner.
class Handle {
 public:
  explicit Handle(int number = -1) : number_(number) {}
  ~Handle() {
    if (number_ >= 0) close(number_);
  }
  Handle(Handle&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Handle& operator=(Handle&&) = delete;
  [[nodiscard]] int number() const noexcept { return number_; }

 private:
  int number_;
};

std::string_view trimmed(std::string_view text) {
  const std::size_t from = text.find_first_not_of(" \t");
  if (from == std::string_view::npos) return {};
  return text.substr(from, text.find_last_not_of(" \t") - from + 1);
}

std::string_view reason_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 413:
      return "Content Too Large";
    case 422:
      return "Unprocessable Content";
    case 431:
      return "Request Header Fields Too Large";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    default:
      return "Internal Server Error";
  }
}

/// The head of a request, up to the empty line that ends it.
struct Head {
  HttpRequest request;
  std::size_t body_size = 0;
  bool keep = true;       ///< the connection
  bool expected = false;  ///< the client waits to be told that it may send the body
};

/// `status` says what is wrong where there is nothing to give.
std::optional<Head> read_head(std::string_view text, std::size_t max_body, int& status) {
  status = 400;
  const auto next_line = [&text] {
    const std::size_t end = text.find("\r\n");
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 2);
    return line;
  };
  const std::string_view line = next_line();
  const std::size_t first = line.find(' ');
  const std::size_t last = line.rfind(' ');
  if (first == std::string_view::npos || last <= first + 1) return std::nullopt;
  const std::string_view version = line.substr(last + 1);
  if (version != "HTTP/1.1" && version != "HTTP/1.0") return std::nullopt;
  Head head;
  head.request.method = line.substr(0, first);
  const std::string_view target = line.substr(first + 1, last - first - 1);
  head.request.path = target.substr(0, target.find('?'));
  head.keep = version == "HTTP/1.1";
  bool sized = false;
  while (!text.empty()) {
    const std::string_view field = next_line();
    const std::size_t colon = field.find(':');
    if (colon == 0 || colon == std::string_view::npos) return std::nullopt;
    const std::string name = lower_case(field.substr(0, colon));
    const std::string_view value = trimmed(field.substr(colon + 1));
    if (name == "host" || name == "origin" || name == "authorization") {
      std::string& kept = name == "host"     ? head.request.host
                          : name == "origin" ? head.request.origin
                                             : head.request.authorization;
      if (!kept.empty() || value.empty()) return std::nullopt;
      kept = value;
    } else if (name == "content-length") {
      const auto [end, error] =
          std::from_chars(value.data(), value.data() + value.size(), head.body_size);
      if (std::exchange(sized, true)) return std::nullopt;
      if (error == std::errc::result_out_of_range || head.body_size > max_body) status = 413;
      if (error != std::errc() || end != value.data() + value.size() || status == 413) {
        return std::nullopt;
      }
    } else if (name == "transfer-encoding") {
      status = 501;
      return std::nullopt;
    } else if (name == "connection" && lower_case(value) == "close") {
      head.keep = false;
    } else if (name == "expect" && lower_case(value) == "100-continue") {
      head.expected = true;
    }
  }
  if (head.request.host.empty()) return std::nullopt;
  return head;
}

struct Connection {
  explicit Connection(Handle handle) : socket(std::move(handle)) {}

  Handle socket;
  std::string in;            ///< not answered yet
  std::optional<Head> head;  ///< of the request whose body is on its way
  std::string out;
  std::size_t sent = 0;  ///< of `out`
  std::function<std::optional<std::string>()> more;
  std::function<std::optional<HttpAnswer>()> later;
  bool trusted = false;  ///< got an answer below 400
  bool closing = false;  ///< once all is sent
  bool gone = false;
  Clock::time_point since = Clock::now();  ///< the last byte that went out, or request that began

  [[nodiscard]] bool pending() const { return sent < out.size(); }
  /// What is behind is read when this is answered.
  [[nodiscard]] std::size_t wanted_bytes() const { return max_head + (head ? head->body_size : 0); }
  [[nodiscard]] Clock::duration allowed() const {
    if (!pending() && in.empty() && !head && trusted) return idle_patience;
    return patience + std::chrono::seconds(head ? head->body_size / 100'000 : 0);
  }
};

}  // namespace

bool is_own_host(std::string_view host) {
  const std::string name(host.substr(0, host.rfind(':')));
  in_addr ignored{};
  return name == "localhost" || inet_pton(AF_INET, name.c_str(), &ignored) == 1;
}

bool same_secret(std::string_view given, std::string_view secret) {
  if (given.size() != secret.size()) return false;
  unsigned differing = 0;
  for (std::size_t i = 0; i < secret.size(); ++i) {
    differing |= static_cast<unsigned char>(given[i]) ^ static_cast<unsigned char>(secret[i]);
  }
  return differing == 0;
}

struct HttpServer::Implementation {
  Implementation(const HttpServerOptions& wanted, Handler answer_to)
      : options(wanted),
        handler(std::move(answer_to)),
        listener(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)),
        wake(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    require(options.port >= 0 && options.port <= 65535, "port", options.port, "0 .. 65535");
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_port = htons(static_cast<std::uint16_t>(options.port));
    const int yes = 1;
    // A port whose last connections are not forgotten yet may be taken again.
    setsockopt(listener.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
    socklen_t size = sizeof(place);
    auto* const address = reinterpret_cast<sockaddr*>(&place);
    if (wake.number() < 0 || inet_pton(AF_INET, options.address.c_str(), &place.sin_addr) != 1 ||
        bind(listener.number(), address, size) != 0 || listen(listener.number(), SOMAXCONN) != 0 ||
        getsockname(listener.number(), address, &size) != 0) {
      throw Error("cannot listen at " + options.address + ", port " + std::to_string(options.port) +
                  "; allowed: an IPv4 address of this machine, and a port that is free (0 finds " +
                  "one)");
    }
    port = ntohs(place.sin_port);
    // Signals are for the threads that expect them.
    sigset_t all;
    sigset_t before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    thread = std::thread([this] { serve(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
  }

  ~Implementation() {
    ended = true;
    poke();
    thread.join();
  }

  void poke() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = write(wake.number(), &one, sizeof(one));
  }

  void serve() {
    std::vector<pollfd> waiting;
    Clock::time_point accept_from{};
    while (!ended || has_last_answers()) {
      const bool accepting = !ended && Clock::now() >= accept_from;
      waiting.clear();
      waiting.push_back({wake.number(), POLLIN, 0});
      waiting.push_back({accepting ? listener.number() : -1, POLLIN, 0});
      for (const Connection& connection : connections) {
        const bool reading = connection.in.size() <= connection.wanted_bytes();
        const int events = (reading ? POLLIN : 0) | (connection.pending() ? POLLOUT : 0);
        waiting.push_back({connection.socket.number(), static_cast<short>(events), 0});
      }
      poll(waiting.data(), waiting.size(), accepting ? 500 : 50);
      std::uint64_t pokes = 0;
      [[maybe_unused]] const auto read_some = read(wake.number(), &pokes, sizeof(pokes));
      std::size_t i = 2;
      for (Connection& connection : connections) {
        const short events = waiting[i++].revents;
        if ((events & POLLIN) != 0) receive(connection);
        if ((events & (POLLERR | POLLNVAL | POLLHUP)) != 0) connection.gone = true;
        answer_requests(connection);
        send_pending(connection);
        const bool waits = (connection.more || connection.later) && !connection.pending();
        if (!waits && Clock::now() - connection.since > connection.allowed()) {
          connection.gone = true;
        }
      }
      std::erase_if(connections, [](const Connection& one) { return one.gone; });
      if (waiting[1].revents != 0 && !accept_waiting()) {
        accept_from = Clock::now() + std::chrono::milliseconds(50);
      }
    }
    connections.clear();
  }

  /// False where the system has no more descriptors.
  bool accept_waiting() {
    for (std::size_t i = 0; i < max_connections; ++i) {
      Handle socket(accept4(listener.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
      if (socket.number() < 0) return errno != EMFILE && errno != ENFILE && errno != ENOMEM;
      if (connections.size() >= max_connections) {
        const auto stranger = std::ranges::find(connections, false, &Connection::trusted);
        if (stranger == connections.end()) continue;
        connections.erase(stranger);
      }
      const int yes = 1;
      setsockopt(socket.number(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
      // What waits in the system for a slow reader is old when it arrives.
      setsockopt(socket.number(), SOL_SOCKET, SO_SNDBUF, &send_buffer, sizeof(send_buffer));
      connections.emplace_back(std::move(socket));
    }
    return true;
  }

  static void receive(Connection& connection) {
    std::array<char, 4096> bytes;
    while (!connection.gone) {
      const ssize_t count = recv(connection.socket.number(), bytes.data(), bytes.size(), 0);
      if (count < 0) {
        connection.gone = errno != EAGAIN && errno != EINTR;
        return;
      }
      if (count == 0) {
        connection.gone = true;
        return;
      }
      if (connection.more || connection.closing) continue;  // nothing is to be said any more
      if (connection.in.empty() && !connection.head) connection.since = Clock::now();
      connection.in.append(bytes.data(), static_cast<std::size_t>(count));
      if (connection.in.size() > connection.wanted_bytes()) return;
    }
  }

  void answer_requests(Connection& connection) {
    if (connection.later && !connection.gone) {
      if (auto answer = connection.later()) {
        connection.later = nullptr;
        put(connection, std::move(*answer));
        send_pending(connection);
      }
    }
    while (!connection.gone && !connection.closing && !connection.more && !connection.later &&
           !connection.pending()) {
      if (!connection.head && !take_head(connection)) return;
      Head& head = *connection.head;
      if (connection.in.size() < head.body_size) {
        if (std::exchange(head.expected, false)) {
          connection.out = "HTTP/1.1 100 Continue\r\n\r\n";
          connection.sent = 0;
          send_pending(connection);
        }
        return;
      }
      // What came so far of the next request is short, this one's body may be a picture.
      std::string behind = connection.in.substr(head.body_size);
      connection.in.resize(head.body_size);
      head.request.body = std::exchange(connection.in, std::move(behind));
      connection.closing = !head.keep;
      HttpAnswer answer;
      try {
        answer = handler(std::move(head.request));
      } catch (const std::exception&) {
        answer = {.status = 500};
      }
      connection.head.reset();
      if (answer.later) {
        connection.later = std::move(answer.later);
        return answer_requests(connection);  // it may be there already
      }
      put(connection, std::move(answer));
      send_pending(connection);
    }
  }

  /// False where it has not come yet, and where the request is refused.
  bool take_head(Connection& connection) {
    const std::size_t end = connection.in.find("\r\n\r\n");
    if (std::min(end, connection.in.size()) > max_head) {
      refuse(connection, 431);
      return false;
    }
    if (end == std::string::npos) return false;
    int status = 0;
    auto head = read_head(std::string_view(connection.in).substr(0, end), options.max_body, status);
    if (!head) {
      refuse(connection, status);
      return false;
    }
    std::size_t bodies = head->body_size;
    for (const Connection& other : connections) bodies += other.head ? other.head->body_size : 0;
    if (bodies > std::max(options.max_bodies, options.max_body)) {
      refuse(connection, 503);
      return false;
    }
    connection.in.erase(0, end + 4);
    connection.head = std::move(head);
    return true;
  }

  /// Whether answers are on their way for whom the end may wait.
  bool has_last_answers() {
    if (!last) last = Clock::now() + options.last_answers;
    return Clock::now() < *last && std::ranges::any_of(connections, [](const Connection& one) {
             return one.later || (one.pending() && !one.more);
           });
  }

  void refuse(Connection& connection, int status) const {
    connection.closing = true;
    put(connection, {.status = status});
  }

  void put(Connection& connection, HttpAnswer answer) const {
    connection.since = Clock::now();
    if (answer.status < 400) {
      connection.trusted = true;
    } else {
      connection.closing = true;
    }
    if (answer.content.empty() && answer.status >= 400) {
      answer.content = std::string(reason_of(answer.status)) + ".\n";
    }
    connection.more = std::move(answer.more);
    connection.out = "HTTP/1.1 " + std::to_string(answer.status) + " " +
                     std::string(reason_of(answer.status)) + "\r\n" + options.headers;
    if (answer.status != 204) connection.out += "Content-Type: " + answer.type + "\r\n";
    if (!connection.more && answer.status != 204) {
      connection.out += "Content-Length: " + std::to_string(answer.content.size()) + "\r\n";
    }
    if (connection.more || connection.closing) connection.out += "Connection: close\r\n";
    connection.out += "\r\n" + answer.content;
    connection.sent = 0;
  }

  static void send_pending(Connection& connection) {
    while (!connection.gone) {
      if (!connection.pending()) {
        connection.out.clear();
        connection.sent = 0;
        if (connection.more) {
          auto text = connection.more();
          if (text) {
            connection.out = std::move(*text);
            connection.since = Clock::now();
          } else {
            connection.more = nullptr;
            connection.closing = true;
          }
        }
        if (!connection.pending()) {
          if (connection.closing && !connection.later) connection.gone = true;
          return;
        }
      }
      const ssize_t count =
          send(connection.socket.number(), connection.out.data() + connection.sent,
               connection.out.size() - connection.sent, MSG_NOSIGNAL);
      if (count < 0) {
        connection.gone = errno != EAGAIN && errno != EINTR;
        return;
      }
      connection.sent += static_cast<std::size_t>(count);
      connection.since = Clock::now();
    }
  }

  const HttpServerOptions options;
  const Handler handler;
  const Handle listener;
  const Handle wake;
  int port = 0;
  std::list<Connection> connections;  // of the thread; the oldest first
  std::atomic<bool> ended = false;
  std::optional<Clock::time_point> last;  // of the thread
  std::thread thread;
};

HttpServer::HttpServer(const HttpServerOptions& options, Handler handler)
    : implementation_(std::make_unique<Implementation>(options, std::move(handler))) {}

HttpServer::~HttpServer() = default;

int HttpServer::port() const {
  return implementation_->port;
}

void HttpServer::poke() {
  implementation_->poke();
}

}  // namespace panonav::server
