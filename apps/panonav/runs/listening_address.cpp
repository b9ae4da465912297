#include "runs/listening_address.hpp"

#include <arpa/inet.h>

#include "cli/arguments.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"

namespace panonav::command {

ListeningAddress parse_listening_address(std::string_view flag, const std::string& text) {
  ListeningAddress parsed;
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos) parsed.address = text.substr(0, colon);
  const std::string_view port =
      std::string_view(text).substr(colon == std::string::npos ? 0 : colon + 1);
  in_addr ignored{};
  if (!read_number(port, parsed.port) || parsed.port < 0 || parsed.port > 65535 ||
      inet_pton(AF_INET, parsed.address.c_str(), &ignored) != 1) {
    throw UsageError(std::string(flag) + " is " + to_readable_line(text) +
                     "; allowed: a port, 0 to 65535, or an IPv4 address of this machine with a " +
                     "port, such as 192.168.1.5:8080");
  }
  return parsed;
}

}  // namespace panonav::command
