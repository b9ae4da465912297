// Files that are not as they were written: damaged, cut, foreign, of another format.
#include <gtest/gtest.h>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/memory_samples.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

struct Sample {
  explicit Sample(const std::filesystem::path& path, int views = 120) {
    MemoryFile file = MemoryFile::create(path, mirror_header());
    Random random(1);
    std::vector<NewView> added;
    for (int number = 0; number < views; ++number) {
      added.push_back(random_view(random, mirror_header().shape, number));
    }
    const std::vector<ViewId> ids = file.append(added);
    std::vector<Link> links;
    for (std::size_t i = 1; i < ids.size(); ++i) {
      links.push_back({ids[i - 1], ids[i], Link::Kind::sequence});
    }
    file.link(links);
    file.set_parameter("unknown place", "0.25");
    content.emplace(file.load());
  }
  std::optional<VisualMemory> content;
};

// Reads everything there is to read. True: the content is that of the sample. False: it was refused
// with a clear line. Anything else fails the test.
bool reads_the_same(const std::filesystem::path& path, const VisualMemory& expected) {
  bool verified = false;
  try {
    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    const std::vector<MemoryFile::Fault> faults = file.verify();
    verified = faults.empty();
    for (const MemoryFile::Fault& fault : faults) {
      EXPECT_FALSE(fault.what.empty());
      EXPECT_EQ(fault.what.find('\n'), std::string::npos) << fault.what;
    }
    EXPECT_EQ(file.header(), mirror_header());
    EXPECT_EQ(file.parameter("unknown place"), "0.25");
    EXPECT_TRUE(same_content(file.load(), expected)) << "other content was read without an error";
    return verified;
  } catch (const FileError& error) {
    const std::string message = error.what();
    EXPECT_FALSE(verified) << "verify found nothing, but reading says: " << message;
    EXPECT_EQ(message.rfind(path.string() + ": ", 0), 0U) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return false;
  }
}

using MemoryFileDamage = MemoryFileTest;

TEST_F(MemoryFileDamage, NothingIsReadThatWasNotWritten) {
  const Sample sample(path);
  const std::string good = bytes_of(path);
  ASSERT_TRUE(reads_the_same(path, *sample.content));
  Random random(2);
  int refused = 0;
  constexpr int trials = 400;
  for (int trial = 0; trial < trials; ++trial) {
    SCOPED_TRACE(trial);
    const std::string damaged = damaged_bytes(good, random, trial);
    const auto copy = folder.write("damaged.panonav", damaged);
    refused += !reads_the_same(copy, *sample.content);
    ASSERT_EQ(bytes_of(copy), damaged) << "a damaged file was changed";
    if (HasFailure()) return;
  }
  EXPECT_GT(refused, trials / 4);
}

// Pages hold the structure of the tables at their beginning; there damage is worst.
TEST_F(MemoryFileDamage, DamagedPageHeads) {
  const Sample sample(path);
  const std::string good = bytes_of(path);
  Random random(3);
  constexpr std::size_t page_bytes = 8192;
  ASSERT_EQ(good.size() % page_bytes, 0U);
  int refused = 0;
  for (std::size_t page = 0; page < good.size() / page_bytes; ++page) {
    for (int trial = 0; trial < 40; ++trial) {
      std::string damaged = good;
      const std::size_t at = page * page_bytes + random.index(page == 0 ? 140 : 40);
      damaged[at] = static_cast<char>(random.index(256));
      if (damaged == good) continue;
      const auto copy = folder.write("damaged.panonav", damaged);
      SCOPED_TRACE("page " + std::to_string(page) + " at byte " + std::to_string(at));
      refused += !reads_the_same(copy, *sample.content);
      if (HasFailure()) return;
    }
  }
  EXPECT_GT(refused, 100);
}

TEST_F(MemoryFileDamage, CutFilesAreRefused) {
  const Sample sample(path);
  const std::string good = bytes_of(path);
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1}, std::size_t{99}, std::size_t{100}, std::size_t{5000},
        std::size_t{8192}, good.size() / 2, good.size() - 8192, good.size() - 1}) {
    const auto copy = folder.write("cut.panonav", good.substr(0, size));
    EXPECT_FALSE(reads_the_same(copy, *sample.content)) << size;
    EXPECT_EQ(std::filesystem::file_size(copy), size);
  }
}

TEST_F(MemoryFileDamage, VerifyNamesTheDamagedView) {
  { const Sample sample(path); }
  const std::string good = bytes_of(path);
  // The signature of view 30 as it lies in the file.
  PackedSignature packed;
  std::optional<ViewId> view;
  {
    const VisualMemory memory = MemoryFile::open(path, Access::read_only).load();
    view = memory.find("view_30.png");
    ASSERT_TRUE(view);
    packed = memory.packed(*view);
  }
  const std::string signature(packed.magnitudes.begin(), packed.magnitudes.end());
  const std::size_t at = good.find(signature);
  ASSERT_NE(at, std::string::npos);
  std::string damaged = good;
  damaged[at + 3] = static_cast<char>(damaged[at + 3] ^ 1);
  const MemoryFile file =
      MemoryFile::open(folder.write("damaged.panonav", damaged), Access::read_only);
  const auto faults = file.verify();
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].view, view);
  EXPECT_EQ(faults[0].what, "view 31 does not match its checksum");
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)file.load(); }), "is damaged: view 31"));
}

void expect_refused_unchanged(const std::filesystem::path& path, std::string_view part) {
  const std::string before = bytes_of(path);
  for (const Access access : {Access::read_only, Access::read_write}) {
    const std::string message =
        message_of<FileError>([&] { (void)MemoryFile::open(path, access); });
    EXPECT_TRUE(contains(message, part));
    EXPECT_EQ(bytes_of(path), before);
  }
}

