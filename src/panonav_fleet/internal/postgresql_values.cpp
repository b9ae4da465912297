// Values of statements and rows of COPY in PostgreSQL's binary form.

#include <bit>
#include <limits>

#include "panonav/core/error.hpp"
#include "panonav_fleet/internal/postgresql_connection.hpp"

namespace panonav::fleet {

namespace {

// Numbers of PostgreSQL's built-in types, which never change.
constexpr unsigned bytea_type = 17, int8_type = 20, text_type = 25, float8_type = 701,
                   int8_array_type = 1016, text_array_type = 1009;

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

PostgresqlValues::Value& PostgresqlValues::add_value(unsigned type) {
  return values_.emplace_back(Value{type, false, {}});
}

std::string& PostgresqlValues::begin_array(unsigned type, unsigned element_type,
                                           std::size_t count) {
  std::string& bytes = add_value(type).bytes;
  // Number of dimensions, 1 if there are nulls, element type; then size and first index of the
  // dimension.
  append_big_endian(bytes, count == 0 ? 0 : 1, 4);
  append_big_endian(bytes, 0, 4);
  append_big_endian(bytes, element_type, 4);
  if (count > 0) {
    append_big_endian(bytes, count, 4);
    append_big_endian(bytes, 1, 4);
  }
  return bytes;
}

PostgresqlValues& PostgresqlValues::add(std::int64_t value) {
  append_big_endian(add_value(int8_type).bytes, static_cast<std::uint64_t>(value), 8);
  return *this;
}

PostgresqlValues& PostgresqlValues::add(const std::optional<double>& value) {
  Value& field = add_value(float8_type);
  field.null = !value;
  // Adding 0 turns -0 into 0: SQLite does not keep the sign of zero, so the checksums do not have
  // it either.
  if (value) append_big_endian(field.bytes, std::bit_cast<std::uint64_t>(*value + 0.0), 8);
  return *this;
}

PostgresqlValues& PostgresqlValues::add(std::string_view text) {
  add_value(text_type).bytes = text;
  return *this;
}

PostgresqlValues& PostgresqlValues::add_null() {
  add_value(text_type).null = true;
  return *this;
}

PostgresqlValues& PostgresqlValues::add(std::span<const std::uint8_t> bytes) {
  add_value(bytea_type).bytes.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return *this;
}

PostgresqlValues& PostgresqlValues::add(std::span<const std::int64_t> values) {
  std::string& bytes = begin_array(int8_array_type, int8_type, values.size());
  for (const std::int64_t value : values) {
    append_big_endian(bytes, 8, 4);
    append_big_endian(bytes, static_cast<std::uint64_t>(value), 8);
  }
  return *this;
}

PostgresqlValues& PostgresqlValues::add(std::span<const std::string> texts) {
  std::string& bytes = begin_array(text_array_type, text_type, texts.size());
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

PostgresqlValues::Bound PostgresqlValues::to_bound() const {
  Bound bound;
  for (const Value& value : values_) {
    if (value.bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) / 2) {
      throw ContractError("a text or image for a server", "too long", "less than 1 GB");
    }
    bound.types.push_back(value.type);
    bound.data.push_back(value.null ? nullptr : value.bytes.data());
    bound.lengths.push_back(static_cast<int>(value.bytes.size()));
    bound.binary.push_back(1);
  }
  return bound;
}

}  // namespace panonav::fleet
