#include "panonav_fleet/internal/postgresql_connection.hpp"

#include <libpq-fe.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <limits>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav::fleet {

namespace {

// Numbers of PostgreSQL's own types, which never change.
constexpr unsigned bytea_type = 17, int8_type = 20, text_type = 25, float8_type = 701,
                   int8_array_type = 1016, text_array_type = 1009;

struct ClearResult {
  void operator()(pg_result* result) const noexcept { PQclear(result); }
};
using Result = std::unique_ptr<pg_result, ClearResult>;

std::string get_sqlstate(const pg_result* result) {
  const char* state = result == nullptr ? nullptr : PQresultErrorField(result, PG_DIAG_SQLSTATE);
  return state == nullptr ? "" : state;
}

}  // namespace

void append_big_endian(std::string& bytes, std::uint64_t value, int size) {
  for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) {
    bytes += static_cast<char>((value >> static_cast<unsigned>(shift)) & 255U);
  }
}

std::uint64_t read_big_endian(std::string_view bytes) {
  std::uint64_t word = 0;
  for (const char c : bytes) word = (word << 8U) | static_cast<unsigned char>(c);
  return word;
}

PostgresqlValues::Value& PostgresqlValues::next(unsigned type) {
  return values_.emplace_back(Value{type, false, {}});
}

PostgresqlValues& PostgresqlValues::add(std::int64_t value) {
  append_big_endian(next(int8_type).bytes, static_cast<std::uint64_t>(value), 8);
  return *this;
}

PostgresqlValues& PostgresqlValues::add(const std::optional<double>& value) {
  Value& field = next(float8_type);
  field.null = !value;
  // Checksums do not know the sign of zero, as SQLite does not keep it.
  if (value) append_big_endian(field.bytes, std::bit_cast<std::uint64_t>(*value + 0.0), 8);
  return *this;
}

PostgresqlValues& PostgresqlValues::add(std::string_view text) {
  next(text_type).bytes = text;
  return *this;
}

PostgresqlValues& PostgresqlValues::add_null() {
  next(text_type).null = true;
  return *this;
}

PostgresqlValues& PostgresqlValues::add(std::span<const std::uint8_t> bytes) {
  next(bytea_type).bytes.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return *this;
}

PostgresqlValues& PostgresqlValues::add(std::span<const std::int64_t> values) {
  std::string& bytes = next(int8_array_type).bytes;
  // Dimensions, whether there are nulls, the type, then the size and first index of the dimension.
  append_big_endian(bytes, values.empty() ? 0 : 1, 4);
  append_big_endian(bytes, 0, 4);
  append_big_endian(bytes, int8_type, 4);
  if (!values.empty()) {
    append_big_endian(bytes, values.size(), 4);
    append_big_endian(bytes, 1, 4);
  }
  for (const std::int64_t value : values) {
    append_big_endian(bytes, 8, 4);
    append_big_endian(bytes, static_cast<std::uint64_t>(value), 8);
  }
  return *this;
}

PostgresqlValues& PostgresqlValues::add(std::span<const std::string> texts) {
  std::string& bytes = next(text_array_type).bytes;
  append_big_endian(bytes, texts.empty() ? 0 : 1, 4);
  append_big_endian(bytes, 0, 4);
  append_big_endian(bytes, text_type, 4);
  if (!texts.empty()) {
    append_big_endian(bytes, texts.size(), 4);
    append_big_endian(bytes, 1, 4);
  }
  for (const std::string& text : texts) {
    append_big_endian(bytes, text.size(), 4);
    bytes += text;
  }
  return *this;
}

CopyRows& CopyRows::begin_row(int fields) {
  append_big_endian(bytes_, static_cast<std::uint64_t>(fields), 2);
  return *this;
}

CopyRows& CopyRows::add(std::int64_t value) {
  append_big_endian(bytes_, 8, 4);
  append_big_endian(bytes_, static_cast<std::uint64_t>(value), 8);
  return *this;
}

CopyRows& CopyRows::add(const std::optional<double>& value) {
  if (!value) return add_null();
  return add(std::bit_cast<std::int64_t>(*value + 0.0));
}

CopyRows& CopyRows::add(std::string_view text) {
  append_big_endian(bytes_, text.size(), 4);
  bytes_ += text;
  return *this;
}

