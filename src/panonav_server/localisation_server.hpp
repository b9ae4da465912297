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
  int threads = 0;  ///< number of threads that answer pictures; 0: one per core; at most 1024
  std::size_t max_waiting =
      64;             ///< number of pictures that may wait for a thread; further ones get 503
  std::string token;  ///< token that clients must send; empty: none
  LocaliserOptions localiser;
  /// Largest number of views of a memory on a server that is held
  /// (`PlaceRecogniserOptions::max_held_views`).
  std::size_t max_held_views = 200'000;
  /// Poll interval of memory files for changes.
  std::chrono::milliseconds look_every{1000};
  /// Receives one line for each event of a memory while it is served; called on another thread.
  std::function<void(const std::string& line)> note;
};

/// Localises pictures over HTTP (docs/formats.md, "HTTP"): PNG or JPEG in, JSON out, with the same
/// bits as the answers of `PlaceRecogniser`. Pictures wait in a bounded queue; a picture has at
/// most 16 MiB and 33,554,432 pixels, waiting ones 128 MiB together. A changed memory is read again
/// while the old one answers.
///
/// Without a token every program that reaches the port is answered, but no web page of another
/// origin or under a name other than "localhost" (DNS rebinding). There is no encryption: use a
/// proxy outside of trusted networks.
class LocalisationServer {
 public:
  /// Reads the memories and begins to listen. Throws FileError as `PlaceRecogniser`, Error if
  /// address and port are not available, ContractError on no memory, on names that are not allowed
  /// or not unique, and on options out of range.
  LocalisationServer(std::span<const ServedMemory> memories,
                     const LocalisationServerOptions& options);
  /// Accepts no more pictures; waiting ones are answered, for 5 s at most.
  ~LocalisationServer();
  LocalisationServer(const LocalisationServer&) = delete;
  LocalisationServer& operator=(const LocalisationServer&) = delete;

  /// Returns "http://127.0.0.1:41234", the prefix of the paths of docs/formats.md.
  [[nodiscard]] std::string url() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::server
