#include "panonav_fleet/internal/server_address.hpp"

#include <algorithm>
#include <string_view>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav::fleet {

namespace {

// False if libpq could take a part of an unescaped password for a host, port or database, which it
// shows in its messages.
bool has_unambiguous_credentials(std::string_view address) {
  const std::string_view rest = address.substr(address.find("://") + 3);
  const std::string_view authority = rest.substr(0, rest.find_first_of("/?#"));
  const std::size_t at = authority.rfind('@');
  const std::string_view user = authority.substr(0, at == std::string_view::npos ? 0 : at);
  const std::string_view hosts = authority.substr(at == std::string_view::npos ? 0 : at + 1);
  if (user.find('@') != std::string_view::npos) return false;
  // Behind the authority an @ is allowed only in the value of a parameter.
  const std::string_view below = rest.substr(authority.size());
  if (below.find('@') < std::min(below.find('='), below.size())) return false;
  for (std::size_t colon = hosts.find(':'); colon < hosts.size();) {
    if (hosts.find(']', colon) != std::string_view::npos) {  // within a number such as [::1]
      colon = hosts.find(':', hosts.find(']', colon));
      continue;
    }
    const std::size_t end = std::min(hosts.find(',', colon), hosts.size());
    if (hosts.substr(colon + 1, end - colon - 1).find_first_not_of("0123456789") !=
        std::string_view::npos) {
      return false;
    }
    colon = hosts.find(':', end);
  }
  return true;
}

}  // namespace

bool is_postgresql_address(const std::filesystem::path& memory) {
  return memory.native().starts_with("postgresql://") || memory.native().starts_with("postgres://");
}

ServerAddress parse_server_address(const std::filesystem::path& memory) {
  const std::string& text = memory.native();
  fleet::ServerAddress address;
  remember_address(text);
  address.printable = mask_credentials(text);
  const auto refuse = [&](const std::string& what) {
    throw FileError(address.printable.native(), what);
  };
  if (!has_unambiguous_credentials(text)) {
    refuse(
        "its user and password are not written as in a URL, or its port is not a number; allowed: "
        "special characters as %40 for @ and %2F for /");
  }
  const std::size_t query = std::min(text.find('?'), text.size());
  address.uri = text.substr(0, query);
  char separator = '?';
  for (std::size_t at = query; at < text.size();) {
    const std::size_t end = std::min(text.find('&', at + 1), text.size());
    const std::string_view parameter = std::string_view(text).substr(at + 1, end - at - 1);
    at = end;
    const std::size_t equals = parameter.find('=');
    const std::string_view key = parameter.substr(0, equals);
    if (key != "memory" && key != "fleet" && key != "robot") {
      address.uri += separator + std::string(parameter);
      separator = '&';
      continue;
    }
    const auto value = equals == std::string_view::npos
                           ? std::nullopt
                           : decode_percent(parameter.substr(equals + 1));
    if (!value) refuse(std::string(key) + " is not written as in a URL; allowed: %20 for a blank");
    constexpr std::size_t max_bytes = 500;
    const bool control = std::ranges::any_of(
        *value, [](char c) { return static_cast<unsigned char>(c) < 0x20U || c == 0x7F; });
    if (control || value->size() > max_bytes || (value->empty() && key != "fleet")) {
      refuse(std::string(key) + " is '" + (control ? "a text with control characters" : *value) +
             "'; allowed: 1 to 500 bytes, no control characters");
    }
    (key == "memory"  ? address.memory
     : key == "fleet" ? address.fleet.emplace()
                      : address.robot.emplace()) = *value;
  }
  if (address.memory.empty()) {
    refuse("names no memory; allowed: postgresql://HOST/DATABASE?memory=NAME");
  }
  return address;
}

}  // namespace panonav::fleet
