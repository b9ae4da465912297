#include "panonav/storage/internal/write_ahead_log.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/database.hpp"
#include "panonav/storage/internal/little_endian.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

using Mark = std::array<std::uint8_t, 16>;

struct Marks {
  Mark before{};
  Mark now{};
};

// The mark in the file itself, without any log, and its page.
struct FileMark {
  std::uint32_t page = 0;
  Mark now{};
};

// Returns the marks of the only row of the table `log`, in its only page (SQLite's file format,
// section 1.6): a leaf with one cell of 36 bytes and row id 1. The record begins with a head of 4
// bytes: id, and two blobs of 16 bytes.
std::optional<Marks> find_marks(std::span<const std::uint8_t> page) {
  constexpr std::array<std::uint8_t, 6> head{36, 1, 4, 0, 44, 44};
  if (page[0] != 0x0D || page[3] != 0 || page[4] != 1) return std::nullopt;
  const std::size_t at = std::size_t{page[8]} * 256 + page[9];
  if (at + head.size() + 2 * sizeof(Mark) > page.size()) return std::nullopt;
  const auto cell = page.subspan(at);
  if (!std::ranges::equal(head, cell.first(head.size()))) return std::nullopt;
  Marks marks;
  std::ranges::copy(cell.subspan(head.size(), sizeof(Mark)), marks.before.begin());
  std::ranges::copy(cell.subspan(head.size() + sizeof(Mark), sizeof(Mark)), marks.now.begin());
  return marks;
}

FileMark read_file_mark(const fs::path& file) {
  Database database(file, DatabaseMode::immutable);
  // If a writer was killed while it copied the log into the file, the file may be shorter than its
  // first page states; with this setting SQLite reads it nevertheless.
  sqlite3_db_config(database.handle(), SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
  database.execute("PRAGMA writable_schema=ON");
  Statement root(database,
                 "SELECT rootpage FROM sqlite_schema WHERE type = 'table' AND name = 'log'");
  if (!root.step()) database.fail_damaged("table log is missing");
  const std::int64_t page = root.integer(0);
  root.reset();
  Statement row(database, "SELECT now FROM log WHERE id = 1");
  FileMark mark;
  if (page < 2 || page > std::int64_t{UINT32_MAX} || !row.step() ||
      row.blob(0).size() != sizeof(Mark)) {
    database.fail_damaged("table log");
  }
  mark.page = static_cast<std::uint32_t>(page);
  std::ranges::copy(row.blob(0), mark.now.begin());
  return mark;
}

// Reads a log as SQLite does (file format, section 4): frames are valid as long as salts and
// running checksums match, up to the last frame that ends a change.
class LogReader {
 public:
  explicit LogReader(const fs::path& log) : in_(log, std::ios::binary) {
    std::array<std::uint8_t, 32> head{};
    if (!read(head)) return;
    const std::uint32_t magic = read_big_endian_word(head.data());
    page_bytes_ = read_big_endian_word(head.data() + 8);
    big_endian_sums_ = (magic & 1U) != 0;
    salts_ = {read_big_endian_word(head.data() + 16), read_big_endian_word(head.data() + 20)};
    update_checksums(std::span(head).first(24));
    const bool power_of_two =
        page_bytes_ >= 512 && page_bytes_ <= 65536 && (page_bytes_ & (page_bytes_ - 1)) == 0;
    valid_ = (magic & ~1U) == 0x377F0682U && power_of_two &&
             sums_[0] == read_big_endian_word(&head[24]) &&
             sums_[1] == read_big_endian_word(&head[28]);
  }

  struct Content {
    std::size_t changes = 0;
    bool starts_with_mark = false;  // the first change has a mark
    std::vector<Marks> marks;       // of all complete changes
  };
  Content read_all(std::uint32_t page_of_marks) {
    Content content;
    std::size_t marks_of_changes = 0;
    std::vector<std::uint8_t> frame(24 + std::size_t{page_bytes_});
    while (valid_ && read(frame)) {
      const auto page = std::span<const std::uint8_t>(frame).subspan(24);
      update_checksums(std::span<const std::uint8_t>(frame).first(8));
      update_checksums(page);
      if (salts_[0] != read_big_endian_word(&frame[8]) ||
          salts_[1] != read_big_endian_word(&frame[12]) ||
          sums_[0] != read_big_endian_word(&frame[16]) ||
          sums_[1] != read_big_endian_word(&frame[20])) {
        break;
      }
      if (read_big_endian_word(frame.data()) == page_of_marks) {
        if (const auto marks = find_marks(page)) content.marks.push_back(*marks);
      }
      if (read_big_endian_word(&frame[4]) == 0) continue;
      ++content.changes;
      marks_of_changes = content.marks.size();
      if (content.changes == 1) content.starts_with_mark = !content.marks.empty();
    }
    content.marks.resize(marks_of_changes);
    return content;
  }

 private:
  bool read(std::span<std::uint8_t> bytes) {
    in_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return static_cast<bool>(in_);
  }
  void update_checksums(std::span<const std::uint8_t> bytes) {
    for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8) {
      const auto word = [&](std::size_t at) {
        return big_endian_sums_ ? read_big_endian_word(&bytes[at])
                                : read_little_endian<std::uint32_t>(&bytes[at]);
      };
      sums_[0] += word(i) + sums_[1];
      sums_[1] += word(i + 4) + sums_[0];
    }
  }

  std::ifstream in_;
  std::uint32_t page_bytes_ = 0;
  bool big_endian_sums_ = false;
  bool valid_ = false;
  std::array<std::uint32_t, 2> salts_{};
  std::array<std::uint32_t, 2> sums_{};
};

bool is_own_log(const fs::path& file, const fs::path& log) {
  const auto mark = read_file_mark(file);
  const auto content = LogReader(log).read_all(mark.page);
  if (content.changes == 0) return true;  // SQLite uses nothing of it either
  if (!content.starts_with_mark) return false;
  return mark.now == content.marks.front().before ||
         std::ranges::any_of(content.marks, [&](const Marks& m) { return m.now == mark.now; });
}

}  // namespace

void require_own_log(const fs::path& file) {
  std::error_code missing;
  const auto size = [&](const fs::path& path) {
    const auto bytes = fs::file_size(path, missing);
    return missing ? 0 : bytes;
  };
  const auto refuse = [&](const fs::path& log) {
    throw FileError(file.string(),
                    "has a log beside it that is not its own, " + log.string() +
                        "; remove the log if the file is a backup, or put back the file that the "
                        "log belongs to");
  };
  // A journal belongs to another program, whose changes have no marks.
  const fs::path journal = with_suffix(file, "-journal");
  if (size(journal) > 0 && std::ifstream(journal).peek() != 0) refuse(journal);

  const fs::path log = with_suffix(file, "-wal");
  // Repeated, because a writer may move its log into the file between the two checks.
  constexpr int max_attempts = 20;
  constexpr std::chrono::milliseconds pause(20);
  for (int attempt = 0; attempt < max_attempts; ++attempt) {
    if (size(log) == 0 || is_own_log(file, log)) return;
    std::this_thread::sleep_for(pause);
  }
  refuse(log);
}

}  // namespace panonav
