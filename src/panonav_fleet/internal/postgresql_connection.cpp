#include "panonav_fleet/internal/postgresql_connection.hpp"

#include <libpq-fe.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <chrono>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_scheme.hpp"

namespace panonav::fleet {

namespace {

struct ClearResult {
  void operator()(pg_result* result) const noexcept { PQclear(result); }
};
using Result = std::unique_ptr<pg_result, ClearResult>;

std::string get_sqlstate(const pg_result* result) {
  const char* state = result == nullptr ? nullptr : PQresultErrorField(result, PG_DIAG_SQLSTATE);
  return state == nullptr ? "" : state;
}

}  // namespace

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
                    "is not an address that libpq reads; allowed: "
                    "postgresql://USER@HOST:PORT/DATABASE?memory=NAME, special characters as %40");
  }
  PQconninfoFree(parsed);
  // Parameters in the address override these defaults.
  const std::array<const char*, 9> keys{
      "connect_timeout",           "tcp_user_timeout", "keepalives_idle",
      "keepalives_interval",       "keepalives_count", "dbname",
      "fallback_application_name", "client_encoding",  nullptr};
  const std::string seconds = std::to_string(
      std::min<std::int64_t>(10, std::chrono::ceil<std::chrono::seconds>(reply_timeout()).count()));
  const std::array<const char*, 9> values{seconds.c_str(),     "20000",   "10",   "5",    "3",
                                          address.uri.c_str(), "panonav", "UTF8", nullptr};
  connection_.reset(PQconnectdbParams(keys.data(), values.data(), 1));
  if (connection_ == nullptr)
    throw FileError(printable_address_.native(), "cannot be opened: out of memory");
  if (PQstatus(connection_.get()) != CONNECTION_OK) {
    throw FileError(printable_address_.native(), "cannot be opened: " + message());
  }
  PQsetnonblocking(connection_.get(), 1);
  PQsetNoticeProcessor(
      connection_.get(), [](void*, const char*) {}, nullptr);
  constexpr int oldest = 150000;
  if (PQserverVersion(connection_.get()) < oldest) {
    throw FileError(printable_address_.native(),
                    "cannot be used: the server is PostgreSQL " +
                        std::to_string(PQserverVersion(connection_.get()) / 10000) +
                        "; allowed: 15 and newer");
  }
  // These settings make statements mean the same on every server, and ensure that acknowledged
  // changes are on its disk.
  execute("SET search_path = pg_catalog; SET lock_timeout = '" + seconds +
          "s'; SET bytea_output = hex; "
          "SET extra_float_digits = 1; SET standard_conforming_strings = on; "
          "SELECT set_config('synchronous_commit', 'on', false) "
          "WHERE current_setting('synchronous_commit') = 'off'");
  // If a robot loses its network during a change, its session holds the lock of the memory until
  // the server notices; these settings make it notice soon. Servers may lack some of them. One
  // message sets all, because a network may be slow.
  try_execute(
      "DO $$ DECLARE wanted text[]; BEGIN FOREACH wanted SLICE 1 IN ARRAY ARRAY["
      "['tcp_keepalives_idle', '10'], ['tcp_keepalives_interval', '5'], "
      "['tcp_keepalives_count', '3'], ['tcp_user_timeout', '20000'], "
      "['client_connection_check_interval', '5s']] LOOP "
      "BEGIN PERFORM set_config(wanted[1], wanted[2], false); "
      "EXCEPTION WHEN OTHERS THEN NULL; END; END LOOP; END $$");
}

std::string PostgresqlConnection::message() const {
  std::string text = PQerrorMessage(connection_.get());
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return mask_passwords(to_readable_line(text));
}

bool PostgresqlConnection::is_in_transaction() const noexcept {
  const auto status = PQtransactionStatus(connection_.get());
  return status == PQTRANS_INTRANS || status == PQTRANS_INERROR;
}

