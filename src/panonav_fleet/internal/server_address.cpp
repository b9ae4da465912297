#include "panonav_fleet/internal/server_address.hpp"

#include <algorithm>
#include <string_view>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav::fleet {

namespace {

std::optional<int> parse_hexadecimal_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return std::nullopt;
}

// "%41" is "A". Empty where the text is nothing of the kind.
std::optional<std::string> decode_percent(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    const auto high = parse_hexadecimal_digit(text[i + 1]);
    const auto low = parse_hexadecimal_digit(text[i + 2]);
    if (!high || !low || (*high == 0 && *low == 0)) return std::nullopt;
    decoded += static_cast<char>(*high * 16 + *low);
    i += 2;
  }
  return decoded;
}

}  // namespace

bool is_postgresql_address(const std::filesystem::path& memory) {
  return memory.native().starts_with("postgresql://") || memory.native().starts_with("postgres://");
}

ServerAddress parse_server_address(const std::filesystem::path& memory) {
  const std::string& text = memory.native();
  fleet::ServerAddress address;
  address.printable = without_passwords(text);
  const auto refuse = [&](const std::string& what) {
    throw FileError(address.printable.native(), what);
  };
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
