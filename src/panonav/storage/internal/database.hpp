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
  read,       ///< read-only; others may write the file
  immutable,  ///< a file that nobody can change
};

/// Returns the name of a file that SQLite keeps beside `path`, such as its log with "-wal".
[[nodiscard]] std::filesystem::path with_suffix(std::filesystem::path path, const char* suffix);

/// A connection to an SQLite file. Functions throw FileError of one line that names the file if
/// SQLite refuses anything.
class Database {
 public:
  Database(std::filesystem::path path, DatabaseMode mode);

  void execute(const char* sql);
  [[nodiscard]] std::int64_t integer(const char* sql);
  [[nodiscard]] bool is_in_transaction() const noexcept;
  /// Makes every later transaction throw if the file was deleted, moved or replaced.
  void watch_for_moves() noexcept { watches_for_moves_ = true; }
  void require_unmoved() const;
  /// Returns the size of the file and of its write-ahead log.
  [[nodiscard]] std::int64_t file_bytes() const;
  /// Makes closing leave the write-ahead log as it is, instead of copying it into the file.
  void leave_log_on_close() noexcept;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] sqlite3* handle() const noexcept { return handle_.get(); }

  /// Throws a FileError for an error code of SQLite, with SQLite's message of the last call.
  [[noreturn]] void fail(int code) const;
  [[noreturn]] void fail_damaged(std::string_view what) const;

  /// Limits the steps of each statement in proportion to the present size of the file, because
  /// damaged tables whose pages refer to each other could be read without end.
  void set_step_limit();
  /// Resets the count of steps for the next statement.
  void reset_step_count() const noexcept;

 private:
  struct Close {
    void operator()(sqlite3* handle) const noexcept;
  };
  std::filesystem::path path_;
  std::unique_ptr<std::int64_t> steps_left_;  // on the heap: SQLite keeps its address
  std::int64_t step_limit_ = 0;
  std::unique_ptr<sqlite3, Close> handle_;
  bool watches_for_moves_ = false;
};

/// A prepared statement. Bound texts and blobs must live until the statement is reset.
class Statement {
 public:
  /// Prepares a statement and binds the values to its parameters ?1, ?2, ...
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

  /// Returns true if there is a row; otherwise the statement is done and was reset.
  bool step();
  /// Runs a statement without rows. Returns 0, or SQLite's extended code if a constraint is
  /// violated, in which case nothing has changed.
  int run();
  void reset() noexcept;

  [[nodiscard]] bool is_null(int column) const;
  [[nodiscard]] int type(int column) const;
  // These throw FileError ("damaged") if the column has another type.
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

/// Runs a statement without rows. Returns as `Statement::run` does.
template <class... Values>
int run_statement(Database& database, const char* sql, const Values&... values) {
  return Statement(database, sql, values...).run();
}

class DatabaseTransaction final : public MemoryTables::Transaction {
 public:
  DatabaseTransaction(Database& database, MemoryTables::Kind kind);
  ~DatabaseTransaction() override;
  /// Writes a new mark to the table `log` and commits; returns once everything is on the disk.
  /// Throws FileError if the file was moved or deleted.
  void commit() override;

 private:
  Database& database_;
  bool within_another_;
  bool open_ = true;
};

}  // namespace panonav
