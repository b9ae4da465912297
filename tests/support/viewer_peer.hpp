#pragma once

#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "panonav_viewer/view_server.hpp"

/// A client and a moment for tests of the server.
namespace panonav {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

/// For what must come. It only ends tests that fail, and so is enough for emulated processors,
/// where a server that waits ten times as long as it read a changed memory is late by minutes.
inline constexpr std::chrono::seconds patience(900);

/// Somebody who connects to a server of this machine. Reads and writes wait so long at most.
class Peer {
 public:
  explicit Peer(const std::string& url, std::chrono::seconds wait_at_most = patience) {
    const std::size_t port_at = url.find(':', 7) + 1;
    const std::size_t slash = url.find('/', port_at);
    host_ = url.substr(7, slash - 7);
    root_ = url.substr(slash);
    socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval wait{wait_at_most.count(), 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &wait, sizeof(wait));
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &wait, sizeof(wait));
    const int small = 65'536;  // what a slow reader has not read stays with the server
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &small, sizeof(small));
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_port = htons(static_cast<std::uint16_t>(std::stoi(url.substr(port_at))));
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&place), sizeof(place)) == 0;
  }
  ~Peer() { close(socket_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  [[nodiscard]] bool connected() const { return connected_; }
  [[nodiscard]] const std::string& host() const { return host_; }
  [[nodiscard]] const std::string& root() const { return root_; }

  /// False when the other side has closed.
  bool say(const std::string& text) const {
    return send(socket_, text.data(), text.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(text.size());
  }
  /// One more piece; false at the end, or after so long without one.
  bool hear() {
    std::array<char, 65536> bytes;
    const ssize_t count = recv(socket_, bytes.data(), bytes.size(), 0);
    if (count > 0) heard_.append(bytes.data(), static_cast<std::size_t>(count));
    return count > 0;
  }
  bool hear_until(const std::string& text) {
    while (heard_.find(text) == std::string::npos) {
      if (!hear()) return false;
    }
    return true;
  }
  /// All up to the end of the connection.
  const std::string& hear_all() {
    while (hear()) {
    }
    return heard_;
  }
  [[nodiscard]] const std::string& heard() const { return heard_; }
  void forget() { heard_.clear(); }

  /// A request as a browser makes it, and the whole answer.
  std::string ask(const std::string& path, const std::string& more = "",
                  const std::string& method = "GET", const std::string& body = "") {
    say(method + " " + path + " HTTP/1.1\r\nHost: " + host_ + "\r\nConnection: close\r\n" + more +
        (body.empty() ? "" : "Content-Length: " + std::to_string(body.size()) + "\r\n") + "\r\n" +
        body);
    return hear_all();
  }
  void follow() { say("GET " + root_ + "events HTTP/1.1\r\nHost: " + host_ + "\r\n\r\n"); }
  /// The data of the events of this name that were heard.
  [[nodiscard]] std::vector<json> events(const std::string& name) const {
    std::vector<json> found;
    const std::string start = "event: " + name + "\ndata: ";
    for (std::size_t at = heard_.find(start); at != std::string::npos;
         at = heard_.find(start, at)) {
      at += start.size();
      const std::size_t end = heard_.find("\n\n", at);
      if (end == std::string::npos) break;
      found.push_back(json::parse(heard_.substr(at, end - at)));
    }
    return found;
  }

 private:
  int socket_ = -1;
  bool connected_ = false;
  std::string host_;
  std::string root_;
  std::string heard_;
};

inline int status_of(const std::string& answer) {
  return answer.starts_with("HTTP/1.1 ") ? std::stoi(answer.substr(9, 3)) : 0;
}

inline std::string ask(const std::string& url, const std::string& below,
                       const std::string& more = "") {
  Peer peer(url);
  return peer.ask(peer.root() + below, more);
}

inline int control(const std::string& url, const std::string& body) {
  Peer peer(url);
  return status_of(peer.ask(peer.root() + "control", "", "POST", body));
}

inline recordings::RunMoment moment_at(double stamp_s) {
  recordings::RunMoment moment{.stamp_s = stamp_s, .pose = Pose2{stamp_s, 2.0, 0.5}};
  moment.state = "localised";
  moment.sure = true;
  moment.probability = 0.75;
  return moment;
}

/// True if a condition holds within the patience.
inline bool soon(const auto& holds) {
  for (const auto end = Clock::now() + patience; Clock::now() < end;) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return holds();
}

}  // namespace panonav
