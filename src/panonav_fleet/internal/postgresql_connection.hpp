#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav_fleet/internal/server_address.hpp"

struct pg_conn;
struct pg_result;

namespace panonav::fleet {

/// Values for the places $1, $2, ... of a statement, in order, in PostgreSQL's binary form. They
/// never become part of the statement's text.
class PostgresqlValues {
 public:
  PostgresqlValues& add(std::int64_t value);
  PostgresqlValues& add(const std::optional<double>& value);
  PostgresqlValues& add(std::string_view text);
  PostgresqlValues& add(std::span<const std::uint8_t> bytes);
  PostgresqlValues& add(std::span<const std::int64_t> values);
  PostgresqlValues& add(std::span<const std::string> texts);
  /// Adds a missing text.
  PostgresqlValues& add_null();

  /// The values in the form of libpq; valid while these values are.
  struct Bound {
    std::vector<unsigned> types;
    std::vector<const char*> data;
    std::vector<int> lengths, binary;
  };
  [[nodiscard]] Bound to_bound() const;

 private:
  struct Value {
    unsigned type = 0;
    bool null = false;
    std::string bytes;
  };
  Value& next(unsigned type);
  /// Adds the head of an array value; its elements follow in the returned bytes.
  std::string& begin_array(unsigned type, unsigned element_type, std::size_t count);
  std::vector<Value> values_;
};

/// The rows that a statement answered. Fields are read as what they are; a null throws FileError
/// where the function returns no optional.
class PostgresqlRows {
 public:
  [[nodiscard]] int size() const;
  [[nodiscard]] bool is_null(int row, int column) const;
  [[nodiscard]] std::int64_t integer(int row, int column) const;
  [[nodiscard]] std::optional<double> real(int row, int column) const;
  [[nodiscard]] std::string_view text(int row, int column) const;
  [[nodiscard]] std::span<const std::uint8_t> bytes(int row, int column) const;
  [[nodiscard]] std::vector<std::uint8_t> copy(int row, int column) const;

 private:
  friend class PostgresqlConnection;
  struct Clear {
    void operator()(pg_result* result) const noexcept;
  };
  PostgresqlRows(const std::filesystem::path& printable, pg_result* result)
      : printable_address_(&printable), result_(result) {}
  [[nodiscard]] std::string_view field(int row, int column, std::size_t size) const;
  const std::filesystem::path* printable_address_;
  std::unique_ptr<pg_result, Clear> result_;
};

/// A connection to a PostgreSQL server. Whatever the server refuses, a lost connection, and a
/// server that is silent for `reply_timeout` are thrown as a FileError of one line, without a
/// password.
class PostgresqlConnection {
 public:
  /// Throws FileError: no such server, wrong password, no such database, older than version 15.
  explicit PostgresqlConnection(const ServerAddress& address);

  /// Statements of ours without values, separated by semicolons.
  void execute(const std::string& sql);
  /// Executes a statement, with values if there are any. Returns false if a unique constraint
  /// forbids it.
  [[nodiscard]] bool execute_unless_duplicate(const std::string& sql,
                                              const PostgresqlValues* values = nullptr);
  PostgresqlRows run(const std::string& sql, const PostgresqlValues& values = {});
  /// Passes the rows to `take` one after the other, without holding all of them.
  void stream(const std::string& sql, const PostgresqlValues& values,
              const std::function<void(const PostgresqlRows&)>& take);
  /// A COPY ... FROM STDIN with these bytes.
  void copy_in(const std::string& sql, std::string_view bytes);
  /// A COPY ... TO STDOUT in the binary form: the fields of one row after the other, empty for
  /// null.
  void copy_out(const std::string& sql, int fields,
                const std::function<void(std::span<const std::optional<std::string_view>>)>& take);
  /// Waits outside of a transaction until the server sends a notification and returns its payload;
  /// empty if none arrived within the time.
  [[nodiscard]] std::optional<std::string> wait_for_notification(double seconds);
  /// Rolls back the transaction if the connection still works.
  void try_execute(const char* sql) noexcept;

  [[nodiscard]] bool is_in_transaction() const noexcept;
  [[nodiscard]] const std::filesystem::path& printable() const noexcept {
    return printable_address_;
  }

 private:
  struct Close {
    void operator()(pg_conn* connection) const noexcept;
  };
  /// Waits until the server sends something, or if `is_sending`, takes something. False if the
  /// connection is lost: the next call of libpq says why. After the time-out shuts the connection
  /// and throws FileError.
  [[nodiscard]] bool wait_for_server(bool is_sending) const;
  /// Sends the bytes that libpq still buffers. False if the connection is lost.
  bool flush() const;
  void send(const std::string& sql, const PostgresqlValues* values) const;
  /// Returns the next result of the sent statement; null after the last.
  [[nodiscard]] pg_result* next_result() const;
  /// Same as PQgetCopyData, but waits: the size of `sent`, -1 at the end, -2 on a fault.
  [[nodiscard]] int next_copy_data(char*& sent) const;
  [[nodiscard]] pg_result* exchange(const std::string& sql, const PostgresqlValues* values);
  PostgresqlRows checked(pg_result* result);
  [[noreturn]] void fail(const pg_result* result) const;
  [[nodiscard]] std::string message() const;
  void discard_results() noexcept;
  /// Asks the server to end the statement that runs.
  void try_cancel() noexcept;
  std::filesystem::path printable_address_;
  std::unique_ptr<pg_conn, Close> connection_;
};

/// Numbers as PostgreSQL sends them: the most significant byte first.
void append_big_endian(std::string& bytes, std::uint64_t value, int size);
/// Reads a number of up to eight bytes.
[[nodiscard]] std::uint64_t read_big_endian(std::string_view bytes);

/// Rows in COPY's binary form, for `copy_in`.
class CopyRows {
 public:
  /// The next row, which has as many fields as are added before the next one begins.
  CopyRows& begin_row(int fields);
  CopyRows& add(std::int64_t value);
  CopyRows& add(const std::optional<double>& value);
  CopyRows& add(std::string_view text);
  CopyRows& add(std::span<const std::uint8_t> bytes);
  CopyRows& add_null();
  /// All rows; none may be added after it.
  [[nodiscard]] std::string_view finish();

 private:
  std::string bytes_{"PGCOPY\n\377\r\n\0\0\0\0\0\0\0\0\0", 19};  // flags, nothing more
};

}  // namespace panonav::fleet
