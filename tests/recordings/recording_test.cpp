// Recordings: what is written comes back, damage keeps what comes before it.
#include <zstd.h>

#include <array>
#include <limits>
#include <thread>

#include "panonav/core/error.hpp"
#include "recordings/recorded_samples.hpp"

namespace panonav::recordings {
namespace {

std::string number(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += i < 8 ? static_cast<char>(value >> (8 * i)) : '\0';
  return text;
}
std::string text(std::string_view text) {
  return number(text.size(), 4) + std::string(text);
}
std::string record(int kind, const std::string& body) {
  return number(static_cast<std::uint64_t>(kind), 1) + number(body.size(), 8) + body;
}
const std::string mcap_begin = "\x89MCAP0\r\n" + record(1, text("") + text(""));
const std::string mcap_channel =
    record(4, number(0, 2) + number(0, 2) + text("/a") + text("cdr") + number(0, 4));
std::string mcap_message(std::uint64_t time, const std::string& bytes) {
  return record(5, number(0, 2) + number(0, 4) + number(time, 8) + number(time, 8) + bytes);
}
std::string mcap_chunk(std::string_view packing, const std::string& packed, std::uint64_t size) {
  return record(6, number(0, 16) + number(size, 8) + number(0, 4) + text(packing) +
                       number(packed.size(), 8) + packed);
}
const std::string mcap_end = record(15, number(0, 4)) + record(2, number(0, 20)) + "\x89MCAP0\r\n";

// A Zstandard frame of blocks of 128 KiB of x, which does not say how large it is.
std::string long_frame(int blocks) {
  std::string frame("\x28\xB5\x2F\xFD\x00\x58", 6);
  for (int i = 0; i < blocks; ++i) {
    constexpr std::uint64_t repeated = 1U << 1U;
    frame += number((131072U << 3U) | repeated | (i + 1 == blocks ? 1U : 0U), 3) + 'x';
  }
  return frame;
}

TEST_F(RecordingTest, WhatIsWrittenComesBackInOrderOfTime) {
  for (const auto compression :
       {McapCompression::none, McapCompression::lz4, McapCompression::zstd}) {
    for (const std::size_t chunk_bytes : {1, 700, 5000, 1 << 20}) {
      SCOPED_TRACE(chunk_bytes);
      const Written written =
          write_some(folder / "a.mcap", {compression, chunk_bytes, "ros2"}, 300, chunk_bytes);
      ASSERT_TRUE(is_recording(written.path));
      const auto recording = Recording::open(written.path);
      EXPECT_EQ(in_sequence(*recording), written.messages);
      EXPECT_EQ(one_by_one(*recording), written.messages);
      EXPECT_TRUE(recording->warnings().empty()) << recording->warnings()[0];
      ASSERT_TRUE(recording->time());
      EXPECT_EQ(recording->time()->begin_ns, written.messages.front().time_ns);
      EXPECT_EQ(recording->time()->end_ns, written.messages.back().time_ns);
      ASSERT_EQ(recording->topics().size(), 3U);
      for (const auto& topic : recording->topics()) {
        EXPECT_EQ(topic.type, "std_msgs/Byte");
        EXPECT_EQ(topic.encoding, MessageEncoding::cdr);
        EXPECT_EQ(topic.messages,
                  std::ranges::count(written.messages, topic.name, &Message::topic));
      }
    }
  }
}

TEST_F(RecordingTest, ASpanAndTopicsAreAFilterOfAll) {
  const Written written = write_some(folder / "a.mcap", {McapCompression::lz4, 2000, ""}, 500, 3);
  const auto recording = Recording::open(written.path);
  Random random(5);
  std::size_t found = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const auto begin = static_cast<std::int64_t>(900 + random.index(5500));
    const TimeSpan within{begin, begin + static_cast<std::int64_t>(random.index(2000))};
    Messages expected;
    std::ranges::copy_if(written.messages, std::back_inserter(expected), [&](const Message& m) {
      return m.time_ns >= within.begin_ns && m.time_ns <= within.end_ns;
    });
    EXPECT_EQ(in_sequence(*recording, within), expected);
    EXPECT_EQ(one_by_one(*recording, within), expected);
    found += expected.size();
    std::erase_if(expected, [](const Message& m) { return m.topic != "/b"; });
    Messages only_b;
    for (std::uint32_t topic = 0; topic < 3; ++topic) {
      if (recording->topics()[topic].name != "/b") continue;
      for (const auto& location : recording->locations(std::array{topic}, within)) {
        only_b.push_back({"/b", location.time_ns, recording->read(location)});
      }
    }
    EXPECT_EQ(only_b, expected);
  }
  EXPECT_GT(found, 1000U);
  EXPECT_THROW((void)recording->locations(std::array<std::uint32_t, 1>{3}), ContractError);
}

TEST_F(RecordingTest, ThreadsReadAtATime) {
  const Written written = write_some(folder / "a.mcap", {McapCompression::zstd, 3000, ""}, 400, 4);
  const auto recording = Recording::open(written.path);
  const auto locations = recording->locations(all_topics(*recording));
  ASSERT_EQ(locations.size(), written.messages.size());
  std::vector<int> wrong(4);
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < wrong.size(); ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t i = t; i < locations.size(); i += wrong.size() - 1) {
        wrong[t] += recording->read(locations[i]) != written.messages[i].bytes ? 1 : 0;
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(4));
}