void PostgresqlConnection::fail(const pg_result* result) const {
  if (PQstatus(connection_.get()) != CONNECTION_OK) {
    throw FileError(printable_address_.native(),
                    "lost the connection to its server; a change that was under way was made "
                    "completely or not at all: " +
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

PostgresqlRows PostgresqlConnection::check_result(pg_result* raw) {
  Result result(raw);
  const auto status = PQresultStatus(raw);
  if (status != PGRES_TUPLES_OK && status != PGRES_COMMAND_OK && status != PGRES_SINGLE_TUPLE) {
    fail(raw);
  }
  return {printable_address_, result.release()};
}

bool PostgresqlConnection::wait_for_server(bool is_sending) const {
  using Clock = std::chrono::steady_clock;
  pollfd waiting{PQsocket(connection_.get()), POLLIN, 0};
  if (is_sending) waiting.events |= POLLOUT;
  // Waits in steps, as the time-out may be shortened meanwhile.
  constexpr int step_ms = 250;
  const auto begin = Clock::now();
  int ready = 0;
  while ((ready = ::poll(&waiting, 1, step_ms)) == 0) {
    if (Clock::now() - begin < reply_timeout()) continue;
    // Makes every later request on this connection fail at once.
    ::shutdown(PQsocket(connection_.get()), SHUT_RDWR);
    throw FileError(printable_address_.native(),
                    "its server did not answer within " +
                        to_text(std::chrono::duration<double>(reply_timeout()).count()) +
                        " s; a change that was under way was made completely or not at all");
  }
  if (ready < 0) return errno == EINTR;
  return (waiting.revents & ~POLLOUT) == 0 || PQconsumeInput(connection_.get()) == 1;
}

bool PostgresqlConnection::flush() const {
  int unsent = 0;
  while ((unsent = PQflush(connection_.get())) > 0 && wait_for_server(true)) {
  }
  return unsent == 0;
}

pg_result* PostgresqlConnection::next_result() const {
  while (flush() && PQisBusy(connection_.get()) != 0 && wait_for_server(false)) {
  }
  return PQgetResult(connection_.get());
}

void PostgresqlConnection::send(const std::string& sql, const PostgresqlValues* values) const {
  int sent = 0;
  if (values == nullptr) {
    sent = PQsendQuery(connection_.get(), sql.c_str());
  } else {
    const auto bound = values->to_bound();
    sent = PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(bound.types.size()),
                             bound.types.data(), bound.data.data(), bound.lengths.data(),
                             bound.binary.data(), 1);
  }
  if (sent == 0) fail(nullptr);
}

pg_result* PostgresqlConnection::exchange(const std::string& sql, const PostgresqlValues* values) {
  send(sql, values);
  Result last;
  while (pg_result* const result = next_result()) {
    last.reset(result);
    const auto status = PQresultStatus(result);
    if (status == PGRES_COPY_IN || status == PGRES_COPY_OUT) break;
    if (PQstatus(connection_.get()) != CONNECTION_OK) break;
  }
  return last.release();
}

void PostgresqlConnection::execute(const std::string& sql) {
  static_cast<void>(check_result(exchange(sql, nullptr)));
}

bool PostgresqlConnection::execute_unless_duplicate(const std::string& sql,
                                                    const PostgresqlValues* values) {
  Result result(exchange(sql, values));
  if (get_sqlstate(result.get()) == "23505") return false;
  static_cast<void>(check_result(result.release()));
  return true;
}

PostgresqlRows PostgresqlConnection::run(const std::string& sql, const PostgresqlValues& values) {
  return check_result(exchange(sql, &values));
}

void PostgresqlConnection::discard_results() noexcept {
  try {
    while (pg_result* rest = next_result()) {
      const auto status = PQresultStatus(rest);
      PQclear(rest);
      if (status == PGRES_COPY_IN) PQputCopyEnd(connection_.get(), "given up");
      char* sent = nullptr;
      while (status == PGRES_COPY_OUT && next_copy_data(sent) > 0) PQfreemem(sent);
      if (PQstatus(connection_.get()) != CONNECTION_OK) return;
    }
  } catch (const FileError&) {  // NOLINT(bugprone-empty-catch): nothing more comes
  }
}

int PostgresqlConnection::next_copy_data(char*& sent) const {
  int size = 0;
  while ((size = PQgetCopyData(connection_.get(), &sent, 1)) == 0) {
    if (!wait_for_server(false)) return PQgetCopyData(connection_.get(), &sent, 0);
  }
  return size;
}

void PostgresqlConnection::stream(const std::string& sql, const PostgresqlValues& values,
                                  const std::function<void(const PostgresqlRows&)>& take) {
  send(sql, &values);
  PQsetSingleRowMode(connection_.get());
  try {
    while (pg_result* result = next_result()) {
      const PostgresqlRows rows = check_result(result);
      if (rows.size() > 0) take(rows);
    }
  } catch (...) {
    discard_results();
    throw;
  }
}

void PostgresqlConnection::copy_in(const std::string& sql, std::string_view bytes) {
  {
    Result begun(exchange(sql, nullptr));
    if (PQresultStatus(begun.get()) != PGRES_COPY_IN) fail(begun.get());
  }
  constexpr std::size_t piece = 1 << 20;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const auto size = static_cast<int>(std::min(piece, bytes.size() - at));
    int put = 0;
    while ((put = PQputCopyData(connection_.get(), bytes.data() + at, size)) == 0) {
      if (!wait_for_server(true)) break;
    }
    if (put != 1) {
      discard_results();
      fail(nullptr);
    }
    // Sends now, because libpq would buffer all that the network does not accept.
    flush();
  }
  int ended = 0;
  while ((ended = PQputCopyEnd(connection_.get(), nullptr)) == 0) {
    if (!wait_for_server(true)) break;
  }
  if (ended != 1) fail(nullptr);
  Result done(next_result());
  discard_results();
  if (PQresultStatus(done.get()) != PGRES_COMMAND_OK) fail(done.get());
}

void PostgresqlConnection::copy_out(
    const std::string& sql, int fields,
    const std::function<void(std::span<const std::optional<std::string_view>>)>& take) {
  {
    Result begun(exchange(sql, nullptr));
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
    while ((size = next_copy_data(sent)) > 0) {
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
  Result done(next_result());
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
  try {
    PQclear(exchange(sql, nullptr));
  } catch (const FileError&) {  // NOLINT(bugprone-empty-catch): errors are ignored
  }
}

}  // namespace panonav::fleet
