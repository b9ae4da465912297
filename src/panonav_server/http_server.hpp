#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace panonav::server {

/// Arguments after the '?' of a path, by name; still percent-encoded. Of equal names the last one
/// counts.
using HttpArguments = std::map<std::string, std::string, std::less<>>;

/// A complete request.
struct HttpRequest {
  std::string method;  ///< "GET", "POST", ...
  std::string path;    ///< as sent, up to a '?'; still percent-encoded
  HttpArguments arguments;
  std::string host;           ///< host and port, as the client named them
  std::string origin;         ///< empty: none was sent
  std::string authorization;  ///< the field of that name; empty: none was sent
  std::string accept;         ///< media types that the client accepts; empty: none was sent
  std::string content_type;   ///< of the body; empty: none was sent
  std::string body;           ///< at most `HttpServerOptions::max_body` bytes
};

struct HttpAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";  ///< of the content
  std::string content;
  /// If set, the answer is a stream: after each sent part, and at least twice a second, the server
  /// calls this for the next part (may be empty), until it returns nullopt. The function is
  /// destroyed with the connection.
  std::function<std::optional<std::string>()> more;
  /// If set, the answer is not ready yet: after each `wake_up`, and at least twice a second, the
  /// server calls this until it returns the answer, which must have no `later`. The function is
  /// destroyed with the connection.
  std::function<std::optional<HttpAnswer>()> later;
};

/// Verdict on the sender of a request, by its head.
struct HeadVerdict {
  bool is_trusted = false;              ///< may keep its connection longer
  std::optional<HttpAnswer> refusal{};  ///< sent at once, without reading the body; `content` only
};

struct HttpServerOptions {
  std::string address = "127.0.0.1";  ///< an IPv4 address of this machine
  int port = 0;                       ///< 0 .. 65535; 0: a free one
  std::string headers;                ///< headers of every answer, each ended by "\r\n"
  std::size_t max_body = 1024;        ///< largest body of a request, bytes
  /// Largest total size of request bodies that are not complete; a body beyond it gets status 503.
  std::size_t max_bodies = std::size_t{64} * 1024;
  /// Judges a request by its head, before a byte of its body is kept; called on the server's
  /// thread. Empty: all senders are trusted.
  std::function<HeadVerdict(const HttpRequest& head)> judge_head;
  /// Longest time that the destructor waits until pending answers are sent.
  std::chrono::milliseconds last_answers{0};
};

/// True if the request names a numeric address or "localhost" as its host, and no page of another
/// origin made it. A malicious name server then cannot have sent a browser here (DNS rebinding).
[[nodiscard]] bool is_same_origin(const HttpRequest& request);

/// True if both are equal; its duration does not depend on where they differ, so it reveals
/// nothing.
[[nodiscard]] bool is_same_secret(std::string_view sent, std::string_view secret);

/// A small HTTP/1.1 server (libmicrohttpd) for a few clients and any number of strangers, with one
/// thread and bounded memory whatever is sent to it. A request has at most 8 kB of head, which must
/// be complete 5 s after its first byte. A connection is closed if a body arrives more slowly than
/// 100 kB/s for 5 s, or if the client accepts no bytes for 5 s. There are at most 256 connections.
/// A further one replaces that of a stranger (`HeadVerdict`), else of a client between two
/// requests, else of one that sends a body; of these the one silent for the longest time.
/// The further one is closed itself if all others wait for answers.
class HttpServer {
 public:
  /// Called on the server's thread with each request; an exception becomes status 500.
  using Handler = std::function<HttpAnswer(HttpRequest)>;

  /// Begins to listen. Throws Error if address and port are not available, ContractError if the
  /// port is out of range.
  HttpServer(const HttpServerOptions& options, Handler handler);
  /// Closes all connections, after waiting at most `last_answers`.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  [[nodiscard]] int port() const;
  /// Makes the server call the functions `more` and `later` soon. Any thread may call; it never
  /// waits.
  void wake_up();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::server