TEST_F(RecordingTest, ACutFileGivesWhatComesBeforeTheCut) {
  for (const auto compression :
       {McapCompression::none, McapCompression::lz4, McapCompression::zstd}) {
    const Written written =
        write_some(folder / "a.mcap", {compression, 400, "ros2"}, 20, 9, 100, 1);
    const std::string bytes = bytes_of(written.path);
    std::size_t behind = written.messages.size(), cut_within_chunks = 0;
    const std::size_t step = compression == McapCompression::none ? 1 : 5;
    for (std::size_t size = bytes.size() - 1; size >= 8; size -= std::min(step, size)) {
      fs::resize_file(written.path, size);
      const auto recording = Recording::open(written.path);
      const Messages messages = in_sequence(*recording);
      ASSERT_LE(messages.size(), written.messages.size());
      ASSERT_TRUE(std::equal(messages.begin(), messages.end(), written.messages.begin()));
      ASSERT_LE(messages.size(), behind) << size;
      cut_within_chunks += messages.size() < behind ? 1 : 0;
      behind = messages.size();
      if (messages.size() < written.messages.size()) {
        ASSERT_EQ(recording->warnings().size(), 1U) << size;
      }
    }
    EXPECT_EQ(behind, 0U);
    // Uncompressed chunks give every message that is whole, packed ones at least every chunk.
    EXPECT_GE(cut_within_chunks, compression == McapCompression::none ? 20U : 3U);
  }
}

TEST_F(RecordingTest, AWriterThatIsKilledLeavesWhatItWrote) {
  const auto path = folder / "a.mcap";
  McapWriter writer(path, {McapCompression::zstd, 1 << 20, ""});
  const auto channel = writer.add_channel("/a", "cdr", 0);
  writer.write(channel, 1, 1, std::array<std::uint8_t, 2>{1, 2});
  writer.flush();
  writer.write(channel, 2, 2, {});
  const auto recording = Recording::open(path);
  EXPECT_EQ(in_sequence(*recording), (Messages{{"/a", 1, {1, 2}}}));
  EXPECT_EQ(recording->warnings().size(), 1U);
  writer.close();
  EXPECT_EQ(in_sequence(*Recording::open(path)), (Messages{{"/a", 1, {1, 2}}, {"/a", 2, {}}}));
  writer.close();
  EXPECT_THROW(writer.write(channel, 3, 3, {}), ContractError);
}

TEST_F(RecordingTest, AFullDiskIsReported) {
  if (!fs::exists("/dev/full")) GTEST_SKIP();
  const auto full = message_of<FileError>([] { McapWriter writer("/dev/full"); });
  EXPECT_TRUE(contains(full, "/dev/full: cannot be written: No space left"));
  EXPECT_THROW(McapWriter writer(folder / "no" / "a.mcap"), FileError);
}

// A chunk with a wrong checksum does not stop the others.
TEST_F(RecordingTest, ADamagedChunkIsLeftOutAndNamed) {
  const Written written = write_some(folder / "a.mcap", {McapCompression::none, 900, ""}, 60, 2);
  std::string bytes = bytes_of(written.path);
  // Within the bytes of the last message of the second chunk.
  const auto locations =
      Recording::open(written.path)->locations(std::array<std::uint32_t, 3>{0, 1, 2});
  const auto in_second = std::ranges::find(locations, 1U, &MessageLocation::block);
  ASSERT_NE(in_second, locations.end());
  const auto& victim = *in_second;
  const auto content = Recording::open(written.path)->read(victim);
  ASSERT_GE(content.size(), 8U);
  const auto at = bytes.find(std::string(content.begin(), content.end()));
  ASSERT_NE(at, std::string::npos);
  bytes[at + 3] = static_cast<char>(bytes[at + 3] ^ 1);
  Messages others;
  for (std::size_t i = 0; i < locations.size(); ++i) {
    if (locations[i].block != victim.block) others.push_back(written.messages[i]);
  }
  const auto damaged = folder.write("damaged.mcap", bytes);
  // Without its footer the file is read from its beginning to its end.
  const auto unclosed = folder.write("unclosed.mcap", bytes.substr(0, bytes.size() - 20));
  for (const auto& path : {damaged, unclosed}) {
    const auto recording = Recording::open(path);
    EXPECT_EQ(in_sequence(*recording), others);
    ASSERT_EQ(recording->warnings().size(), 1U);
    EXPECT_TRUE(contains(recording->warnings()[0], path.string() + ": the chunk at byte "));
    EXPECT_TRUE(contains(recording->warnings()[0], "its checksum is wrong"));
  }
  EXPECT_THROW((void)Recording::open(damaged)->read(victim), FileError);
  // Times outside of the chunk do not touch it: the index says where it lies.
  const auto recording = Recording::open(damaged);
  const auto last = TimeSpan{locations.back().time_ns, locations.back().time_ns};
  EXPECT_EQ(in_sequence(*recording, last).size(), 1U);
  EXPECT_TRUE(recording->warnings().empty());
}

