#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace panonav::server {

/// A complete request.
struct HttpRequest {
  std::string method;         ///< "GET", "POST", ...
  std::string path;           ///< as it was sent, up to a '?'
  std::string host;           ///< with the port
  std::string origin;         ///< empty: none was sent
  std::string authorization;  ///< the field of that name; empty: none was sent
  std::string body;           ///< at most `HttpServerOptions::max_body` bytes
};

struct HttpAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";  ///< of the content
  std::string content;
  /// If set, the answer is a stream: after each sent part, and at least twice a second, the server
  /// calls this for the next part (may be empty), until it returns nullopt. It is destroyed with
  /// the connection.
  std::function<std::optional<std::string>()> more;
  /// If set, the answer is not ready yet: the server calls this after each `poke`, and at least
  /// twice a second, until it returns the answer, which has no `later` of its own. It is destroyed
  /// with the connection.
  std::function<std::optional<HttpAnswer>()> later;
};

/// Verdict on the sender of a request, by its head.
struct HeadVerdict {
  bool is_trusted = false;  ///< the sender may keep its connection longer than strangers
  std::optional<HttpAnswer> refusal{};  ///< sent at once, without reading the body; `content` only
};

struct HttpServerOptions {
  std::string address = "127.0.0.1";  ///< an IPv4 address of this machine
  int port = 0;                       ///< 0 .. 65535; 0: a free one
  std::string headers;                ///< headers of every answer, each ended by "\r\n"
  std::size_t max_body = 1024;        ///< largest body of a request, bytes
  /// Largest number of received bytes of unfinished bodies together; a body beyond gets status 503.
  std::size_t max_bodies = std::size_t{64} * 1024;
  /// Judges a request by its head, before a byte of its body is kept; called on the server's
  /// thread. Empty: all are trusted.
  std::function<HeadVerdict(const HttpRequest& head)> judge_head;
  /// Time that the destructor waits for answers that are not sent yet.
  std::chrono::milliseconds last_answers{0};
};

/// True if a request went to a number or to "localhost", and no page of another origin made it:
/// then no foreign name server can have led a browser here (DNS rebinding).
[[nodiscard]] bool is_same_origin(const HttpRequest& request);

/// True if the two are equal; takes the same time wherever they differ.
[[nodiscard]] bool is_same_secret(std::string_view sent, std::string_view secret);

/// A small HTTP/1.1 server (libmicrohttpd) for a few clients and any number of strangers: one
/// thread, and bounded memory whatever is sent to it. A request has at most 8 kB of head, which
/// must be complete 5 s after its first byte. A connection is closed when 5 s have passed in which
/// a body did not come at 100 kB/s, or if it accepts no bytes for 5 s. There are at most 256
/// connections: a further one replaces that of a stranger (`HeadVerdict`), else of a client between
/// two requests, else of one that sends a body: each time the one that was silent for the longest.
/// It is closed itself if all others wait for answers.
class HttpServer {
 public:
  /// Called on the server's thread, and may keep the request; its exceptions become status 500.
  using Handler = std::function<HttpAnswer(HttpRequest)>;

  /// Begins to listen. Throws Error if address and port are not available, ContractError if the
  /// port is out of range.
  HttpServer(const HttpServerOptions& options, Handler handler);
  /// Closes all connections, after `last_answers` at most.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  [[nodiscard]] int port() const;
  /// Makes the server call `more` of streams and `later` of pending answers soon. Any thread may
  /// call; never waits.
  void poke();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::server
