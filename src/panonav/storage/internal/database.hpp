#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "panonav/core/ids.hpp"
#include "panonav/storage/internal/memory_tables.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace panonav {

enum class DatabaseMode {
  create,     ///< makes the file
  change,     ///< an existing file, for reading and writing
  read,       ///< an existing file without permission to write it, which others may write meanwhile
  immutable,  ///< a file that nobody can change
};

/// A connection to an SQLite file. Everything that SQLite refuses is thrown as a FileError of one
/// line that names the file.
class Database {
 public:
  Database(std::filesystem::path path, DatabaseMode mode);

  void execute(const char* sql);
  [[nodiscard]] std::int64_t integer(const char* sql);
  [[nodiscard]] bool is_in_transaction() const noexcept;
  /// From now on every transaction throws when the file was deleted, moved or replaced.
  void watch_for_moves() noexcept { watches_for_moves_ = true; }
  void require_unmoved() const;
  /// Returns the size of the file and of its write-ahead log.
  [[nodiscard]] std::int64_t file_bytes() const;
  /// Closing will leave the write-ahead log as it is instead of bringing it into the file.
  void leave_log_on_close() noexcept;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] sqlite3* handle() const noexcept { return handle_.get(); }

  /// Throws the FileError for an error code of SQLite, with the message of its last call.
  [[noreturn]] void fail(int code) const;
  [[noreturn]] void fail_damaged(std::string_view what) const;

  /// Limits the steps of each statement in proportion to the present size of the file, since tables
  /// whose pages refer to each other would be read without end.
  void set_step_limit();
  /// Grants the steps of the limit to the statement that begins.
  void reset_step_count() const noexcept;

 private:
  struct Close {
    void operator()(sqlite3* handle) const noexcept;
  };
  std::filesystem::path path_;
  std::unique_ptr<std::int64_t> steps_left_;  // has an address that stays when this is moved
  std::int64_t step_limit_ = 0;
  std::unique_ptr<sqlite3, Close> handle_;
  bool watches_for_moves_ = false;
};

/// A prepared statement. Bound texts and blobs must live until the statement is reset.
class Statement {
 public:
  /// Binds the values to the parameters ?1, ?2, ...
  template <class... Values>
  explicit Statement(Database& database, const char* sql, const Values&... values)
      : Statement(database, sql, nullptr) {
    bind_all(values...);
  }

  template <class... Values>
  Statement& bind_all(const Values&... values) {
    int parameter = 0;
    (bind(++parameter, values), ...);
    return *this;
  }
  Statement& bind_null(int parameter);
  template <class Value>
  Statement& bind(int parameter, const std::optional<Value>& value) {
    return value ? bind(parameter, *value) : bind_null(parameter);
  }
  Statement& bind(int parameter, ViewId view) { return bind(parameter, std::int64_t{view.value}); }
  Statement& bind(int parameter, std::int64_t value);
  Statement& bind(int parameter, double value);
  Statement& bind(int parameter, std::string_view text);
  Statement& bind(int parameter, std::span<const std::uint8_t> blob);

  /// True if there is a row; otherwise the statement is done and reset.
  bool step();
  /// Runs a statement without rows. Returns SQLite's extended code when a constraint forbids it
  /// (nothing has then changed), 0 when it is done.
  int run();
  void reset() noexcept;

  [[nodiscard]] bool is_null(int column) const;
  [[nodiscard]] int type(int column) const;
  // These throw FileError ("damaged") when the column holds another type.
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string_view text(int column) const;               ///< until the next step
  [[nodiscard]] std::span<const std::uint8_t> blob(int column) const;  ///< until the next step

 private:
  struct Finalise {
    void operator()(sqlite3_stmt* statement) const noexcept;
  };
  Statement(Database& database, const char* sql, std::nullptr_t);
  void check_bind(int code) const;
  void require_type(int column, int expected) const;
  Database* database_;
  std::unique_ptr<sqlite3_stmt, Finalise> statement_;
};

/// Runs a statement without rows. Returns as `Statement::run`.
template <class... Values>
int run_statement(Database& database, const char* sql, const Values&... values) {
  return Statement(database, sql, values...).run();
}

class DatabaseTransaction final : public MemoryTables::Transaction {
 public:
  DatabaseTransaction(Database& database, MemoryTables::Kind kind);
  ~DatabaseTransaction() override;
  /// Returns once everything is on the disk, with a new mark in the table `log`. Throws FileError
  /// when the file is no longer where it was opened.
  void commit() override;

 private:
  Database& database_;
  bool within_another_;
  bool open_ = true;
};

}  // namespace panonav