TEST_F(RecordingTest, ADamagedSummaryIsReplacedByAPassOverTheFile) {
  const Written written = write_some(folder / "a.mcap", {McapCompression::lz4, 900, ""}, 60, 2);
  std::string bytes = bytes_of(written.path);
  bytes[bytes.size() - 100] = static_cast<char>(bytes[bytes.size() - 100] ^ 1);
  const auto recording = Recording::open(folder.write("b.mcap", bytes));
  EXPECT_EQ(in_sequence(*recording), written.messages);
  ASSERT_EQ(recording->warnings().size(), 1U);
  EXPECT_TRUE(contains(recording->warnings()[0], "its summary is damaged"));
}

TEST_F(RecordingTest, PackedMessagesAreUnpackedUpToTheLimit) {
  const auto path =
      folder.write("a.mcap", mcap_begin + mcap_channel + mcap_message(1, long_frame(10)) +
                                 mcap_message(2, long_frame(10000)) +
                                 mcap_message(3, long_frame(10).substr(0, 20)) + mcap_end);
  const auto recording = Recording::open(path, {.chunk_bytes = 2U << 20U});
  const auto locations = recording->locations(std::array{0U});
  ASSERT_EQ(locations.size(), 3U);
  EXPECT_EQ(recording->read(locations[0]), std::vector<std::uint8_t>(1310720, 'x'));
  for (const std::size_t damaged : {1, 2}) {
    EXPECT_TRUE(contains(message_of<FileError>([&] { (void)recording->read(locations[damaged]); }),
                         "a packed message cannot be unpacked, or not to 2097152 bytes"));
  }
}

TEST_F(RecordingTest, AFewBytesThatClaimManyAreNotUnpacked) {
  const std::string bomb = long_frame(512);
  const auto recording = Recording::open(
      folder.write("a.mcap", mcap_begin + mcap_chunk("zstd", bomb, 64U << 20U) + mcap_end));
  ASSERT_EQ(recording->warnings().size(), 1U);
  EXPECT_TRUE(
      contains(recording->warnings()[0], "that claim to unpack to 67108864; allowed: up to"));
}

TEST_F(RecordingTest, WhatIsTooLargeIsLeftOutInOneLine) {
  const std::string bomb = long_frame(512);
  const std::string good = mcap_chunk("", mcap_channel + mcap_message(5, "x"),
                                      (mcap_channel + mcap_message(5, "x")).size());
  const auto expect_one_line = [&](const std::string& bytes, std::string_view what) {
    const auto recording =
        Recording::open(folder.write("a.mcap", mcap_begin + bytes + good + mcap_end),
                        {.chunk_bytes = 1 << 20, .messages = 100});
    EXPECT_EQ(in_sequence(*recording), (Messages{{"/a", 5, {'x'}}}));
    ASSERT_EQ(recording->warnings().size(), 1U) << what;
    EXPECT_TRUE(contains(recording->warnings()[0], what));
  };
  expect_one_line(mcap_chunk("zstd", bomb, 64U << 20U),
                  "has 67108864 bytes; allowed: up to 1048576");
  expect_one_line(mcap_chunk("zstd", bomb, 1000), "cannot be unpacked");
  expect_one_line(mcap_chunk("lz4", bomb, 1000), "cannot be unpacked");
  expect_one_line(mcap_chunk("", "abc", ~std::uint64_t{0}), "allowed: up to 1048576");
  expect_one_line(mcap_chunk("", "abc", 2), "tells two sizes");
  expect_one_line(mcap_chunk("rar", "abc", 3), "is packed by 'rar'; allowed: none, lz4, zstd");
  expect_one_line(record(6, "short"), "its head is wrong");
  expect_one_line(mcap_message(3, "x"), "messages of channel 0 are left out");
  expect_one_line(mcap_channel + mcap_message(3, std::string(1 << 21, 'x')),
                  "bytes and is left out");
  std::string many;
  for (int i = 0; i < 101; ++i) many += mcap_message(7, "");
  EXPECT_TRUE(contains(message_of<FileError>([&] {
                         (void)Recording::open(
                             folder.write("b.mcap", mcap_begin + mcap_channel + many + mcap_end),
                             {.chunk_bytes = 1 << 20, .messages = 100});
                       }),
                       "has too many messages to list; allowed: up to 100"));
}