CopyRows& CopyRows::add(std::span<const std::uint8_t> bytes) {
  return add(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

CopyRows& CopyRows::add_null() {
  append_big_endian(bytes_, 0xFFFFFFFFU, 4);
  return *this;
}

std::string_view CopyRows::finish() {
  append_big_endian(bytes_, 0xFFFFU, 2);
  return bytes_;
}

PostgresqlValues::Bound PostgresqlValues::bound() const {
  Bound bound;
  for (const Value& value : values_) {
    if (value.bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) / 2) {
      throw ContractError("a text or picture for a server", "too long", "less than 1 GB");
    }
    bound.types.push_back(value.type);
    bound.data.push_back(value.null ? nullptr : value.bytes.data());
    bound.lengths.push_back(static_cast<int>(value.bytes.size()));
    bound.binary.push_back(1);
  }
  return bound;
}

void PostgresqlRows::Clear::operator()(pg_result* result) const noexcept {
  PQclear(result);
}

int PostgresqlRows::size() const {
  return PQntuples(result_.get());
}

bool PostgresqlRows::is_null(int row, int column) const {
  return PQgetisnull(result_.get(), row, column) != 0;
}

std::string_view PostgresqlRows::field(int row, int column, std::size_t size) const {
  const auto length = static_cast<std::size_t>(PQgetlength(result_.get(), row, column));
  if (is_null(row, column) || (size != 0 && length != size)) {
    throw FileError(printable_address_->native(), std::string("is damaged: column ") +
                                                      PQfname(result_.get(), column) +
                                                      " holds a value of a wrong type");
  }
  return {PQgetvalue(result_.get(), row, column), length};
}

std::int64_t PostgresqlRows::integer(int row, int column) const {
  return static_cast<std::int64_t>(read_big_endian(field(row, column, 8)));
}

std::optional<double> PostgresqlRows::real(int row, int column) const {
  if (is_null(row, column)) return std::nullopt;
  return std::bit_cast<double>(read_big_endian(field(row, column, 8)));
}

std::string_view PostgresqlRows::text(int row, int column) const {
  return field(row, column, 0);
}

std::span<const std::uint8_t> PostgresqlRows::bytes(int row, int column) const {
  const std::string_view bytes = field(row, column, 0);
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

std::vector<std::uint8_t> PostgresqlRows::copy(int row, int column) const {
  const auto from = bytes(row, column);
  return {from.begin(), from.end()};
}

void PostgresqlConnection::Close::operator()(pg_conn* connection) const noexcept {
  PQfinish(connection);
}

PostgresqlConnection::PostgresqlConnection(const ServerAddress& address)
    : printable_address_(address.printable) {
  char* fault = nullptr;
  PQconninfoOption* parsed = PQconninfoParse(address.uri.c_str(), &fault);
  PQfreemem(fault);  // it may quote a part of the password
  if (parsed == nullptr) {
    throw FileError(printable_address_.native(),
                    "is no address that libpq reads; allowed: "
                    "postgresql://USER@HOST:PORT/DATABASE?memory=NAME, special characters as %40");
  }
  PQconninfoFree(parsed);
  // Those before the address are replaced by what it says.
  const std::array<const char*, 9> keys{
      "connect_timeout",           "tcp_user_timeout", "keepalives_idle",
      "keepalives_interval",       "keepalives_count", "dbname",
      "fallback_application_name", "client_encoding",  nullptr};
  const std::array<const char*, 9> values{"10",      "20000", "10",   "5", "3", address.uri.c_str(),
                                          "panonav", "UTF8",  nullptr};
  connection_.reset(PQconnectdbParams(keys.data(), values.data(), 1));
  if (connection_ == nullptr)
    throw FileError(printable_address_.native(), "cannot be opened: out of memory");
  if (PQstatus(connection_.get()) != CONNECTION_OK) {
    throw FileError(printable_address_.native(), "cannot be opened: " + message());
  }
  PQsetNoticeProcessor(
      connection_.get(), [](void*, const char*) {}, nullptr);
  constexpr int oldest = 150000;
  if (PQserverVersion(connection_.get()) < oldest) {
    throw FileError(printable_address_.native(),
                    "cannot be used: the server is PostgreSQL " +
                        std::to_string(PQserverVersion(connection_.get()) / 10000) +
                        "; allowed: 15 and newer");
  }
  // The text of statements must mean the same whatever the server's settings are, and what was
  // acknowledged must be on its disk.
  execute(
      "SET search_path = pg_catalog; SET lock_timeout = '10s'; SET bytea_output = hex; "
      "SET extra_float_digits = 1; SET standard_conforming_strings = on; "
      "SELECT set_config('synchronous_commit', 'on', false) "
      "WHERE current_setting('synchronous_commit') = 'off'");
  // A robot that lost its network during a change holds the memory's lock until the server knows.
  // Not every system has all of these settings; one message, as a network may be slow.
  try_execute(
      "DO $$ DECLARE wanted text[]; BEGIN FOREACH wanted SLICE 1 IN ARRAY ARRAY["
      "['tcp_keepalives_idle', '10'], ['tcp_keepalives_interval', '5'], "
      "['tcp_keepalives_count', '3'], ['tcp_user_timeout', '20000']] LOOP "
      "BEGIN PERFORM set_config(wanted[1], wanted[2], false); "
      "EXCEPTION WHEN OTHERS THEN NULL; END; END LOOP; END $$");
}

std::string PostgresqlConnection::message() const {
  std::string text = PQerrorMessage(connection_.get());
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return without_passwords(to_readable_line(text));
}

bool PostgresqlConnection::is_in_transaction() const noexcept {
  const auto status = PQtransactionStatus(connection_.get());
  return status == PQTRANS_INTRANS || status == PQTRANS_INERROR;
}

void PostgresqlConnection::fail(const pg_result* result) const {
  if (PQstatus(connection_.get()) != CONNECTION_OK) {
    throw FileError(printable_address_.native(),
                    "lost the connection to its server; a change that was under "
                    "way is there whole or not at all: " +
                        message());
  }
  const std::string state = get_sqlstate(result);
  const char* primary =
      result == nullptr ? nullptr : PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY);
  const std::string text = primary == nullptr ? message() : to_readable_line(primary);
  if (state == "42501") {
    throw FileError(printable_address_.native(),
                    "cannot be read or changed so: " + text +
                        "; allowed: to read for members of panonav_reader, to "
                        "add of panonav_contributor, to change and remove of "
                        "panonav_curator");
  }
  if (state == "55P03" || state == "40001" || state == "40P01") {
    throw FileError(printable_address_.native(), "is being written by another program");
  }
  if (state == "53100") {
    throw FileError(printable_address_.native(), "cannot be written: the server's disk is full");
  }
  throw FileError(printable_address_.native(), "cannot be used: " + text);
}

PostgresqlRows PostgresqlConnection::checked(pg_result* raw) {
  Result result(raw);
  const auto status = PQresultStatus(raw);
  if (status != PGRES_TUPLES_OK && status != PGRES_COMMAND_OK && status != PGRES_SINGLE_TUPLE) {
    fail(raw);
  }
  return {printable_address_, result.release()};
}

pg_result* PostgresqlConnection::exchange(const std::string& sql, const PostgresqlValues* values) {
  if (values == nullptr) return PQexec(connection_.get(), sql.c_str());
  const auto bound = values->bound();
  return PQexecParams(connection_.get(), sql.c_str(), static_cast<int>(bound.types.size()),
                      bound.types.data(), bound.data.data(), bound.lengths.data(),
                      bound.binary.data(), 1);
}

void PostgresqlConnection::execute(const std::string& sql) {
  static_cast<void>(checked(exchange(sql, nullptr)));
}

bool PostgresqlConnection::try_unique(const std::string& sql, const PostgresqlValues* values) {
  Result result(exchange(sql, values));
  if (get_sqlstate(result.get()) == "23505") return false;
  static_cast<void>(checked(result.release()));
  return true;
}

PostgresqlRows PostgresqlConnection::run(const std::string& sql, const PostgresqlValues& values) {
  return checked(exchange(sql, &values));
}

void PostgresqlConnection::discard_results() noexcept {
  while (pg_result* rest = PQgetResult(connection_.get())) {
    const auto status = PQresultStatus(rest);
    PQclear(rest);
    if (status == PGRES_COPY_IN) PQputCopyEnd(connection_.get(), "given up");
    char* sent = nullptr;
    while (status == PGRES_COPY_OUT && PQgetCopyData(connection_.get(), &sent, 0) > 0) {
      PQfreemem(sent);
    }
    if (PQstatus(connection_.get()) != CONNECTION_OK) return;
  }
}

void PostgresqlConnection::stream(const std::string& sql, const PostgresqlValues& values,
                                  const std::function<void(const PostgresqlRows&)>& take) {
  const auto bound = values.bound();
  if (PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(bound.types.size()),
                        bound.types.data(), bound.data.data(), bound.lengths.data(),
                        bound.binary.data(), 1) == 0) {
    fail(nullptr);
  }
  PQsetSingleRowMode(connection_.get());
  try {
    while (pg_result* result = PQgetResult(connection_.get())) {
      const PostgresqlRows rows = checked(result);
      if (rows.size() > 0) take(rows);
    }
  } catch (...) {
    discard_results();
    throw;
  }
}

