#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "panonav/storage/memory_file.hpp"

namespace panonav {

class MemoryTables;

/// Access to memories that are not in files: they have addresses "SCHEME://...". All functions
/// throw FileError when the server cannot be reached or refuses.
class MemoryScheme {
 public:
  virtual ~MemoryScheme() = default;
  /// True if there is a memory at the address.
  [[nodiscard]] virtual bool exists(const std::filesystem::path& address) const = 0;
  /// Returns the name of the memory. Throws FileError on an address that names none.
  [[nodiscard]] virtual std::string name_memory(const std::filesystem::path& address) const = 0;
  /// Makes a memory with what `fill` writes, whole or not at all. Throws FileError when there is
  /// one already.
  virtual void create(const std::filesystem::path& address, const MemoryHeader& header,
                      const std::function<void(MemoryTables&)>& fill) const = 0;
  /// Opens the rows of a memory. Throws FileError when there is none, and with read_write where
  /// the user may not change it.
  [[nodiscard]] virtual std::unique_ptr<MemoryTables> open(const std::filesystem::path& address,
                                                           Access access) const = 0;
  /// Listens to changes of a memory from here on. The returned function does not wait; it returns
  /// true if the memory was changed since its last call, and throws FileError when the server
  /// cannot be reached. Throws FileError when there is no such memory.
  [[nodiscard]] virtual std::function<bool()> listen(
      const std::filesystem::path& address) const = 0;
  /// Opens the index of a memory that is searched on its server. Throws FileError when there is
  /// none.
  [[nodiscard]] virtual std::unique_ptr<IndexedMemory> open_index(
      const std::filesystem::path& address) const = 0;
};

/// Registers a scheme ("postgresql"), whose addresses this process then accepts wherever it takes
/// the path of a memory file; replaces the scheme of that name. Any thread may call.
void register_memory_scheme(std::string_view name, std::shared_ptr<const MemoryScheme> scheme);

/// Sets for how long a server of memories may be silent before whoever waits for its answer gets a
/// FileError, also those who wait already. 10 minutes if it is never called, as one statement may
/// change a large memory. Throws ContractError for less than 2 s. Any thread may call.
void set_reply_timeout(std::chrono::milliseconds timeout);
/// Returns it, for schemes.
[[nodiscard]] std::chrono::milliseconds reply_timeout();

/// Called with the memory and a row of it that was left out, as it holds what no program of ours
/// writes; `view` is empty if it is no view. By any thread.
using LeftOutHandler =
    std::function<void(const std::filesystem::path& memory, const MemoryFile::Fault& row)>;
/// Sets the handler that is notified of bad rows of memories on servers, of each opened memory the
/// first few; by default nobody. Any thread may call.
void set_left_out_handler(LeftOutHandler handler);
/// Calls the handler, for schemes.
void report_left_out(const std::filesystem::path& memory, const MemoryFile::Fault& row);

/// Returns the scheme of an address, nullptr for the path of a file. Throws FileError on an address
/// of a scheme that is not registered.
[[nodiscard]] std::shared_ptr<const MemoryScheme> find_memory_scheme(
    const std::filesystem::path& memory);

}  // namespace panonav
