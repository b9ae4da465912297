#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace panonav {

/// A request that has come whole.
struct HttpRequest {
  std::string method;  ///< "GET", "POST", ...
  std::string path;    ///< as it was sent, without what follows a '?'
  std::string host;    ///< with the port
  std::string origin;  ///< empty: none was named
  std::string body;    ///< at most 1 kB
};

struct HttpAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";  ///< of the content
  std::string content;
  /// Where it is set the answer has no end of its own: it is called whenever all was sent, and at
  /// least twice a second, for what to send next (nothing when empty), until it gives nullopt. It
  /// is destroyed with the connection.
  std::function<std::optional<std::string>()> more;
};

struct HttpServerOptions {
  std::string address = "127.0.0.1";  ///< an IPv4 address of this machine
  int port = 0;                       ///< 0 .. 65535; 0: one that is free
  std::string headers;                ///< of every answer, each ended by "\r\n"
};

/// A small HTTP/1.1 server for a handful of viewers and any number of strangers: one thread, and
/// whatever is sent to it, bounded memory. A request has at most 8 kB of head and 1 kB of body; 5 s
/// after its first byte it is whole, or its connection is closed, and so is one that takes nothing
/// for 5 s. There are at most 64 connections: a further one replaces the oldest that never got an
/// answer below 400, or is closed where there is none.
class HttpServer {
 public:
  /// Called on the server's thread; what it throws becomes status 500.
  using Handler = std::function<HttpAnswer(const HttpRequest&)>;

  /// Listens from here on. Throws Error where address and port are not to be had, ContractError
  /// where the port is out of range.
  HttpServer(const HttpServerOptions& options, Handler handler);
  /// Closes all connections.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  [[nodiscard]] int port() const;
  /// Answers without an end are asked for more soon. From any thread; never waits.
  void poke();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav
