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

/// Values of the parameters $1, $2, ... of a statement, in order, in PostgreSQL's binary form. They
/// are sent apart from the text of the statement, so they cannot change what it does.
class PostgresqlValues {
 public:
  PostgresqlValues& add(std::int64_t value);
  PostgresqlValues& add(const std::optional<double>& value);
  PostgresqlValues& add(std::string_view text);
  PostgresqlValues& add(std::span<const std::uint8_t> bytes);
  PostgresqlValues& add(std::span<const std::int64_t> values);
  PostgresqlValues& add(std::span<const std::string> texts);
  /// Adds a null of type text.
  PostgresqlValues& add_null();

  /// The values in the form of libpq; valid as long as the PostgresqlValues.
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
  Value& add_value(unsigned type);
  /// Begins an array value and returns its bytes, to which its elements are then appended.
  std::string& begin_array(unsigned type, unsigned element_type, std::size_t count);
  std::vector<Value> values_;
};

/// The rows that a statement returned. Accessors throw FileError on a value of another size, and on
/// a null unless they return an optional.
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

/// A connection to a PostgreSQL server. Functions throw FileError of one line, without a password,
/// if the server refuses a statement, the connection is lost, or the server is silent for
/// `reply_timeout`.
class PostgresqlConnection {
 public:
  /// Connects to the server. Throws FileError if there is no such server or database, the password
  /// is wrong, or its version is older than 15.
  explicit PostgresqlConnection(const ServerAddress& address);

  /// Executes constant statements without values, separated by semicolons.
  void execute(const std::string& sql);
  /// Executes a statement, with values if there are any. Returns false if a unique constraint is
  /// violated.
  [[nodiscard]] bool execute_unless_duplicate(const std::string& sql,
                                              const PostgresqlValues* values = nullptr);
  PostgresqlRows run(const std::string& sql, const PostgresqlValues& values = {});
  /// Executes a statement and passes its rows to `take` one at a time, without holding all of them.
  void stream(const std::string& sql, const PostgresqlValues& values,
              const std::function<void(const PostgresqlRows&)>& take);
  /// Executes a COPY ... FROM STDIN with these bytes.
  void copy_in(const std::string& sql, std::string_view bytes);
  /// Executes a COPY ... TO STDOUT in binary form and passes the fields of each row to `take`;
  /// `nullopt` for null.
  void copy_out(const std::string& sql, int fields,
                const std::function<void(std::span<const std::optional<std::string_view>>)>& take);
  /// Waits, outside of a transaction, for a notification of the server and returns its payload;
  /// `nullopt` if none arrives within the time.
  [[nodiscard]] std::optional<std::string> wait_for_notification(double seconds);
  /// Executes a statement, such as ROLLBACK, and ignores errors.
  void try_execute(const char* sql) noexcept;

  [[nodiscard]] bool is_in_transaction() const noexcept;
  [[nodiscard]] const std::filesystem::path& printable() const noexcept {
    return printable_address_;
  }

 private:
  struct Close {
    void operator()(pg_conn* connection) const noexcept;
  };
  /// Waits until the server sends something or, if `is_sending`, accepts more bytes. Returns false
  /// if the connection is lost; the next call of libpq then reports why. After `reply_timeout` it
  /// closes the connection and throws FileError.
  [[nodiscard]] bool wait_for_server(bool is_sending) const;
  /// Sends the bytes that libpq still buffers. Returns false if the connection is lost.
  bool flush() const;
  void send(const std::string& sql, const PostgresqlValues* values) const;
  /// Returns the next result of the sent statement; null after the last.
  [[nodiscard]] pg_result* next_result() const;
  /// Waits for the next bytes of a COPY and returns as PQgetCopyData: the size of `sent`, -1 at the
  /// end, -2 on an error.
  [[nodiscard]] int next_copy_data(char*& sent) const;
  [[nodiscard]] pg_result* exchange(const std::string& sql, const PostgresqlValues* values);
  PostgresqlRows check_result(pg_result* result);
  [[noreturn]] void fail(const pg_result* result) const;
  [[nodiscard]] std::string message() const;
  void discard_results() noexcept;
  /// Asks the server to cancel the running statement.
  void try_cancel() noexcept;
  std::filesystem::path printable_address_;
  std::unique_ptr<pg_conn, Close> connection_;
};

/// Appends a number in the byte order of PostgreSQL: most significant byte first.
void append_big_endian(std::string& bytes, std::uint64_t value, int size);
/// Reads an unsigned big-endian number that has up to eight bytes.
[[nodiscard]] std::uint64_t read_big_endian(std::string_view bytes);

/// Rows in COPY's binary form, for `copy_in`.
class CopyRows {
 public:
  /// Begins a row; exactly `fields` fields must then be added.
  CopyRows& begin_row(int fields);
  CopyRows& add(std::int64_t value);
  CopyRows& add(const std::optional<double>& value);
  CopyRows& add(std::string_view text);
  CopyRows& add(std::span<const std::uint8_t> bytes);
  CopyRows& add_null();
  /// Ends the data and returns it; no rows may be added afterwards.
  [[nodiscard]] std::string_view finish();

 private:
  std::string bytes_{"PGCOPY\n\377\r\n\0\0\0\0\0\0\0\0\0", 19};  // no flags, no extension
};

}  // namespace panonav::fleet
