#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace panonav::server {

/// A request that has come whole.
struct HttpRequest {
  std::string method;         ///< "GET", "POST", ...
  std::string path;           ///< as it was sent, without what follows a '?'
  std::string host;           ///< with the port
  std::string origin;         ///< empty: none was named
  std::string authorization;  ///< the field of that name; empty: none was sent
  std::string body;           ///< at most `HttpServerOptions::max_body` bytes
};

struct HttpAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";  ///< of the content
  std::string content;
  /// If set, the answer has no end of its own: it is called whenever all was sent, and at least
  /// twice a second, for what to send next (nothing when empty), until it gives nullopt. It is
  /// destroyed with the connection.
  std::function<std::optional<std::string>()> more;
  /// If set, the answer is not ready yet: it is called after each `poke`, and at least twice a
  /// second, until it gives the answer, which has no `later` of its own. It is destroyed with the
  /// connection: who waits no more needs no answer.
  std::function<std::optional<HttpAnswer>()> later;
};

struct HttpServerOptions {
  std::string address = "127.0.0.1";  ///< an IPv4 address of this machine
  int port = 0;                       ///< 0 .. 65535; 0: one that is free
  std::string headers;                ///< of every answer, each ended by "\r\n"
  std::size_t max_body = 1024;        ///< bytes of a request behind its head
  /// Bytes of all bodies that are on their way at a time; who comes on top gets status 503.
  std::size_t max_bodies = std::size_t{64} * 1024;
  /// Time that the destructor waits for answers that are not sent yet.
  std::chrono::milliseconds last_answers{0};
};

/// True if a request went to a number or to "localhost", and no page of another origin made it:
/// then no name server of somebody else's can have led a browser here.
[[nodiscard]] bool is_own_page(const HttpRequest& request);

/// True if the two are equal; takes the same time wherever they differ.
[[nodiscard]] bool is_same_secret(std::string_view sent, std::string_view secret);

/// A small HTTP/1.1 server (libmicrohttpd) for a handful of viewers and any number of strangers:
/// one thread, and whatever is sent to it, bounded memory. A request has at most 8 kB of head; 5 s
/// after its first byte, and a further second for each 100 kB of its body, it is whole, or its
/// connection is closed, and so is one that takes nothing for 5 s. There are at most 64
/// connections: a further one replaces the oldest that never got an answer below 400, or is closed
/// where there is none.
class HttpServer {
 public:
  /// Called on the server's thread, and may keep the request; what it throws becomes status 500.
  using Handler = std::function<HttpAnswer(HttpRequest)>;

  /// Listens from here on. Throws Error where address and port are not to be had, ContractError
  /// where the port is out of range.
  HttpServer(const HttpServerOptions& options, Handler handler);
  /// Closes all connections, after `last_answers` at most.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  [[nodiscard]] int port() const;
  /// Answers without an end are asked for more soon, answers that are not there yet for the answer.
  /// From any thread; never waits.
  void poke();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::server
