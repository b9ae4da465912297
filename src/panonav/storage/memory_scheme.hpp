#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "panonav/storage/memory_file.hpp"

namespace panonav {

class MemoryTables;

/// Access to memories that are not in files and have addresses "SCHEME://...". All functions throw
/// FileError if the server cannot be reached or refuses access.
class MemoryScheme {
 public:
  virtual ~MemoryScheme() = default;
  /// True if there is a memory at the address.
  [[nodiscard]] virtual bool exists(const std::filesystem::path& address) const = 0;
  /// Returns the name of the memory. Throws FileError if the address names none.
  [[nodiscard]] virtual std::string get_memory_name(const std::filesystem::path& address) const = 0;
  /// Creates a memory with the content that `fill` writes, completely or not at all. Throws
  /// FileError if it exists already.
  virtual void create(const std::filesystem::path& address, const MemoryHeader& header,
                      const std::function<void(MemoryTables&)>& fill) const = 0;
  /// Opens the rows of a memory. Throws FileError if there is none, or with read_write if the user
  /// may not change it.
  [[nodiscard]] virtual std::unique_ptr<MemoryTables> open(const std::filesystem::path& address,
                                                           Access access) const = 0;
  /// Starts to listen to changes of a memory. The returned function never waits; it returns true if
  /// the memory was changed since its last call, and throws FileError if the server cannot be
  /// reached. Throws FileError if there is no such memory.
  [[nodiscard]] virtual std::function<bool()> listen(
      const std::filesystem::path& address) const = 0;
  /// Opens the index of a memory that is searched on its server. Throws FileError if there is none.
  [[nodiscard]] virtual std::unique_ptr<IndexedMemory> open_index(
      const std::filesystem::path& address) const = 0;
};

/// Registers a scheme ("postgresql") or replaces the one of that name. This process then accepts
/// its addresses wherever it accepts the path of a memory file. Any thread may call.
void register_memory_scheme(std::string_view name, std::shared_ptr<const MemoryScheme> scheme);

/// Sets how long a server of memories may be silent until functions that wait for its answer throw
/// FileError; it applies at once, also to those that are waiting. The default is 10 minutes,
/// because one statement may change a large memory. Throws ContractError for less than 2 s. Any
/// thread may call.
void set_reply_timeout(std::chrono::milliseconds timeout);
/// Returns the time of `set_reply_timeout`, for schemes.
[[nodiscard]] std::chrono::milliseconds reply_timeout();

/// Called from any thread with a memory and a row that was left out because our programs never
/// write such content; `view` is nullopt if the row is no view.
using SkippedRowHandler =
    std::function<void(const std::filesystem::path& memory, const MemoryFile::Fault& row)>;
/// Sets the handler to which the first few bad rows of each opened memory on a server are reported;
/// by default there is none. Any thread may call.
void set_skipped_row_handler(SkippedRowHandler handler);
/// Calls the handler of `set_skipped_row_handler`; for schemes.
void report_skipped_row(const std::filesystem::path& memory, const MemoryFile::Fault& row);

/// Returns the scheme of an address; nullptr for the path of a file. Throws FileError if the
/// scheme of the address is not registered.
[[nodiscard]] std::shared_ptr<const MemoryScheme> find_memory_scheme(
    const std::filesystem::path& memory);

/// Opens the index of a memory on a server that has more than `max_held_views` views; nullptr for
/// smaller ones and for files, which are loaded. `file`: the open memory. Throws FileError if the
/// server cannot be reached. Cost: reading all ids.
[[nodiscard]] std::unique_ptr<IndexedMemory> open_index_if_large(
    const std::filesystem::path& memory, const MemoryFile& file, std::size_t max_held_views);

}  // namespace panonav
