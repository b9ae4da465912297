#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "panonav/localisation/localiser_options.hpp"

namespace panonav::server {

/// A memory with its name for clients.
struct ServedMemory {
  std::string name;  ///< 1 to 64 letters, digits, '-', '_' and '.'
  std::filesystem::path path;
};

struct LocalisationServerOptions {
  std::string address = "127.0.0.1";  ///< an IPv4 address of this machine, to listen at
  int port = 0;                       ///< 0 .. 65535; 0: a free one
  int threads = 0;                    ///< threads for requests; 0: one per core; at most 1024
  std::size_t max_waiting =
      64;             ///< number of pictures that may wait for a thread; further ones get 503
  std::string token;  ///< token that clients must send; empty: none
  LocaliserOptions localiser;
  /// A memory on a server is held in this process if it has at most this many views
  /// (`PlaceRecogniserOptions::max_held_views`), and else searched on its server.
  std::size_t max_held_views = 200'000;
  /// Interval at which memory files are checked for changes.
  std::chrono::milliseconds poll_interval{1000};
  /// Called on another thread with one line for each event of a memory, such as a reload.
  std::function<void(const std::string& line)> note;
};

/// Localises pictures over HTTP (docs/formats.md, "HTTP"): receives PNG or JPEG and answers in
/// JSON, with exactly the numbers of `PlaceRecogniser`. Pictures wait in a bounded queue; a picture
/// has at most 16 MiB and 33,554,432 pixels, waiting ones 128 MiB together. While a changed memory
/// is read again, the old one answers.
///
/// Without a token it answers every program that reaches the port, except web pages of another
/// origin or under a name other than "localhost" (DNS rebinding). There is no encryption: use a
/// proxy outside of trusted networks.
class LocalisationServer {
 public:
  /// Reads the memories and begins to listen. Throws FileError as `PlaceRecogniser`, Error if
  /// address and port are not available, ContractError if there is no memory, a name is not allowed
  /// or not unique, or an option is out of range.
  LocalisationServer(std::span<const ServedMemory> memories,
                     const LocalisationServerOptions& options);
  /// Accepts no more pictures; answers waiting ones for at most 5 s.
  ~LocalisationServer();
  LocalisationServer(const LocalisationServer&) = delete;
  LocalisationServer& operator=(const LocalisationServer&) = delete;

  /// Returns the prefix of the paths in docs/formats.md, such as "http://127.0.0.1:41234".
  [[nodiscard]] std::string url() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::server
