#pragma once

#include <string>
#include <string_view>

namespace panonav::command {

/// Address and port of a server of this program.
struct ListeningPlace {
  std::string address = "127.0.0.1";
  int port = 0;
  /// True if only programs of this machine reach it.
  [[nodiscard]] bool is_local() const { return address.starts_with("127."); }
};

/// Parses "8080" or "192.168.1.5:8080". Throws UsageError, which names the flag.
[[nodiscard]] ListeningPlace parse_listening_address(std::string_view flag,
                                                     const std::string& text);

}  // namespace panonav::command
