#include "panonav/storage/internal/database.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

// Makes an SQLite URI of an unchangeable file; some characters must be escaped.
std::string make_immutable_uri(const std::filesystem::path& path) {
  constexpr char digits[] = "0123456789ABCDEF";
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte > 0x20 && byte < 0x7F && c != '%' && c != '?' && c != '#') {
      uri += c;
    } else {
      uri += '%';
      uri += digits[byte >> 4U];
      uri += digits[byte & 15U];
    }
  }
  return uri + "?immutable=1";
}

constexpr int steps_between_checks = 20000;  // chosen: about 0.2 ms

std::string to_one_line(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  return text;
}

}  // namespace

void Database::Close::operator()(sqlite3* handle) const noexcept {
  sqlite3_close_v2(handle);
}

Database::Database(std::filesystem::path path, DatabaseMode mode) : path_(std::move(path)) {
  int flags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  // An absolute path cannot be mistaken for a URI or a database in memory.
  std::string name = std::filesystem::absolute(path_).string();
  switch (mode) {
    case DatabaseMode::create:
      flags |= SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
      break;
    case DatabaseMode::change:
      flags |= SQLITE_OPEN_READWRITE;
      break;
    case DatabaseMode::read:
      flags |= SQLITE_OPEN_READONLY;
      break;
    case DatabaseMode::immutable:
      flags |= SQLITE_OPEN_READONLY | SQLITE_OPEN_URI;
      name = make_immutable_uri(path_);
      break;
  }
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(name.c_str(), &handle, flags, nullptr);
  handle_.reset(handle);
  if (code != SQLITE_OK) fail(code);
  // These settings keep a foreign or damaged file from running code, using much memory or never
  // ending.
  constexpr int busy_timeout_ms = 10000;
  constexpr int max_field_bytes = 1 << 28;
  steps_left_ = std::make_unique<std::int64_t>(0);
  set_step_limit();
  sqlite3_progress_handler(
      handle, steps_between_checks,
      [](void* left) {
        auto& steps = *static_cast<std::int64_t*>(left);
        steps -= steps_between_checks;
        return steps < 0 ? 1 : 0;
      },
      steps_left_.get());
  sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, max_field_bytes);
  sqlite3_busy_timeout(handle, busy_timeout_ms);
  execute("PRAGMA cell_size_check=ON");
}

std::filesystem::path with_suffix(std::filesystem::path path, const char* suffix) {
  path += suffix;
  return path;
}

std::int64_t Database::file_bytes() const {
  std::int64_t bytes = 0;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code missing;
    const auto size = std::filesystem::file_size(with_suffix(path_, suffix), missing);
    if (!missing) bytes += static_cast<std::int64_t>(size);
  }
  return bytes;
}

void Database::set_step_limit() {
  // SQLite's own check, the largest query, takes about 2 steps a byte; 12 leave a factor of six as
  // a margin.
  constexpr std::int64_t min_steps = 10'000'000;  // about 0.1 s
  constexpr std::int64_t steps_per_byte = 12;
  step_limit_ = min_steps + steps_per_byte * file_bytes();
  reset_step_count();
}

void Database::reset_step_count() const noexcept {
  *steps_left_ = step_limit_;
}

void Database::require_unmoved() const {
  if (!watches_for_moves_) return;
  int moved = 0;
  sqlite3_file_control(handle_.get(), "main", SQLITE_FCNTL_HAS_MOVED, &moved);
  if (moved == 0) return;
  throw FileError(path_.string(),
                  "was deleted, moved or replaced while it was being written; the new data are not "
                  "in the file with this name");
}

