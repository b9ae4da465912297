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

/// A memory under the name by which clients ask for it.
struct ServedMemory {
  std::string name;  ///< 1 to 64 letters, digits, '-', '_' and '.'
  std::filesystem::path path;
};

struct LocalisationServerOptions {
  std::string address = "127.0.0.1";  ///< an IPv4 address of this machine, to listen at
  int port = 0;                       ///< 0 .. 65535; 0: one that is free
  int threads = 0;                    ///< that answer pictures; 0: one per core; at most 1024
  std::size_t max_waiting = 64;       ///< pictures that wait for a thread; further ones get 503
  std::string token;                  ///< that clients must send; empty: none
  LocaliserOptions localiser;
  /// Memories on a server with more views are not held but searched where they lie
  /// (`PlaceRecogniserOptions::max_held_views`), which takes longer for each picture.
  std::size_t max_held_views = 200'000;
  /// Poll interval of memory files for changes.
  std::chrono::milliseconds look_every{1000};
  /// Is told in one line what happens to a memory while it is served; called on another thread.
  std::function<void(const std::string& line)> note;
};

/// Answers where pictures were taken, over HTTP (docs/formats.md, "HTTP"): pictures as PNG or JPEG
/// in, JSON out, as `PlaceRecogniser` answers, to the bit. Pictures wait in a bounded queue; a
/// picture has at most 16 MiB and 33,554,432 pixels, waiting ones 128 MiB together. A memory whose
/// file was changed is read again while the old one answers.
///
/// Without a token every program that reaches the port is answered, but no page of another origin
/// or one that used a name other than "localhost" (DNS rebinding). There is no encryption: use a
/// proxy outside of trusted networks.
class LocalisationServer {
 public:
  /// Reads the memories and listens from here on. Throws FileError as `PlaceRecogniser`, Error
  /// where address and port are not to be had, ContractError on no memory, on names that are not
  /// allowed or stand twice, and on options out of range.
  LocalisationServer(std::span<const ServedMemory> memories,
                     const LocalisationServerOptions& options);
  /// Takes no more pictures; those that wait are answered, for 5 s at most.
  ~LocalisationServer();
  LocalisationServer(const LocalisationServer&) = delete;
  LocalisationServer& operator=(const LocalisationServer&) = delete;

  /// "http://127.0.0.1:41234": before the paths of docs/formats.md.
  [[nodiscard]] std::string url() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::server
