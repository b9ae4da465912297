#pragma once

#include <functional>
#include <memory>

#include "panonav/storage/internal/memory_tables.hpp"
#include "panonav/storage/internal/server_address.hpp"

namespace panonav {

/// Where panonav was built without libpq, all of these throw one FileError that says so. Otherwise
/// they throw FileError where the server cannot be reached or refuses.

/// Makes an empty memory on the server and, with enough rights, the schema and the roles where
/// there are none (docs/scale.md); `fill` is run in the same transaction. Throws FileError when
/// there is a memory of that name.
void make_postgresql_memory(const ServerAddress& address, const MemoryHeader& header,
                            const std::function<void(MemoryTables&)>& fill);
/// Throws FileError when there is no memory of that name, and with read_write where the login may
/// not add to it.
[[nodiscard]] std::unique_ptr<MemoryTables> open_postgresql_tables(const ServerAddress& address,
                                                                   Access access);
[[nodiscard]] bool postgresql_memory_exists(const ServerAddress& address);

}  // namespace panonav