TEST_F(RecordingTest, UnknownRecordsAreSkippedAndTimeMayRunBack) {
  const std::string bytes = mcap_begin + record(0x80, "mine") + mcap_channel +
                            mcap_message(9, "c") + mcap_message(4, "a") + record(0x7F, "") +
                            mcap_message(4, "b") + mcap_message(~std::uint64_t{0}, "z");
  const auto recording = Recording::open(folder.write("a.mcap", bytes + mcap_end));
  const Messages expected{{"/a", 4, {'a'}},
                          {"/a", 4, {'b'}},
                          {"/a", 9, {'c'}},
                          {"/a", std::numeric_limits<std::int64_t>::max(), {'z'}}};
  EXPECT_EQ(in_sequence(*recording), expected);
  EXPECT_EQ(one_by_one(*recording), expected);
  EXPECT_TRUE(recording->warnings().empty());
}

TEST_F(RecordingTest, WhatIsNoRecordingIsRefusedInOneLine) {
  const auto refusal = [&](const fs::path& path) {
    EXPECT_FALSE(is_recording(path));
    const std::string line = message_of<FileError>([&] { (void)Recording::open(path); });
    EXPECT_TRUE(contains(line, path.string() + ": "));
    EXPECT_EQ(line.find('\n'), std::string::npos);
    return line;
  };
  EXPECT_TRUE(contains(refusal(folder / "none.mcap"), "is missing"));
  EXPECT_TRUE(contains(refusal(folder.write("empty.mcap", "")), "is not a recording"));
  EXPECT_TRUE(contains(refusal(folder.write("text.mcap", "hello")), "is not a recording"));
  EXPECT_TRUE(contains(refusal(folder.path()), "is no recording"));
  // A file that ends behind its first bytes is one without messages.
  const auto recording = Recording::open(folder.write("begun.mcap", "\x89MCAP0\r\n"));
  EXPECT_TRUE(recording->topics().empty());
  EXPECT_FALSE(recording->time());
  EXPECT_EQ(recording->warnings().size(), 1U);
}

// Whatever the bytes are: messages, warnings or one line.
TEST_F(RecordingTest, MutatedFilesNeitherCrashNorEndInSeveralLines) {
  const RecordingLimits limits{.chunk_bytes = 1 << 20, .messages = 10000};
  int changed = 0;
  for (const char* name :
       {"mcap_none.mcap", "mcap_lz4.mcap", "mcap_zstd.mcap", "mcap_unchunked.mcap",
        "mcap_bare.mcap", "bag_none.bag", "bag_bz2.bag", "bag_lz4.bag", "packed.db3"}) {
    const std::string good = bytes_of(golden(name));
    Random random(1);
    for (int trial = 0; trial < 60; ++trial) {
      std::string bytes = good;
      for (std::uint64_t edits = 1 + random.index(3); edits > 0; --edits) {
        // The head of a bag is mostly padding.
        const std::size_t first = bytes.size() > 6000 ? 4100 : 0;
        const auto at = first + random.index(bytes.size() - first);
        if (random.index(3) == 0) {
          // A length at the end of its range.
          for (std::size_t i = at; i < std::min<std::size_t>(at + 8, bytes.size()); ++i)
            bytes[i] = '\xFF';
        } else {
          bytes[at] = static_cast<char>(random.next());
        }
      }
      fs::remove(folder / "any");  // some file systems are slow to replace what a file holds
      const auto path = folder.write("any", bytes);
      try {
        const auto recording = Recording::open(path, limits);
        const Messages messages = in_sequence(*recording);
        changed += messages != golden_messages() ? 1 : 0;
        for (const auto& location : recording->locations(all_topics(*recording))) {
          try {
            (void)recording->read(location);
          } catch (const FileError&) {
          }
        }
        for (const auto& line : recording->warnings()) {
          EXPECT_EQ(line.find('\n'), std::string::npos);
        }
      } catch (const FileError& error) {
        ++changed;
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      }
    }
  }
  EXPECT_GT(changed, 50);
}

}  // namespace
}  // namespace panonav::recordings