void PostgresqlConnection::copy_in(const std::string& sql, std::string_view bytes) {
  {
    Result begun(PQexec(connection_.get(), sql.c_str()));
    if (PQresultStatus(begun.get()) != PGRES_COPY_IN) fail(begun.get());
  }
  constexpr std::size_t piece = 1 << 20;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const auto size = static_cast<int>(std::min(piece, bytes.size() - at));
    if (PQputCopyData(connection_.get(), bytes.data() + at, size) != 1) {
      discard_results();
      fail(nullptr);
    }
  }
  if (PQputCopyEnd(connection_.get(), nullptr) != 1) fail(nullptr);
  Result done(PQgetResult(connection_.get()));
  discard_results();
  if (PQresultStatus(done.get()) != PGRES_COMMAND_OK) fail(done.get());
}

void PostgresqlConnection::copy_out(
    const std::string& sql, int fields,
    const std::function<void(std::span<const std::optional<std::string_view>>)>& take) {
  {
    Result begun(PQexec(connection_.get(), sql.c_str()));
    if (PQresultStatus(begun.get()) != PGRES_COPY_OUT) fail(begun.get());
  }
  struct Free {
    void operator()(char* bytes) const noexcept { PQfreemem(bytes); }
  };
  const auto refuse = [this] {
    throw FileError(printable_address_.native(), "sends rows that are cut off");
  };
  std::vector<std::optional<std::string_view>> row(static_cast<std::size_t>(fields));
  bool begins = true;
  int size = 0;
  try {
    char* sent = nullptr;
    while ((size = PQgetCopyData(connection_.get(), &sent, 0)) > 0) {
      const std::unique_ptr<char, Free> kept(sent);
      std::string_view rest(sent, static_cast<std::size_t>(size));
      const auto read_bytes_of_row = [&](std::size_t count) {
        if (rest.size() < count) refuse();
        const std::string_view head = rest.substr(0, count);
        rest.remove_prefix(count);
        return head;
      };
      if (std::exchange(begins, false)) {
        read_bytes_of_row(15);  // "PGCOPY", flags
        read_bytes_of_row(read_big_endian(read_bytes_of_row(4)));
      }
      while (!rest.empty()) {
        const std::uint64_t count = read_big_endian(read_bytes_of_row(2));
        if (count == 0xFFFFU) break;  // the end
        if (count != row.size()) refuse();
        for (auto& field : row) {
          const std::uint64_t length = read_big_endian(read_bytes_of_row(4));
          field = length == 0xFFFFFFFFU ? std::nullopt : std::optional(read_bytes_of_row(length));
        }
        take(row);
      }
    }
  } catch (...) {
    try_cancel();
    discard_results();
    throw;
  }
  Result done(PQgetResult(connection_.get()));
  discard_results();
  if (size != -1 || PQresultStatus(done.get()) != PGRES_COMMAND_OK) fail(done.get());
}

std::optional<std::string> PostgresqlConnection::wait_for_notification(double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (true) {
    if (PQconsumeInput(connection_.get()) == 0) fail(nullptr);
    if (PGnotify* notified = PQnotifies(connection_.get())) {
      std::string payload = notified->extra;
      PQfreemem(notified);
      return payload;
    }
    const auto left = std::chrono::duration<double, std::milli>(end - Clock::now()).count();
    if (left <= 0.0) return std::nullopt;
    pollfd waiting{PQsocket(connection_.get()), POLLIN, 0};
    static_cast<void>(::poll(&waiting, 1, static_cast<int>(std::min(left + 1.0, 1e6))));
  }
}

void PostgresqlConnection::try_cancel() noexcept {
  std::array<char, 256> why{};
  PGcancel* const cancel = PQgetCancel(connection_.get());
  if (cancel == nullptr) return;
  PQcancel(cancel, why.data(), static_cast<int>(why.size()));
  PQfreeCancel(cancel);
}

void PostgresqlConnection::try_execute(const char* sql) noexcept {
  PQclear(PQexec(connection_.get(), sql));
}

}  // namespace panonav::fleet
