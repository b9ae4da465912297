#include "panonav/storage/indexed_memory.hpp"

#include <mutex>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav {

namespace {

struct RegisteredIndex {
  std::mutex mutex;
  OpenIndexedMemory open;
};

RegisteredIndex& registered_index() {
  static RegisteredIndex registered;
  return registered;
}

}  // namespace

void register_indexed_memories(OpenIndexedMemory open) {
  const std::lock_guard lock(registered_index().mutex);
  registered_index().open = std::move(open);
}

std::unique_ptr<IndexedMemory> open_indexed_memory(const std::filesystem::path& memory) {
  OpenIndexedMemory open;
  {
    const std::lock_guard lock(registered_index().mutex);
    open = registered_index().open;
  }
  if (!open) {
    throw FileError(without_passwords(memory.string()),
                    "cannot be searched where it lies: this program has no part for it");
  }
  return open(memory);
}

}  // namespace panonav
