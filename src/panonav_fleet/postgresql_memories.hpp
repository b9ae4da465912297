#pragma once

namespace panonav::fleet {

/// Makes memories on PostgreSQL servers available wherever this process takes the path of a memory
/// file (`register_memory_scheme`). Call it once, before memories are opened. Their addresses:
///
///     postgresql://[USER[:PASSWORD]@][HOST][:PORT]/DATABASE?memory=NAME
///
/// libpq reads the address, and missing parts from the environment, the service file and the
/// password file. Three parameters are panonav's own: `memory` is the name of the memory, `fleet`
/// its owner if that is not the login's own fleet, and `robot` the robot that adds to it; all
/// others (sslmode, sslrootcert, connect_timeout, ...) are libpq's. "postgres://" is the same.
void register_postgresql_memories();

}  // namespace panonav::fleet
