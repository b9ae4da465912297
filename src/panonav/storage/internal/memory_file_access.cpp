#include "panonav/storage/internal/memory_file_access.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/temporary_file.hpp"
#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/internal/memory_schema.hpp"
#include "panonav/storage/internal/sqlite_tables.hpp"
#include "panonav/storage/internal/write_ahead_log.hpp"
#include "panonav/storage/memory_header.hpp"
#include "panonav/storage/memory_scheme.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

std::string system_message() {
  return std::generic_category().message(errno);
}

fs::path parent_folder(const fs::path& path) {
  const fs::path folder = path.parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

bool is_writable(const fs::path& path) {
  return ::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) == 0;
}

// A new name is durable only when its folder is synchronised, too.
void sync_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;  // not possible in folders that cannot be read
  static_cast<void>(::fsync(descriptor));
  ::close(descriptor);
}

void remove_log_files(const fs::path& path) {
  for (const char* suffix : {"-journal", "-wal", "-shm"}) {
    ::unlink(with_suffix(path, suffix).c_str());
  }
}

/// Opens a file with changes in its log if the shared index of the log cannot be made, as on a full
/// disk. The index is kept in memory, which locks others out until the file is closed.
Database read_with_private_index(const fs::path& file) {
  Database database(file, DatabaseMode::change);
  database.leave_log_on_close();
  database.execute("PRAGMA locking_mode=EXCLUSIVE");
  database.execute("PRAGMA query_only=ON");
  static_cast<void>(database.integer("PRAGMA schema_version"));
  return database;
}

Database open_memory_database(const fs::path& path, Access access) {
  require_memory_file(path);
  const std::string name = path.string();
  // SQLite puts its log next to the target of a link.
  std::error_code ignored;
  const fs::path file = fs::weakly_canonical(path, ignored);
  const bool may_write = is_writable(file) && is_writable(parent_folder(file));
  if (access == Access::read_write) {
    if (!may_write) {
      throw FileError(name, "cannot be changed: no permission to write the file and its folder");
    }
    require_own_log(file);
    Database database(file, DatabaseMode::change);
    database.execute("PRAGMA synchronous=FULL");
    return database;
  }
  const fs::path log = with_suffix(file, "-wal");
  const auto size_of = [&](const fs::path& part) -> std::uintmax_t {
    return fs::exists(part, ignored) ? fs::file_size(part, ignored) : 0;
  };
  // Programs that use a log share an index of at least one region (sqlite.org/walformat.html); on a
  // full disk it may be shorter.
  constexpr std::uintmax_t index_region_bytes = 32768;
  const auto is_log_in_use = [&] {
    return size_of(with_suffix(file, "-shm")) >= index_region_bytes;
  };
  // True if nobody has the file open for writing and no changes are left in the log.
  const auto is_at_rest = [&] { return size_of(log) == 0 && !is_log_in_use(); };
  // A reader without write permission cannot create the log that SQLite needs.
  if (!may_write && is_at_rest()) {
    return {file, DatabaseMode::immutable};
  }
  require_own_log(file);
  try {
    // Opened for writing if possible, so that SQLite can remove its log at the end; no statement
    // may write.
    Database database(file, may_write ? DatabaseMode::change : DatabaseMode::read);
    database.execute("PRAGMA query_only=ON");
    // The first access to the file makes SQLite create or find its log.
    static_cast<void>(database.integer("PRAGMA schema_version"));
    return database;
  } catch (const FileError&) {
    // There is no room for a log on a full disk, or the file system cannot share one. For a damaged
    // file the next attempt fails as well.
    if (is_at_rest()) return {file, DatabaseMode::immutable};
    if (may_write && !is_log_in_use()) return read_with_private_index(file);
    if (may_write || size_of(log) == 0) throw;
    throw FileError(name,
                    "has changes in " + log.string() +
                        " that can be read only with permission to write the folder; open the "
                        "file once with that permission");
  }
}

// Switches a checked file to a write-ahead log, as changes require.
void prepare_for_changes(Database& database) {
  Statement mode(database, "PRAGMA journal_mode=WAL");
  if (!mode.step() || mode.text(0) != "wal") {
    throw FileError(database.path().string(),
                    "is being used by another program; its first change needs it alone");
  }
  mode.reset();
  database.watch_for_moves();
}

