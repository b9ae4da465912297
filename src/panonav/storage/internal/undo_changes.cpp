#include "panonav/storage/internal/undo_changes.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string_view>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

/// Types of a field in a changeset.
enum class FieldType : std::uint8_t { missing = 0, integer, real, text, blob, null };

/// A column of a table that can be undone.
struct Column {
  FieldType type;  ///< `null`: any type
  bool is_key = false;
  bool may_be_null = false;
};

constexpr Column integer{FieldType::integer}, text{FieldType::text}, blob{FieldType::blob};
constexpr Column integer_key{FieldType::integer, true}, text_key{FieldType::text, true};
constexpr Column integer_or_null{FieldType::integer, false, true};
constexpr Column real_or_null{FieldType::real, false, true};
constexpr Column any_type{FieldType::null};

struct UndoTable {
  std::string_view name;
  std::vector<Column> columns;
};

/// Tables whose changed rows are kept, with the columns of `create_schema`.
const std::array<UndoTable, 8>& undo_tables() {
  static const std::array<UndoTable, 8> tables{{
      {"views",
       {integer_key, text, real_or_null, real_or_null, real_or_null, real_or_null, blob, integer}},
      {"thumbnails", {integer_key, blob, integer_or_null}},
      {"links", {integer_key, integer_key, integer, integer}},
      {"maps", {text_key, blob, blob, integer}},
      {"settings", {text_key, any_type, integer}},
      {"routes", {text_key, integer, integer, integer}},
      {"route_blocks", {text_key, integer_key, blob, integer}},
      {"features", {integer_key, blob, integer_or_null}},
  }};
  return tables;
}

/// A field of a row: its type, and the value of a key.
struct Field {
  FieldType type = FieldType::missing;
  std::int64_t number = 0;
  std::string_view text;
};

class ChangeReader {
 public:
  explicit ChangeReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  UndoneRows read() {
    while (!rest_.empty()) {
      if (rest_.front() == 'T') {
        read_table_head();
      } else {
        read_change();
      }
    }
    return std::move(rows_);
  }

 private:
  [[noreturn]] static void fail(std::string_view what) {
    throw Error("a change that can be undone cannot be read: " + std::string(what));
  }

  std::span<const std::uint8_t> take(std::size_t count) {
    if (count > rest_.size()) fail("it is cut");
    const auto bytes = rest_.first(count);
    rest_ = rest_.subspan(count);
    return bytes;
  }
  std::uint8_t take_byte() { return take(1).front(); }

  /// Reads a variable-length integer: groups of seven bits, the most significant first.
  std::size_t take_size() {
    constexpr int max_groups = 5;
    std::uint64_t size = 0;
    for (int i = 0; i < max_groups; ++i) {
      const std::uint8_t byte = take_byte();
      size = (size << 7U) | (byte & 0x7FU);
      if (byte < 0x80U) return size;
    }
    fail("a length is out of range");
  }

  void read_table_head() {
    take(1);
    const std::size_t columns = take_size();
    const auto keys = take(columns);
    const auto end = std::ranges::find(rest_, std::uint8_t{0});
    if (end == rest_.end()) fail("the name of a table does not end");
    const auto bytes = take(static_cast<std::size_t>(end - rest_.begin()));
    take(1);
    const std::string_view name(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const auto found = std::ranges::find(undo_tables(), name, &UndoTable::name);
    if (found == undo_tables().end()) fail("it is of a table that cannot be undone");
    table_ = &*found;
    const bool fits = std::ranges::equal(keys, table_->columns, [](auto key, const Column& column) {
      return (key != 0) == column.is_key;
    });
    if (!fits) fail("the columns of table " + std::string(name) + " are others");
  }

  Field read_field() {
    Field field;
    const std::uint8_t type = take_byte();
    if (type > static_cast<std::uint8_t>(FieldType::null)) fail("a field has an unknown type");
    field.type = static_cast<FieldType>(type);
    if (field.type == FieldType::integer || field.type == FieldType::real) {
      std::uint64_t bits = 0;
      for (const std::uint8_t byte : take(8)) bits = (bits << 8U) | byte;
      field.number = std::bit_cast<std::int64_t>(bits);
    } else if (field.type == FieldType::text || field.type == FieldType::blob) {
      const auto bytes = take(take_size());
      field.text = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }
    return field;
  }

  std::vector<Field> read_record() {
    std::vector<Field> record;
    for (std::size_t i = 0; i < table_->columns.size(); ++i) record.push_back(read_field());
    return record;
  }

  static bool can_hold(const Column& column, const Field& field) {
    if (field.type == FieldType::missing) return false;
    if (field.type == FieldType::null) return column.may_be_null;
    if (field.type == FieldType::real && !std::isfinite(std::bit_cast<double>(field.number))) {
      return false;
    }
    return column.type == FieldType::null || column.type == field.type;
  }

  void read_change() {
    if (table_ == nullptr) fail("a change comes before its table");
    const std::uint8_t operation = take_byte();
    if (take_byte() > 1) fail("a mark is neither 0 nor 1");
    if (operation == SQLITE_INSERT || operation == SQLITE_DELETE) {
      check_row(read_record());
    } else if (operation == SQLITE_UPDATE) {
      const std::vector<Field> old_row = read_record();
      check_update(old_row, read_record());
    } else {
      fail("it does something unknown");
    }
  }

  void check_row(const std::vector<Field>& row) {
    if (!std::ranges::equal(table_->columns, row, can_hold)) fail("a row has a wrong field");
    add_affected_rows(row);
  }

  /// Unchanged columns are missing in both rows, except the key, which the old row has.
  void check_update(const std::vector<Field>& old_row, const std::vector<Field>& new_row) {
    for (std::size_t i = 0; i < old_row.size(); ++i) {
      const Column& column = table_->columns[i];
      const bool was_changed = new_row[i].type != FieldType::missing;
      const bool has_old = old_row[i].type != FieldType::missing;
      if (column.is_key ? was_changed || !has_old : was_changed != has_old) {
        fail("a row lacks a field");
      }
      if ((has_old && !can_hold(column, old_row[i])) ||
          (was_changed && !can_hold(column, new_row[i]))) {
        fail("a row has a wrong field");
      }
    }
    add_affected_rows(old_row);
  }

  void add_affected_rows(const std::vector<Field>& row) {
    const auto add_affected_view = [&](std::int64_t number) {
      if (number < 1 || number > std::numeric_limits<std::uint32_t>::max()) {
        fail("the id of a view is " + std::to_string(number));
      }
      rows_.views.push_back({static_cast<std::uint32_t>(number)});
    };
    if (table_->name == "links") {
      add_affected_view(row[0].number);
      add_affected_view(row[1].number);
    } else if (table_->name == "maps") {
      rows_.maps.emplace(row[0].text);
    } else if (table_->name == "routes" || table_->name == "route_blocks") {
      rows_.routes.emplace(row[0].text);
    } else if (table_->name == "thumbnails" || table_->name == "features") {
      constexpr std::int64_t parts_per_view = 256;
      add_affected_view(row[0].number / parts_per_view);
    } else if (table_->name != "settings") {
      add_affected_view(row[0].number);
    }
  }

  std::span<const std::uint8_t> rest_;
  const UndoTable* table_ = nullptr;
  UndoneRows rows_;
};

}  // namespace

std::vector<std::string_view> undo_table_names() {
  std::vector<std::string_view> names;
  for (const UndoTable& table : undo_tables()) names.push_back(table.name);
  return names;
}

UndoneRows read_undo_changes(std::span<const std::uint8_t> changes) {
  return ChangeReader(changes).read();
}

}  // namespace panonav