void Database::execute(const char* sql) {
  reset_step_count();
  const int code = sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

std::int64_t Database::integer(const char* sql) {
  Statement statement(*this, sql);
  if (!statement.step()) fail_damaged("an entry is missing");
  return statement.integer(0);
}

bool Database::is_in_transaction() const noexcept {
  return sqlite3_get_autocommit(handle_.get()) == 0;
}

void Database::leave_log_on_close() noexcept {
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
}

void Database::fail_damaged(std::string_view what) const {
  throw FileError(path_.string(), "is damaged: " + std::string(what));
}

namespace {

/// True if statements may not change the database, whatever the rights of its file are.
bool is_open_for_reading(sqlite3* database) {
  bool is_reading = sqlite3_db_readonly(database, "main") == 1;
  const auto read = [](void* result, int, char** values, char**) {
    if (values[0] != nullptr && values[0][0] == '1') *static_cast<bool*>(result) = true;
    return 0;
  };
  sqlite3_exec(database, "PRAGMA query_only", read, &is_reading, nullptr);
  return is_reading;
}

}  // namespace

void Database::fail(int code) const {
  // The message must be copied before another call changes it.
  const std::string text =
      to_one_line(handle_ ? sqlite3_errmsg(handle_.get()) : sqlite3_errstr(code));
  const int system_error = handle_ ? sqlite3_system_errno(handle_.get()) : 0;
  std::string cause = text;
  if (system_error != 0) cause += " (" + std::generic_category().message(system_error) + ")";
  const std::string name = path_.string();
  switch (code & 0xFF) {
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
    case SQLITE_ERROR:  // our statements are valid, so the tables are wrong
    case SQLITE_FORMAT:
    case SQLITE_MISMATCH:
    case SQLITE_TOOBIG:
    case SQLITE_SCHEMA:
      fail_damaged(text);
    case SQLITE_INTERRUPT:
      fail_damaged("its tables are read without end");
    case SQLITE_FULL:
      throw FileError(name, "cannot be written: the disk is full");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      throw FileError(name, "is being written by another program");
    case SQLITE_READONLY:
      if (is_open_for_reading(handle_.get())) {
        throw FileError(name, "is open for reading only; open it for writing to change it");
      }
      [[fallthrough]];
    case SQLITE_PERM:
    case SQLITE_AUTH:
      throw FileError(name, "cannot be written: no permission to write the file and its folder");
    case SQLITE_CANTOPEN:
      throw FileError(name, "cannot be opened: " + cause);
    case SQLITE_IOERR:
      throw FileError(name, "cannot be read or written: " + cause);
    default:
      throw FileError(name, "cannot be used: " + cause);
  }
}

void Statement::Finalise::operator()(sqlite3_stmt* statement) const noexcept {
  sqlite3_finalize(statement);
}

Statement::Statement(Database& database, const char* sql, std::nullptr_t) : database_(&database) {
  database.reset_step_count();
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(database.handle(), sql, -1, SQLITE_PREPARE_PERSISTENT,
                                      &statement, nullptr);
  statement_.reset(statement);
  if (code != SQLITE_OK) database.fail(code);
}

void Statement::check_bind(int code) const {
  if (code == SQLITE_OK) return;
  if (code == SQLITE_TOOBIG) {
    throw ContractError("a text or image for " + database_->path().string(), "too long",
                        "less than 256 MiB");
  }
  database_->fail(code);
}

Statement& Statement::bind_null(int parameter) {
  check_bind(sqlite3_bind_null(statement_.get(), parameter));
  return *this;
}

Statement& Statement::bind(int parameter, std::int64_t value) {
  check_bind(sqlite3_bind_int64(statement_.get(), parameter, value));
  return *this;
}

Statement& Statement::bind(int parameter, double value) {
  check_bind(sqlite3_bind_double(statement_.get(), parameter, value));
  return *this;
}

Statement& Statement::bind(int parameter, std::string_view text) {
  check_bind(sqlite3_bind_text64(statement_.get(), parameter, text.empty() ? "" : text.data(),
                                 text.size(), SQLITE_STATIC, SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind(int parameter, std::span<const std::uint8_t> blob) {
  check_bind(blob.empty() ? sqlite3_bind_zeroblob(statement_.get(), parameter, 0)
                          : sqlite3_bind_blob64(statement_.get(), parameter, blob.data(),
                                                blob.size(), SQLITE_STATIC));
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  reset();
  if (code != SQLITE_DONE) database_->fail(code);
  return false;
}

int Statement::run() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_DONE || (code & 0xFF) == SQLITE_CONSTRAINT) {
    reset();
    return code == SQLITE_DONE ? 0 : code;
  }
  // The cause is read before the reset, which may replace it.
  try {
    database_->fail(code);
  } catch (...) {
    reset();
    throw;
  }
}

void Statement::reset() noexcept {
  sqlite3_reset(statement_.get());
  database_->reset_step_count();
}

int Statement::type(int column) const {
  return sqlite3_column_type(statement_.get(), column);
}

bool Statement::is_null(int column) const {
  return type(column) == SQLITE_NULL;
}

void Statement::require_type(int column, int expected) const {
  if (type(column) != expected) {
    database_->fail_damaged(std::string("column ") + sqlite3_column_name(statement_.get(), column) +
                            " holds a value of a wrong type");
  }
}

std::int64_t Statement::integer(int column) const {
  require_type(column, SQLITE_INTEGER);
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const {
  require_type(column, SQLITE_FLOAT);
  return sqlite3_column_double(statement_.get(), column);
}

std::string_view Statement::text(int column) const {
  require_type(column, SQLITE_TEXT);
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  if (data == nullptr) throw FileError(database_->path().string(), "cannot be read: out of memory");
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

std::span<const std::uint8_t> Statement::blob(int column) const {
  require_type(column, SQLITE_BLOB);
  const auto* data =
      static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  if (data == nullptr && size > 0) {
    throw FileError(database_->path().string(), "cannot be read: out of memory");
  }
  return {data, data == nullptr ? 0 : size};
}

DatabaseTransaction::DatabaseTransaction(Database& database, MemoryTables::Kind kind)
    : database_(database), within_another_(database.is_in_transaction()) {
  if (within_another_) {
    open_ = kind == MemoryTables::Kind::writing;
    if (open_) database_.execute("SAVEPOINT part");
    return;
  }
  database_.set_step_limit();
  database_.execute(kind == MemoryTables::Kind::writing ? "BEGIN IMMEDIATE" : "BEGIN");
  try {
    database_.require_unmoved();
  } catch (...) {
    sqlite3_exec(database_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
    throw;
  }
}

DatabaseTransaction::~DatabaseTransaction() {
  if (!open_ || !database_.is_in_transaction())
    return;  // SQLite has rolled back by itself after a failure
  sqlite3_exec(database_.handle(), within_another_ ? "ROLLBACK TO part; RELEASE part" : "ROLLBACK",
               nullptr, nullptr, nullptr);
}

void DatabaseTransaction::commit() {
  if (within_another_) {
    database_.execute("RELEASE part");
  } else {
    database_.execute("UPDATE log SET before = now, now = randomblob(16)");
    database_.require_unmoved();
    database_.execute("COMMIT");
    database_.require_unmoved();
  }
  open_ = false;
}

}  // namespace panonav
