#include "panonav/storage/memory_address.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_scheme.hpp"

namespace panonav {

namespace {

// The one table of the process, by the beginnings of addresses: "postgresql://".
struct RegisteredSchemes {
  std::mutex mutex;
  std::map<std::string, std::shared_ptr<const MemoryScheme>, std::less<>> schemes;
};

RegisteredSchemes& registered_schemes() {
  static RegisteredSchemes registered;
  return registered;
}

std::shared_ptr<const MemoryScheme> find_registered(const std::filesystem::path& memory) {
  RegisteredSchemes& registered = registered_schemes();
  const std::lock_guard lock(registered.mutex);
  for (const auto& [beginning, scheme] : registered.schemes) {
    if (memory.native().starts_with(beginning)) return scheme;
  }
  return nullptr;
}

// An address with what may hide a password replaced: all between the first colon of the host part
// and the last @, whatever was forgotten to be escaped, and the parameter.
std::string mask_password(std::string_view address, std::size_t scheme) {
  std::string masked(address);
  const std::size_t query = std::min(masked.find('?'), masked.size());
  const std::size_t at = masked.rfind('@');
  const std::size_t colon = masked.find(':', scheme);
  if (at != std::string::npos && colon < at) masked.replace(colon + 1, at - colon - 1, "***");
  for (const std::string_view name : {"password=", "sslpassword="}) {
    std::size_t from = std::min(query, masked.size());
    while ((from = masked.find(name, from)) != std::string::npos) {
      from += name.size();
      const std::size_t end = std::min(masked.find('&', from), masked.size());
      masked.replace(from, end - from, "***");
    }
  }
  return masked;
}

}  // namespace

void register_memory_scheme(std::string_view name, std::shared_ptr<const MemoryScheme> scheme) {
  RegisteredSchemes& registered = registered_schemes();
  const std::lock_guard lock(registered.mutex);
  registered.schemes.insert_or_assign(std::string(name) + "://", std::move(scheme));
}

std::shared_ptr<const MemoryScheme> find_memory_scheme(const std::filesystem::path& memory) {
  auto scheme = find_registered(memory);
  const std::size_t colon = memory.native().find("://");
  if (scheme || colon == std::string::npos || colon == 0) return scheme;
  const std::string name = memory.native().substr(0, colon);
  if (!std::ranges::all_of(name, [](char c) { return c >= 'a' && c <= 'z'; })) return nullptr;
  throw FileError(without_passwords(memory.native()),
                  "is an address, and this program was built without memories at '" + name +
                      "'; allowed: the path of a memory file");
}

bool is_server_address(const std::filesystem::path& memory) {
  return find_registered(memory) != nullptr;
}

bool memory_exists(const std::filesystem::path& memory) {
  const auto scheme = find_memory_scheme(memory);
  return scheme ? scheme->exists(memory) : std::filesystem::exists(memory);
}

std::string memory_name(const std::filesystem::path& memory) {
  const auto scheme = find_memory_scheme(memory);
  return scheme ? scheme->name_memory(memory) : memory.filename().string();
}

std::string without_passwords(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    std::size_t begin = text.size();
    std::size_t scheme = 0;
    for (const std::string_view name : {"postgresql://", "postgres://"}) {
      const std::size_t found = text.find(name);
      if (found < begin) {
        begin = found;
        scheme = name.size();
      }
    }
    result += text.substr(0, begin);
    text.remove_prefix(begin);
    const std::size_t end = std::min(text.find_first_of(" \t\n\"'"), text.size());
    result += mask_password(text.substr(0, end), scheme);
    text.remove_prefix(end);
  }
  return result;
}

}  // namespace panonav
