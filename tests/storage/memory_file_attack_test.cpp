// Files that were made to harm: every part may be what no program of ours wrote, with checksums
// that hold.
#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <ctime>
#include <functional>
#include <map>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/checksum.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/memory_samples.hpp"

namespace panonav::testing {
namespace {

void add_field(RecordBytes& record, sqlite3_value* value) {
  switch (sqlite3_value_type(value)) {
    case SQLITE_INTEGER:
      record.add(std::int64_t{sqlite3_value_int64(value)});
      break;
    case SQLITE_FLOAT:
      record.add(sqlite3_value_double(value));
      break;
    case SQLITE_TEXT:
      record.add(std::string_view(reinterpret_cast<const char*>(sqlite3_value_text(value))));
      break;
    default:
      record.add(std::span(static_cast<const std::uint8_t*>(sqlite3_value_blob(value)),
                           static_cast<std::size_t>(sqlite3_value_bytes(value))));
  }
}

// row_sum(..): checksum of a row. blob_sum(.., blob): of one with a long field at its end.
void row_sum(sqlite3_context* context, int count, sqlite3_value** values) {
  RecordBytes record;
  for (int i = 0; i < count; ++i) add_field(record, values[i]);
  sqlite3_result_int64(context, static_cast<std::int64_t>(checksum(record.bytes())));
}

void blob_sum(sqlite3_context* context, int count, sqlite3_value** values) {
  RecordBytes record;
  for (int i = 0; i + 1 < count; ++i) add_field(record, values[i]);
  const auto* blob = static_cast<const std::uint8_t*>(sqlite3_value_blob(values[count - 1]));
  const auto size = static_cast<std::size_t>(sqlite3_value_bytes(values[count - 1]));
  sqlite3_result_int64(context, static_cast<std::int64_t>(
                                    checksum(std::span(blob, size), checksum(record.bytes()))));
}

// bomb(n): n zeros, packed as closely as zlib packs.
void bomb(sqlite3_context* context, int, sqlite3_value** values) {
  const std::vector<Bytef> zeros(static_cast<std::size_t>(sqlite3_value_int(values[0])));
  std::vector<Bytef> packed(compressBound(zeros.size()));
  uLongf size = packed.size();
  compress2(packed.data(), &size, zeros.data(), zeros.size(), Z_BEST_COMPRESSION);
  sqlite3_result_blob64(context, packed.data(), size, SQLITE_TRANSIENT);
}

void attack(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  using Function = void (*)(sqlite3_context*, int, sqlite3_value**);
  const std::map<const char*, Function> functions{
      {"row_sum", row_sum}, {"blob_sum", blob_sum}, {"bomb", bomb}};
  for (const auto& [name, function] : functions) {
    sqlite3_create_function(database, name, -1, SQLITE_UTF8, nullptr, function, nullptr, nullptr);
  }
  EXPECT_EQ(sqlite3_exec(database, ("PRAGMA journal_mode=DELETE;" + sql).c_str(), nullptr, nullptr,
                         nullptr),
            SQLITE_OK)
      << sql << ": " << sqlite3_errmsg(database);
  sqlite3_close(database);
}

class MemoryFileAttack : public MemoryFileTest {
 protected:
  void SetUp() override {
    MemoryFile file = MemoryFile::create(path, mirror_header());
    Random random(1);
    std::vector<ViewId> ids;
    for (int number = 0; number < 6; ++number) {
      ids.push_back(file.append(random_view(random, mirror_header().shape, number)));
    }
    file.link(std::vector<Link>{{ids[0], ids[1], Link::Kind::sequence}});
    file.save_map("map", {{{ids[0], {}}, {ids[1], {}}}, {}});
    RoutePanorama route(16);
    for (int i = 0; i < 20; ++i) {
      std::vector<std::uint8_t> line(16, static_cast<std::uint8_t>(random.index(256)));
      static_cast<void>(route.append({0.1 * i, 0.0, 0.0}, std::span<const std::uint8_t>(line)));
    }
    file.append_route("route", route);
  }
  // The first line that says what is wrong: of opening, or of verify.
  [[nodiscard]] static std::string fault_of(const std::filesystem::path& file) {
    try {
      const MemoryFile memory = MemoryFile::open(file, Access::read_only);
      const auto faults = memory.verify();
      return faults.empty() ? "intact" : faults.front().what;
    } catch (const FileError& error) {
      return error.what();
    }
  }
};

struct Attack {
  std::string sql;
  std::string fault;  // a part of the line
};

std::string set_setting(const std::string& key, const std::string& value) {
  return "UPDATE settings SET value = " + value + ", checksum = row_sum('" + key + "', " + value +
         ") WHERE key = '" + key + "'";
}

std::string to_hex(const std::string& text) {
  std::string digits;
  for (const char c : text) digits += to_hex_digits(static_cast<unsigned char>(c), 2);
  return digits;
}

// A kept change of these bytes, in hexadecimal digits, with a checksum that holds.
std::string keep_change(const std::string& bytes) {
  return "INSERT INTO history VALUES(1, 'all', 5.0, x'" + bytes + "', blob_sum('all', 5.0, x'" +
         bytes + "'))";
}

const std::string links_head = "540401010000" + to_hex("links") + "00";
const std::string zeros(16, '0');

TEST_F(MemoryFileAttack, IsNamed) {
  const std::string whole = bytes_of(path);
  ASSERT_EQ(fault_of(path), "intact");
  const std::string node = "x'01000000'||x'FFFFFFFF'||zeroblob(24)";
  const std::vector<Attack> attacks{
      // Code in the schema.
      {"CREATE TRIGGER t AFTER INSERT ON views BEGIN DELETE FROM views; END",
       "trigger t is not a part of a memory"},
      {"CREATE VIEW v AS WITH RECURSIVE n(i) AS (VALUES(1) UNION ALL SELECT i + 1 FROM n) SELECT "
       "max(i) FROM n",
       "view v is not a part of a memory"},
      {"CREATE TABLE more(x)", "table more is not a part of a memory"},
      {"CREATE INDEX more ON views(x_m)", "index more is not a part of a memory"},
      {"CREATE VIRTUAL TABLE words USING fts5(word)", "is not a part of a memory"},
      {"ANALYZE", "table sqlite_stat1 is not a part of a memory"},
      {"PRAGMA writable_schema=ON; UPDATE sqlite_schema SET sql = replace(sql, 'STRICT', 'STRICT "
       "') "
       "WHERE name = 'thumbnails'",
       "table thumbnails is not as it was made"},
      {"PRAGMA writable_schema=ON; UPDATE sqlite_schema SET rootpage = (SELECT rootpage FROM "
       "sqlite_schema WHERE name = 'links') WHERE name = 'maps'",
       "is not as it was made"},
      {"PRAGMA writable_schema=ON; DELETE FROM sqlite_schema WHERE name = 'links_b'",
       "index links_b is missing"},
      {"DROP TABLE history", "table history is missing"},
      {"DROP TABLE history", "table history is missing"},
      // The table of sequence numbers, which takes anything.
      {"UPDATE sqlite_sequence SET seq = 'many'", "column seq holds a value of a wrong type"},
      {"INSERT INTO sqlite_sequence VALUES('views', 3)",
       "table sqlite_sequence holds more than the last view id"},
      {"INSERT INTO sqlite_sequence VALUES('links', 3)",
       "table sqlite_sequence holds more than the last view id"},
      {"UPDATE sqlite_sequence SET seq = 1", "the last view id is 1, the largest 6"},
      {"UPDATE sqlite_sequence SET seq = -5", "the last view id is -5"},
      {"UPDATE sqlite_sequence SET seq = 4294967295", "the last view id is 4294967295"},
      {"UPDATE sqlite_sequence SET seq = 9223372036854775807",
       "the last view id is 9223372036854775807"},
      {"UPDATE views SET id = 9223372036854775807 WHERE id = 6", "9223372036854775807"},
      // Links.
      {"INSERT INTO links VALUES(2, 2, 0, row_sum(2, 2, 0))",
       "a link of views 2 and 2; allowed: the smaller id first"},
      {"INSERT INTO links VALUES(3, 2, 0, row_sum(3, 2, 0))",
       "a link of views 3 and 2; allowed: the smaller id first"},
      {"INSERT INTO links VALUES(3, 99, 0, row_sum(3, 99, 0))", "of which one is missing"},
      // Sizes.
      {set_setting("panorama_columns", "2147483647"), "panorama_columns is 2147483647"},
      {set_setting("rows", "2147483647"), "rows is 2147483647"},
      {set_setting("components", "2147483647"), "components"},
      {set_setting("source.camera.width_px", "2147483647"), "width_px is 2147483647"},
      {set_setting("source.camera.height_px", "2147483647"), "height_px is 2147483647"},
      {set_setting("rows", "9223372036854775807"), "rows is "},
      // Maps.
      {"UPDATE maps SET nodes = CAST(" + node + " AS BLOB), checksum = row_sum('map', CAST(" +
           node + " AS BLOB), x'')",
       "connected component of node 0 is 4294967295"},
      {"UPDATE maps SET nodes = x'00', checksum = row_sum('map', x'00', x'')", "map map: "},
      // Routes.
      {"UPDATE routes SET lines = 9223372036854775807, checksum = row_sum('route', 16, "
       "9223372036854775807)",
       "its last block of 36028797018963968 is missing"},
      {"UPDATE routes SET lines = -1, checksum = row_sum('route', 16, -1)", "route route: "},
      {"UPDATE routes SET lines = 257, checksum = row_sum('route', 16, 257)",
       "its last block of 2 is missing"},
      {"UPDATE routes SET columns = 2147483647, checksum = row_sum('route', 2147483647, 20)",
       "columns are 2147483647; allowed: 16 to 16384"},
      // A chain whose checksums are right.
      {"INSERT INTO routes VALUES('chain', 0, 3, row_sum('chain', 0, 3));"
       "INSERT INTO route_blocks VALUES('chain', 0, x'504E4331', blob_sum('chain', 0, "
       "x'504E4331'))",
       "route chain: bytes of a chain is 4; allowed: > 23"},
      {"INSERT INTO routes VALUES('bomb', 16384, 51200, row_sum('bomb', 16384, 51200));"
       "WITH RECURSIVE n(i, b) AS (SELECT 0, bomb(256 * 16410) UNION ALL SELECT i + 1, b FROM n "
       "WHERE i < 199) INSERT INTO route_blocks SELECT 'bomb', i, b, blob_sum('bomb', i, b) FROM n",
       "route bomb: block 0 cannot be unpacked"},
      // Kept changes.
      {"INSERT INTO history VALUES(1, 'all', 5.0, x'54FF', 3)", "does not match its checksum"},
      {keep_change("54FFFFFFFFFFFFFF"), "cannot be read: a length is out of range"},
      {keep_change("54FF"), "cannot be read: it is cut"},
      {keep_change("54030100006B6579"), "the name of a table does not end"},
      {keep_change("540101" + to_hex("log") + "00"), "it is of a table that cannot be undone"},
      {keep_change("540401010101" + to_hex("links") + "00"), "the columns of table links"},
      {keep_change("1200"), "a change comes before its table"},
      {keep_change(links_head + "0100"), "it does something unknown"},
      // Both views, but the kind is a text and the checksum is missing.
      {keep_change(links_head + "1200010000000000000001010000000000000002030141" + "05"),
       "a row has a wrong field"},
      {keep_change(links_head + "120001000000000000000001000000000000000201" + zeros + "01" +
                   zeros),
       "the id of a view is 0"},
      // A new setting without its value.
      {keep_change("540301"
                   "0000" +
                   to_hex("settings") +
                   "00"
                   "1200"
                   "03016B"
                   "00"
                   "01" +
                   zeros),
       "a row has a wrong field"},
  };
  for (const Attack& entry : attacks) {
    SCOPED_TRACE(entry.sql.substr(0, 100));
    const auto copy = folder.write("attacked.panonav", whole);
    attack(copy, entry.sql);
    const std::clock_t start = std::clock();
    const std::string fault = fault_of(copy);
    EXPECT_TRUE(contains(fault, entry.fault));
    EXPECT_EQ(fault.find('\n'), std::string::npos);
    for (const Access access : {Access::read_only, Access::read_write}) {
      try {
        MemoryFile file = MemoryFile::open(copy, access);
        static_cast<void>(file.info());
        static_cast<void>(file.route("bomb"));
        static_cast<void>(file.load());
        Random random(2);
        file.append(random_view(random, mirror_header().shape, 1000));
      } catch (const FileError&) {
      }
    }
    EXPECT_LT(std::clock() - start, 60 * CLOCKS_PER_SEC);
  }
}

// Nine pages, each of which refers to the next one 400 times: 400^9 rows.
std::string with_endless_table(std::string bytes, std::uint32_t root) {
  constexpr std::size_t page_bytes = 8192;
  constexpr std::uint32_t children = 400;
  const auto put = [&](std::size_t at, std::uint32_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
      bytes[at + i] = static_cast<char>(value >> (8 * (size - 1 - i)));
    }
  };
  const auto pages = static_cast<std::uint32_t>(bytes.size() / page_bytes);
  constexpr std::uint32_t levels = 9;
  const std::string leaf = bytes.substr((root - 1) * page_bytes, page_bytes);
  const bool index = leaf[0] == 0x0A;
  bytes.resize(bytes.size() + levels * page_bytes);
  for (std::uint32_t level = 0; level < levels; ++level) {
    const std::uint32_t page = level == 0 ? root : pages + level;
    const std::uint32_t child = pages + level + 1;
    const std::size_t at = (page - 1) * page_bytes;
    bytes.replace(at, page_bytes, page_bytes, '\0');
    // A cell is a child and a key: a number, or the record (NULL) in an index.
    const std::size_t cell = index ? 7 : 5;
    put(at, index ? 2 : 5, 1);
    put(at + 3, children, 2);
    put(at + 5, static_cast<std::uint32_t>(page_bytes - children * cell), 2);
    put(at + 8, child, 4);
    for (std::uint32_t i = 0; i < children; ++i) {
      const std::size_t place = page_bytes - (i + 1) * cell;
      put(at + 12 + 2 * i, static_cast<std::uint32_t>(place), 2);
      put(at + place, child, 4);
      put(at + place + 4, index ? 0x020200 : 1, index ? 3 : 1);
    }
  }
  bytes.replace((pages + levels - 1) * page_bytes, page_bytes, leaf);
  put(28, pages + levels, 4);
  return bytes;
}

TEST_F(MemoryFileAttack, TablesWithoutEndAreFoundInTime) {
  run_sql(path, "PRAGMA journal_mode=DELETE");
  const std::string whole = bytes_of(path);
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  std::vector<std::pair<std::string, std::uint32_t>> roots;
  sqlite3_exec(
      database, "SELECT name, rootpage FROM sqlite_schema",
      [](void* to, int, char** row, char**) {
        static_cast<std::vector<std::pair<std::string, std::uint32_t>>*>(to)->emplace_back(
            row[0], static_cast<std::uint32_t>(std::stoul(row[1])));
        return 0;
      },
      &roots, nullptr);
  sqlite3_close(database);
  ASSERT_EQ(roots.size(), 16U);
  for (const auto& [name, root] : roots) {
    SCOPED_TRACE(name);
    const auto copy = folder.write("endless.panonav", with_endless_table(whole, root));
    const std::array<std::pair<const char*, std::function<void(MemoryFile&)>>, 6> uses{
        {{"info", [](MemoryFile& file) { static_cast<void>(file.info()); }},
         {"verify", [](MemoryFile& file) { EXPECT_FALSE(file.verify().empty()); }},
         {"load", [](MemoryFile& file) { static_cast<void>(file.load()); }},
         {"names", [](MemoryFile& file) { static_cast<void>(file.names()); }},
         {"views", [](MemoryFile& file) { static_cast<void>(file.views()); }},
         {"append", [](MemoryFile& file) {
            Random random(3);
            file.append(random_view(random, file.header().shape, 1000));
          }}}};
    for (const auto& [what, use] : uses) {
      const std::clock_t start = std::clock();
      try {
        MemoryFile file = MemoryFile::open(copy, Access::read_write);
        use(file);
      } catch (const FileError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      }
      // To read all of it takes years; emulated processors are slow.
      EXPECT_LT(std::clock() - start, 60 * CLOCKS_PER_SEC) << what;
      folder.write("endless.panonav", with_endless_table(whole, root));
      for (const char* suffix : {"-wal", "-shm"}) std::filesystem::remove(copy.string() + suffix);
    }
  }
}

// SQLite reads changesets to invert and apply without bounds checks: 15 of 250 of these led it
// out of its buffers.
TEST_F(MemoryFileAttack, MutatedChangesAreUndoneOrNamedInTime) {
  {
    MemoryFile file = MemoryFile::open(path, Access::read_write);
    const std::vector<ViewId> views = file.views();
    file.change(
        [&] {
          file.remove(std::vector<ViewId>{views[0], views[3]});
          file.rename(views[4], "door");
          file.set_parameter("p", "x");
          file.rename_route("route", "path");
        },
        "all");
  }
  run_sql(path, "PRAGMA journal_mode=DELETE");
  const std::string whole = bytes_of(path);
  std::string bytes;
  {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
    sqlite3_stmt* query = nullptr;
    ASSERT_EQ(sqlite3_prepare_v2(database, "SELECT changes FROM history", -1, &query, nullptr),
              SQLITE_OK);
    ASSERT_EQ(sqlite3_step(query), SQLITE_ROW);
    bytes.assign(static_cast<const char*>(sqlite3_column_blob(query, 0)),
                 static_cast<std::size_t>(sqlite3_column_bytes(query, 0)));
    EXPECT_EQ(sqlite3_step(query), SQLITE_DONE);
    sqlite3_finalize(query);
    sqlite3_close(database);
  }
  ASSERT_GT(bytes.size(), 500U);
  Random random(4);
  int undone = 0;
  int refused = 0;
  for (int trial = 0; trial < 250; ++trial) {
    SCOPED_TRACE(trial);
    const std::string mutated =
        trial == 0 ? bytes
                   : damaged_bytes(
                         trial % 5 == 0 ? bytes.substr(0, random.index(bytes.size()) + 1) : bytes,
                         random, trial);
    const auto copy = folder.write("mutated.panonav", whole);
    attack(copy, "UPDATE history SET changes = x'" + to_hex(mutated) +
                     "', checksum = blob_sum(what, stamp_s, x'" + to_hex(mutated) + "')");
    const std::clock_t start = std::clock();
    const bool is_intact = fault_of(copy) == "intact";
    try {
      MemoryFile file = MemoryFile::open(copy, Access::read_write);
      file.undo();
      static_cast<void>(file.load());
      EXPECT_TRUE(is_intact);  // what verify names is never undone
      ++undone;
    } catch (const FileError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      ++refused;
    }
    EXPECT_LT(std::clock() - start, 10 * CLOCKS_PER_SEC);
    // It was undone as a whole or not at all, and the memory is as good as before.
    EXPECT_NO_THROW(static_cast<void>(MemoryFile::open(copy, Access::read_only).load()));
    for (const char* suffix : {"-wal", "-shm"}) std::filesystem::remove(copy.string() + suffix);
  }
  EXPECT_GE(undone, 1);
  EXPECT_GE(refused, 100);
}

}  // namespace
}  // namespace panonav::testing
