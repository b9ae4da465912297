#include "panonav/storage/memory_address.hpp"

#include <algorithm>
#include <array>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/postgresql_tables.hpp"
#include "panonav/storage/internal/server_address.hpp"

namespace panonav {

namespace {

constexpr std::array<std::string_view, 2> schemes{"postgresql://", "postgres://"};

std::optional<int> hexadecimal_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return std::nullopt;
}

// "%41" is "A". Empty where the text is nothing of the kind.
std::optional<std::string> percent_decoded(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    if (i + 2 >= text.size()) return std::nullopt;
    const auto high = hexadecimal_digit(text[i + 1]);
    const auto low = hexadecimal_digit(text[i + 2]);
    if (!high || !low || (*high == 0 && *low == 0)) return std::nullopt;
    decoded += static_cast<char>(*high * 16 + *low);
    i += 2;
  }
  return decoded;
}

// An address with what may hide a password replaced: all between the first colon of the host part
// and the last @, whatever was forgotten to be escaped, and the parameter.
std::string shown_address(std::string_view address, std::size_t scheme) {
  std::string shown(address);
  const std::size_t query = std::min(shown.find('?'), shown.size());
  const std::size_t at = shown.rfind('@');
  const std::size_t colon = shown.find(':', scheme);
  if (at != std::string::npos && colon < at) shown.replace(colon + 1, at - colon - 1, "***");
  for (const std::string_view name : {"password=", "sslpassword="}) {
    std::size_t from = std::min(query, shown.size());
    while ((from = shown.find(name, from)) != std::string::npos) {
      from += name.size();
      const std::size_t end = std::min(shown.find('&', from), shown.size());
      shown.replace(from, end - from, "***");
    }
  }
  return shown;
}

}  // namespace

bool is_server_address(const std::filesystem::path& memory) {
  return std::ranges::any_of(
      schemes, [&](std::string_view scheme) { return memory.native().starts_with(scheme); });
}

bool memory_exists(const std::filesystem::path& memory) {
  return is_server_address(memory) ? postgresql_memory_exists(parse_server_address(memory))
                                   : std::filesystem::exists(memory);
}

std::string memory_name(const std::filesystem::path& memory) {
  return is_server_address(memory) ? parse_server_address(memory).memory
                                   : memory.filename().string();
}

std::string without_passwords(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    std::size_t begin = text.size();
    std::size_t scheme = 0;
    for (const std::string_view name : schemes) {
      const std::size_t found = text.find(name);
      if (found < begin) {
        begin = found;
        scheme = name.size();
      }
    }
    result += text.substr(0, begin);
    text.remove_prefix(begin);
    const std::size_t end = std::min(text.find_first_of(" \t\n\"'"), text.size());
    result += shown_address(text.substr(0, end), scheme);
    text.remove_prefix(end);
  }
  return result;
}

ServerAddress parse_server_address(const std::filesystem::path& memory) {
  const std::string& text = memory.native();
  ServerAddress address;
  address.shown = without_passwords(text);
  const auto refuse = [&](const std::string& what) {
    throw FileError(address.shown.native(), what);
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
                           : percent_decoded(parameter.substr(equals + 1));
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

}  // namespace panonav
