#pragma once

namespace panonav::fleet {

/// Registers memories on PostgreSQL servers (`register_memory_scheme`): this process then accepts
/// their addresses wherever it accepts the path of a memory file. Call it once, before memories are
/// opened. Their addresses:
///
///     postgresql://[USER[:PASSWORD]@][HOST][:PORT]/DATABASE?memory=NAME
///
/// libpq reads the address, and missing parts from the environment, the service file and the
/// password file. Three parameters are panonav's own: `memory` is the name of the memory; `fleet`
/// its owner, if that is not the login's own fleet; `robot` the robot that adds views. All others
/// (sslmode, sslrootcert, connect_timeout, ...) are passed to libpq. "postgres://" means the same.
void register_postgresql_memories();

}  // namespace panonav::fleet
