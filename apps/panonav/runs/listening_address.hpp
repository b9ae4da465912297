#pragma once

#include <string>
#include <string_view>

namespace panonav::command {

/// Address and port of a server of this program.
struct ListeningAddress {
  std::string address = "127.0.0.1";
  int port = 0;
  /// True if only programs on this machine can connect.
  [[nodiscard]] bool is_local() const { return address.starts_with("127."); }
};

/// Parses "8080" or "192.168.1.5:8080". Throws UsageError that names the flag.
[[nodiscard]] ListeningAddress parse_listening_address(std::string_view flag,
                                                       const std::string& text);

}  // namespace panonav::command