[[noreturn]] void throw_name_taken(const fs::path& path) {
  throw FileError(path.string(), "already exists; allowed: a name that is free");
}

void check_path_is_free(const fs::path& path) {
  std::error_code ignored;
  const std::string name = path.string();
  if (fs::exists(fs::symlink_status(path, ignored))) throw_name_taken(path);
  const fs::path folder = parent_folder(path);
  if (!fs::is_directory(folder, ignored)) {
    throw FileError(name, "cannot be created: there is no folder " + folder.string());
  }
  if (!is_writable(folder)) {
    throw FileError(name, "cannot be created: no permission to write in " + folder.string());
  }
  // SQLite would take a stray log of an earlier file for this file's own.
  for (const char* suffix : {"-wal", "-shm", "-journal"}) {
    const fs::path stray = with_suffix(path, suffix);
    if (fs::exists(fs::symlink_status(stray, ignored))) {
      throw FileError(name, "cannot be created: " + stray.string() +
                                " of an earlier file with this name still exists");
    }
  }
}

// Fails if the name has been used in the meantime. File systems that cannot rename without
// replacing can make a hard link; where neither works, a file of that name would be replaced.
void move_to_final_name(TemporaryFile& unfinished, const fs::path& path) {
  const char* from = unfinished.path().c_str();
  if (::renameat2(AT_FDCWD, from, AT_FDCWD, path.c_str(), RENAME_NOREPLACE) == 0) {
    unfinished.keep();
  } else if (errno == EEXIST) {
    throw_name_taken(path);
  } else if (::link(from, path.c_str()) != 0) {
    if (errno == EEXIST) throw_name_taken(path);
    if ((errno != EPERM && errno != EOPNOTSUPP && errno != ENOSYS) ||
        ::rename(from, path.c_str()) != 0) {
      throw FileError(path.string(), "cannot be created: " + system_message());
    }
    unfinished.keep();
  }
  sync_folder(parent_folder(path));
}

}  // namespace

void create_memory_tables(const fs::path& path, const MemoryHeader& header,
                          const std::function<void(MemoryTables&)>& fill) {
  validate(header);
  if (const auto scheme = find_memory_scheme(path)) return scheme->create(path, header, fill);
  check_path_is_free(path);
  TemporaryFile unfinished(path);
  remove_log_files(unfinished.path());
  try {
    Database database(unfinished.path(), DatabaseMode::create);
    database.execute("PRAGMA synchronous=FULL");
    // A page holds three views of 80 x 15; larger pages would write more bytes for each append.
    database.execute("PRAGMA page_size=8192");
    DatabaseTransaction transaction(database, MemoryTables::Kind::writing);
    create_schema(database);
    for (const auto& [key, value] : to_settings(header)) write_setting(database, key, value);
    transaction.commit();
    database.execute("PRAGMA journal_mode=WAL");
    if (fill) {
      SqliteTables tables(path, std::move(database));
      const auto filling = tables.transaction(MemoryTables::Kind::writing);
      fill(tables);
      filling->commit();
    }
  } catch (...) {
    remove_log_files(unfinished.path());
    throw;
  }
  move_to_final_name(unfinished, path);
}

OpenedMemory open_memory_tables(const fs::path& path, Access access) {
  std::optional<MemoryHeader> header;
  if (const auto scheme = find_memory_scheme(path)) {
    auto tables = scheme->open(path, access);
    try {
      header = to_header(tables->settings());
    } catch (const ContractError& error) {
      tables->fail_damaged(error.what());
    }
    return {std::move(tables), std::move(*header)};
  }
  Database database = open_memory_database(path, access);
  try {
    const DatabaseTransaction reading(database, MemoryTables::Kind::reading);
    require_schema(database);
    header = to_header(read_settings(database));
  } catch (const FileError&) {
    database.leave_log_on_close();
    throw;
  } catch (const Error& error) {
    database.leave_log_on_close();
    database.fail_damaged(error.what());
  }
  if (access == Access::read_write) prepare_for_changes(database);
  return {std::make_unique<SqliteTables>(path, std::move(database)), std::move(*header)};
}

}  // namespace panonav
