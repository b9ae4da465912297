#include "panonav/storage/memory_address.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_scheme.hpp"

namespace panonav {

namespace {

// The schemes of this process, by the beginnings of addresses, such as "postgresql://".
struct RegisteredSchemes {
  std::mutex mutex;
  std::map<std::string, std::shared_ptr<const MemoryScheme>, std::less<>> schemes;
};

RegisteredSchemes& registered_schemes() {
  static RegisteredSchemes registered;
  return registered;
}

std::shared_ptr<const MemoryScheme> find_registered_scheme(const std::filesystem::path& memory) {
  RegisteredSchemes& registered = registered_schemes();
  const std::lock_guard lock(registered.mutex);
  for (const auto& [beginning, scheme] : registered.schemes) {
    if (memory.native().starts_with(beginning)) return scheme;
  }
  return nullptr;
}

struct RegisteredHandler {
  std::mutex mutex;
  SkippedRowHandler handler;
};

RegisteredHandler& skipped_row_handler() {
  static RegisteredHandler registered;
  return registered;
}

std::atomic<std::chrono::milliseconds> process_reply_timeout{std::chrono::minutes(10)};

}  // namespace

void register_memory_scheme(std::string_view name, std::shared_ptr<const MemoryScheme> scheme) {
  RegisteredSchemes& registered = registered_schemes();
  const std::lock_guard lock(registered.mutex);
  registered.schemes.insert_or_assign(std::string(name) + "://", std::move(scheme));
}

void set_reply_timeout(std::chrono::milliseconds timeout) {
  require(timeout >= std::chrono::seconds(2), "reply time-out in ms",
          static_cast<double>(timeout.count()), "2000 or more");
  process_reply_timeout = timeout;
}

std::chrono::milliseconds reply_timeout() {
  return process_reply_timeout;
}

void set_skipped_row_handler(SkippedRowHandler handler) {
  RegisteredHandler& registered = skipped_row_handler();
  const std::lock_guard lock(registered.mutex);
  registered.handler = std::move(handler);
}

void report_skipped_row(const std::filesystem::path& memory, const MemoryFile::Fault& row) {
  RegisteredHandler& registered = skipped_row_handler();
  const std::lock_guard lock(registered.mutex);
  if (registered.handler) registered.handler(memory, row);
}

std::shared_ptr<const MemoryScheme> find_memory_scheme(const std::filesystem::path& memory) {
  auto scheme = find_registered_scheme(memory);
  const std::size_t colon = memory.native().find("://");
  if (scheme || colon == std::string::npos || colon == 0) return scheme;
  const std::string name = memory.native().substr(0, colon);
  if (!std::ranges::all_of(name, [](char c) { return c >= 'a' && c <= 'z'; })) return nullptr;
  throw FileError(mask_passwords(memory.native()),
                  "is an address, and this program was built without memories at '" + name +
                      "'; allowed: the path of a memory file");
}

std::unique_ptr<IndexedMemory> open_index_if_large(const std::filesystem::path& memory,
                                                   const MemoryFile& file,
                                                   std::size_t max_held_views) {
  const auto scheme = find_registered_scheme(memory);
  if (!scheme || file.views().size() <= max_held_views) return nullptr;
  return scheme->open_index(memory);
}

bool is_server_address(const std::filesystem::path& memory) {
  return find_registered_scheme(memory) != nullptr;
}

bool memory_exists(const std::filesystem::path& memory) {
  const auto scheme = find_memory_scheme(memory);
  return scheme ? scheme->exists(memory) : std::filesystem::exists(memory);
}

std::string memory_name(const std::filesystem::path& memory) {
  const auto scheme = find_memory_scheme(memory);
  return scheme ? scheme->get_memory_name(memory) : memory.filename().string();
}

}  // namespace panonav