TEST_F(MemoryFileDamage, ForeignFilesAreRefused) {
  expect_refused_unchanged(folder.write("text.panonav", std::string(1000, 'x')),
                           "is not a memory file");
  expect_refused_unchanged(folder.write("empty.panonav", ""), "is not a memory file");
  const auto other = folder / "other.sqlite";
  run_sql(other, "CREATE TABLE songs(title TEXT)");
  expect_refused_unchanged(other, "application_id is 0x00000000; allowed: 0x504e4156");
  EXPECT_TRUE(contains(
      message_of<FileError>([&] { (void)MemoryFile::open(folder.path(), Access::read_only); }),
      "is a folder"));
  EXPECT_TRUE(contains(message_of<FileError>([&] {
                         (void)MemoryFile::open(folder / "none.panonav", Access::read_write);
                       }),
                       "No such file"));
  EXPECT_FALSE(std::filesystem::exists(folder / "none.panonav"));
}

TEST_F(MemoryFileDamage, FilesOfAnotherFormatAreRefused) {
  { (void)MemoryFile::create(path, small_header()); }
  for (const char* version : {"0", "2", "8"}) {
    run_sql(path, "PRAGMA journal_mode=DELETE; PRAGMA user_version=" + std::string(version));
    expect_refused_unchanged(path, "has format version " + std::string(version) + "; allowed: 1");
  }
}

TEST_F(MemoryFileDamage, OtherTablesAreRefused) {
  int number = 0;
  const auto refused_after = [&](const std::string& sql, std::string_view part) {
    const auto path = folder / ("m" + std::to_string(number++) + ".panonav");
    { (void)MemoryFile::create(path, small_header()); }
    run_sql(path, "PRAGMA journal_mode=DELETE;" + sql);
    expect_refused_unchanged(path, part);
  };
  refused_after("DROP TABLE links", "table links is missing");
  refused_after("CREATE TRIGGER t AFTER INSERT ON views BEGIN DELETE FROM views; END",
                "trigger t is not a part of a memory");
  refused_after("CREATE VIEW extra AS SELECT 1", "view extra is not a part of a memory");
  refused_after("CREATE INDEX more ON views(x_m)", "index more is not a part of a memory");
  refused_after("ANALYZE", "table sqlite_stat1 is not a part of a memory");
  refused_after("DELETE FROM settings WHERE key = 'full_scale'", "full_scale is missing");
  refused_after("UPDATE settings SET value = 3 WHERE key = 'rows'", "checksum of setting rows");
  refused_after("INSERT INTO settings VALUES('rows2', 3, 0)", "checksum of setting rows2");
}

TEST_F(MemoryFileDamage, RowsThatWereTamperedWith) {
  int number = 0;
  const auto refused_after = [&](const std::string& sql) {
    const auto path = folder / ("m" + std::to_string(number++) + ".panonav");
    const Sample sample(path, 6);
    run_sql(path, sql);
    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    EXPECT_THROW((void)file.load(), FileError) << sql;
    EXPECT_FALSE(file.verify().empty()) << sql;
  };
  refused_after("UPDATE views SET x_m = 1.5 WHERE id = 2");
  refused_after("UPDATE views SET name = 'other' WHERE id = 3");
  refused_after("UPDATE views SET id = 50 WHERE id = 3");
  refused_after("UPDATE views SET signature = x'00' WHERE id = 3");
  refused_after("UPDATE links SET kind = 2 WHERE a = 2");
  refused_after("UPDATE links SET kind = 9 WHERE a = 2");
  refused_after("DELETE FROM views WHERE id = 2");  // its links stay behind
}

/// Lowers the first key of each inner page of the file's trees by one, so that a search for a row
/// ends on the wrong page, and a scan still finds it.
std::string misdirect_searches(std::string bytes) {
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
  const std::size_t page_bytes = byte(16) * 256U + byte(17);
  for (std::size_t page = page_bytes; page + page_bytes <= bytes.size(); page += page_bytes) {
    constexpr unsigned char inner_table_page = 5;
    if (byte(page) != inner_table_page || byte(page + 3) + byte(page + 4) == 0) continue;
    const std::size_t cell = page + byte(page + 12) * 256U + byte(page + 13);
    constexpr unsigned char max_short_key = 127;  // larger ones take more bytes
    if (byte(cell + 4) > 1 && byte(cell + 4) <= max_short_key) --bytes[cell + 4];
  }
  return bytes;
}

TEST_F(MemoryFileDamage, AViewThatIsListedButNotFoundIsDamage) {
  const Sample sample(path);
  const auto damaged = folder.write("damaged.panonav", misdirect_searches(bytes_of(path)));
  MemoryFile file = MemoryFile::open(damaged, Access::read_write);
  int missing = 0;
  for (const ViewId view : file.views()) {
    try {
      (void)file.thumbnail(view);
      const Link link{view, ViewId{view.value == 1 ? 2U : 1U}, Link::Kind::closure};
      file.link(std::span(&link, 1));
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find("is missing"), std::string::npos) << error.what();
      ++missing;
    }
  }
  EXPECT_GT(missing, 0);
  EXPECT_THROW((void)file.thumbnail(ViewId{1000}), ContractError);
}

// A file in SQLite's other journal mode (copied with its tools, say) is as good.
TEST_F(MemoryFileDamage, AFileWithoutWriteAheadLogIsRead) {
  const Sample sample(path);
  run_sql(path, "PRAGMA journal_mode=DELETE");
  EXPECT_TRUE(reads_the_same(path, *sample.content));
  Random random(4);
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  file.append(random_view(random, mirror_header().shape, 1000));
  EXPECT_EQ(file.load().size(), sample.content->size() + 1);
}

}  // namespace
}  // namespace panonav::testing
