#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

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
  [[nodiscard]] bool in_transaction() const noexcept;
  /// From now on every transaction asks whether the file still has its name, and throws when it was
  /// deleted, moved or replaced.
  void watch_name() noexcept { watches_name_ = true; }
  void require_name() const;
  /// Closing will leave the write-ahead log as it is instead of bringing it into the file.
  void leave_log_on_close() noexcept;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] sqlite3* handle() const noexcept { return handle_.get(); }

  /// Throws the FileError for what SQLite answered last.
  [[noreturn]] void fail(int code) const;
  [[noreturn]] void fail_damaged(std::string_view what) const;

  /// From now on a statement may take a number of steps in proportion to the size that the file has
  /// now, since tables whose pages refer to each other would be read without end.
  void allow_steps() noexcept;
  /// A statement begins.
  void refill_steps() const noexcept;

 private:
  struct Close {
    void operator()(sqlite3* handle) const noexcept;
  };
  std::filesystem::path path_;
  std::unique_ptr<std::int64_t> steps_left_;  // has an address that stays when this is moved
  std::int64_t steps_allowed_ = 0;
  std::unique_ptr<sqlite3, Close> handle_;
  bool watches_name_ = false;
};

/// A prepared statement. Bound texts and blobs must live until the statement is reset.
class Statement {
 public:
  Statement(Database& database, const char* sql);

  Statement& bind_null(int parameter);
  Statement& bind(int parameter, std::int64_t value);
  Statement& bind(int parameter, double value);
  Statement& bind(int parameter, std::string_view text);
  Statement& bind(int parameter, std::span<const std::uint8_t> blob);

  /// True: a row is there. False: done, and the statement is reset.
  bool step();
  /// For statements without rows. Returns SQLite's extended code when a constraint forbids it
  /// (nothing has then changed), 0 when it is done.
  int run();
  void reset() noexcept;

  [[nodiscard]] bool is_null(int column) const;
  [[nodiscard]] int type(int column) const;
  /// These throw FileError ("damaged") when the column holds another type.
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string_view text(int column) const;               ///< until the next step
  [[nodiscard]] std::span<const std::uint8_t> blob(int column) const;  ///< until the next step

 private:
  struct Finalise {
    void operator()(sqlite3_stmt* statement) const noexcept;
  };
  void check_bind(int code) const;
  void require_type(int column, int wanted) const;
  Database* database_;
  std::unique_ptr<sqlite3_stmt, Finalise> statement_;
};

/// Rolls back unless committed. Within a writing transaction it is a part of that one, which is
/// taken back alone or committed with the whole.
class Transaction {
 public:
  enum class Kind { reading, writing };
  Transaction(Database& database, Kind kind);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  /// Returns once everything is on the disk, with a new mark in the table `log`. Throws FileError
  /// when the file is no longer where it was opened.
  void commit();

 private:
  Database& database_;
  bool within_another_;
  bool open_ = true;
};

}  // namespace panonav
