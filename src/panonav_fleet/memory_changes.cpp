#include "panonav_fleet/memory_changes.hpp"

#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav_fleet/internal/postgresql_memory.hpp"

namespace panonav::fleet {

MemoryArea to_memory_area(double x_m, double y_m) {
  return {std::floor(x_m / memory_area_side_m), std::floor(y_m / memory_area_side_m)};
}

struct MemoryChanges::Implementation {
  explicit Implementation(const ServerAddress& address)
      : memories(connect_to_memories(address, false)) {
    const auto found = find_memory(memories, address);
    if (!found) throw_missing_memory(address);
    memories.connection.execute("LISTEN \"" + found->channel + "\"");  // name chosen by the server
  }
  MemoriesConnection memories;
};

std::optional<MemoryChange> MemoryChanges::wait(std::chrono::milliseconds timeout) {
  const auto payload = implementation_->memories.connection.wait_for_notification(
      std::chrono::duration<double>(timeout).count());
  if (!payload) return std::nullopt;
  MemoryChange change;
  for (const std::string& word : split_words(*payload)) {
    const std::size_t comma = word.find(',');
    MemoryArea area;
    if (comma == std::string::npos || !read_number(word.substr(0, comma), area.column) ||
        !read_number(word.substr(comma + 1), area.row)) {
      break;
    }
    change.areas.push_back(area);
  }
  return change;
}

MemoryChanges::MemoryChanges(const std::filesystem::path& memory) {
  if (!is_postgresql_address(memory)) {
    throw FileError(memory.string(), "is a file; allowed: the address of a memory on a server");
  }
  implementation_ = std::make_unique<Implementation>(parse_server_address(memory));
}

MemoryChanges::~MemoryChanges() = default;
MemoryChanges::MemoryChanges(MemoryChanges&&) noexcept = default;
MemoryChanges& MemoryChanges::operator=(MemoryChanges&&) noexcept = default;

}  // namespace panonav::fleet
