// Recordings of other programs: bags, folders of rosbag2, files of the reference library of MCAP.
#include <zstd.h>

#include <array>
#include <cstdlib>

#include "panonav/core/error.hpp"
#include "recordings/recorded_samples.hpp"

namespace panonav::recordings {
namespace {

// Files of Debian's rosbag, which rosbag_files.py made.
TEST_F(RecordingTest, ReadsBagsOfRos1) {
  for (const char* name : {"bag_none.bag", "bag_bz2.bag", "bag_lz4.bag", "bag_unclosed.bag"}) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(is_recording(golden(name)));
    const auto recording = Recording::open(golden(name));
    EXPECT_EQ(in_sequence(*recording), golden_messages());
    EXPECT_EQ(one_by_one(*recording), golden_messages());
    EXPECT_EQ(recording->warnings().size(), name == std::string_view("bag_unclosed.bag") ? 1U : 0U);
    ASSERT_EQ(recording->topics().size(), 2U);
    EXPECT_EQ(recording->topics()[0].name, "/imu");
    EXPECT_EQ(recording->topics()[0].type, "std_msgs/String");
    EXPECT_EQ(recording->topics()[0].encoding, MessageEncoding::ros1);
    EXPECT_EQ(recording->topics()[0].messages, 14U);
    const TimeSpan within{1'050'000'000, 1'100'000'000};
    EXPECT_EQ(in_sequence(*recording, within).size(), 6U);
  }
}

TEST_F(RecordingTest, ACutBagGivesWhatComesBeforeTheCut) {
  for (const char* name : {"bag_none.bag", "bag_lz4.bag", "bag_bz2.bag"}) {
    const auto path = folder.write("cut.bag", bytes_of(golden(name)));
    const Messages all = golden_messages();
    std::size_t behind = all.size();
    for (std::size_t size = fs::file_size(path) - 1; size > 4200; size -= 17) {
      fs::resize_file(path, size);
      const auto recording = Recording::open(path);
      const Messages messages = in_sequence(*recording);
      ASSERT_TRUE(std::equal(messages.begin(), messages.end(), all.begin())) << size;
      ASSERT_LE(messages.size(), behind) << size;
      behind = messages.size();
      ASSERT_EQ(recording->warnings().size(), 1U) << size;
    }
    EXPECT_LE(behind, 1U);
  }
}

TEST_F(RecordingTest, ReadsRecordingsOfRosbag2) {
  for (const auto& path : {golden("rosbag2"), golden("packed.db3")}) {
    SCOPED_TRACE(path);
    ASSERT_TRUE(is_recording(path));
    const auto recording = Recording::open(path);
    EXPECT_EQ(in_sequence(*recording), golden_messages());
    EXPECT_EQ(one_by_one(*recording), golden_messages());
    EXPECT_TRUE(recording->warnings().empty()) << recording->warnings()[0];
    ASSERT_EQ(recording->topics().size(), 2U);
    EXPECT_EQ(recording->topics()[0].type, "sensor_msgs/Imu");
    EXPECT_EQ(recording->topics()[0].encoding, MessageEncoding::cdr);
    EXPECT_EQ(recording->topics()[0].messages, 14U);
    EXPECT_EQ(recording->time(), (TimeSpan{1'000'000'000, 1'190'000'000}));
    const TimeSpan within{1'050'000'000, 1'100'000'000};
    EXPECT_EQ(in_sequence(*recording, within).size(), 6U);
    EXPECT_EQ(one_by_one(*recording, within).size(), 6U);
  }
}

TEST_F(RecordingTest, FilesThatArePackedAsAWholeAreUnpacked) {
  const auto packed = [](const fs::path& path) {
    const std::string bytes = bytes_of(path);
    std::string made(ZSTD_compressBound(bytes.size()), '\0');
    made.resize(ZSTD_compress(made.data(), made.size(), bytes.data(), bytes.size(), 1));
    return made;
  };
  folder.write("rosbag2_0.db3.zstd", packed(golden("rosbag2") / "rosbag2_0.db3"));
  const std::string second = packed(golden("rosbag2") / "rosbag2_1.db3");
  folder.write("rosbag2_1.db3.zstd", second);
  folder.write("metadata.yaml",
               "rosbag2_bagfile_information:\n  compression_mode: FILE\n  relative_file_paths:\n"
               "    - rosbag2_0.db3.zstd\n    - rosbag2_1.db3.zstd\n");
  const auto recording = Recording::open(folder.path());
  EXPECT_EQ(in_sequence(*recording), golden_messages());
  EXPECT_TRUE(recording->warnings().empty());
  // One file alone, in two frames, of another kind.
  std::string halves;
  const std::string whole = bytes_of(golden("mcap_lz4.mcap"));
  for (const std::string& half : {whole.substr(0, 700), whole.substr(700)}) {
    halves += packed(folder.write("half", half));
  }
  const fs::path alone = folder.write("alone.mcap.zstd", halves);
  EXPECT_TRUE(is_recording(alone));
  EXPECT_EQ(in_sequence(*Recording::open(alone)), golden_messages());
  // Cut off: what comes before is read, and the file that was given is named.
  const fs::path cut = folder.write("cut.mcap.zstd", halves.substr(0, halves.size() - 20));
  const auto rest = Recording::open(cut);
  EXPECT_LT(in_sequence(*rest).size(), golden_messages().size());
  ASSERT_FALSE(rest->warnings().empty());
  for (const auto& warning : rest->warnings()) {
    EXPECT_TRUE(warning.starts_with(cut.string() + ": ")) << warning;
  }
  const auto refused = [&](const fs::path& path, const RecordingLimits& limits) {
    return message_of<FileError>([&] { (void)Recording::open(path, limits); });
  };
  EXPECT_TRUE(contains(refused(alone, {.file_bytes = 1000}), "unpacks to more than 1000 bytes"));
  const fs::path other = folder.write("other.db3.zstd", packed(folder.write("t", "no recording")));
  EXPECT_TRUE(contains(refused(other, {}), other.string() + ": is not a recording"));
}

TEST_F(RecordingTest, AFolderOfRosbag2IsReadWithoutTheFilesThatAreMissing) {
  const auto metadata = [&](std::string_view files) {
    folder.write("metadata.yaml",
                 "rosbag2_bagfile_information:\n  relative_file_paths: " + std::string(files));
  };
  metadata("[bag/one.mcap, ../none.db3, lost.db3.zstd]");
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)Recording::open(folder.path()); }),
                       "has no file that can be read: "));
  fs::copy(golden("mcap_lz4.mcap"), folder / "one.mcap");
  const auto recording = Recording::open(folder.path());
  EXPECT_EQ(in_sequence(*recording), golden_messages());
  ASSERT_EQ(recording->warnings().size(), 2U);
  EXPECT_TRUE(contains(recording->warnings()[0], (folder / "none.db3").string() + ": is missing"));
  EXPECT_TRUE(contains(recording->warnings()[1], "lost.db3.zstd: is missing"));
  // The same file twice: what has one time comes in the order of the files.
  metadata("[one.mcap, one.mcap]");
  const auto twice = Recording::open(folder.path());
  EXPECT_EQ(twice->topics()[0].messages, 28U);
  const auto messages = in_sequence(*twice);
  ASSERT_EQ(messages.size(), 40U);
  for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(messages[i], golden_messages()[i / 2]);
  for (const std::string& bad : std::initializer_list<std::string>{
           "", "{}", "[]", "[[1]]", "[a", "*x", std::string(100000, '[')}) {
    metadata(bad);
    const std::string line = message_of<FileError>([&] { (void)Recording::open(folder.path()); });
    EXPECT_TRUE(contains(line, (folder / "metadata.yaml").string() + ": ")) << bad.substr(0, 10);
    EXPECT_EQ(line.find('\n'), std::string::npos);
  }
}

TEST_F(RecordingTest, AFolderWithoutMetadataIsReadInTheOrderOfItsFiles) {
  EXPECT_FALSE(is_recording(folder.path()));
  fs::copy(golden("rosbag2") / "rosbag2_0.db3", folder / "drive_9.db3");
  fs::copy(golden("rosbag2") / "rosbag2_1.db3", folder / "drive_10.db3");
  folder.write("drive_10.db3-shm", "x");
  ASSERT_TRUE(is_recording(folder.path()));
  const auto recording = Recording::open(folder.path());
  EXPECT_EQ(in_sequence(*recording), golden_messages());
  ASSERT_EQ(recording->warnings().size(), 1U);
  EXPECT_EQ(recording->warnings()[0],
            "has no metadata.yaml, as the recorder was not closed; files read: 2");
  EXPECT_EQ(recording->locations(all_topics(*recording)).back().file, 1U);
  // Another recording beside it, or a picture: which files belong together is not known.
  fs::copy(golden("mcap_lz4.mcap"), folder / "other_0.mcap");
  EXPECT_FALSE(is_recording(folder.path()));
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)Recording::open(folder.path()); }),
                       "has no metadata.yaml and is no recording; allowed: folders of rosbag2"));
  fs::remove(folder / "other_0.mcap");
  folder.write("view.PNG", "x");
  EXPECT_FALSE(is_recording(folder.path()));
}

TEST_F(RecordingTest, ADatabaseOfSomethingElseIsRefused) {
  std::string bytes = bytes_of(golden("packed.db3"));
  const auto refusal = [&](const std::string& changed) {
    return message_of<FileError>([&] { (void)Recording::open(folder.write("a.db3", changed)); });
  };
  std::string other = bytes;
  other.replace(other.find("CREATE TABLE topics"), 19, "CREATE TABLE tropes");
  other.replace(other.find("topicstopics"), 12, "tropestropes");
  EXPECT_TRUE(contains(refusal(other), "is not a recording of rosbag2: it lacks the tables"));
  EXPECT_TRUE(contains(refusal(bytes.substr(0, 300)), "is damaged or no recording of rosbag2"));
  other = bytes;
  other.replace(68, 4, "PNAV");
  EXPECT_TRUE(contains(refusal(other), "is not a recording"));
  EXPECT_FALSE(is_recording(folder / "a.db3"));
}

// A recorder notes the size of a chunk when the chunk is full.
TEST_F(RecordingTest, ABagWhoseLastChunkHasNoSizeYetIsReadToItsEnd) {
  std::string bytes = bytes_of(golden("bag_unclosed.bag"));
  const auto chunk = bytes.rfind("compression=none");
  const auto size = bytes.rfind("size=");
  ASSERT_NE(chunk, std::string::npos);
  ASSERT_GT(size, chunk);
  bytes.replace(size + 5, 8, 8, '\0');  // the size, and the length of the data behind it
  const auto recording = Recording::open(folder.write("a.bag", bytes));
  EXPECT_EQ(in_sequence(*recording), golden_messages());
  EXPECT_EQ(one_by_one(*recording), golden_messages());
}

TEST_F(RecordingTest, ABagWithADamagedIndexIsReadWithoutIt) {
  const std::string good = bytes_of(golden("bag_lz4.bag"));
  std::string bytes = good;
  bytes[bytes.rfind("chunk_pos=") + 15] ^= 0x55;
  const auto expect_all = [&](const std::string& what) {
    const auto recording = Recording::open(folder.write("a.bag", bytes));
    EXPECT_EQ(in_sequence(*recording), golden_messages());
    ASSERT_EQ(recording->warnings().size(), 1U) << recording->warnings()[1];
    EXPECT_TRUE(contains(recording->warnings()[0], what));
  };
  expect_all("its index is damaged; the whole file is read");
  // The index of one chunk.
  bytes = good;
  bytes[bytes.find("ver=") + 4] = 9;
  expect_all("is damaged; the chunk itself is read");
  bytes = good;
  bytes.replace(bytes.find("index_pos=") + 10, 8, 8, '\x7F');
  expect_all("was not closed or is cut off");
  EXPECT_TRUE(contains(message_of<FileError>(
                           [&] { (void)Recording::open(folder.write("b.bag", "#ROSBAG V1.2\n")); }),
                       "is a bag of an old version; allowed: 2.0"));
  EXPECT_TRUE(contains(message_of<FileError>(
                           [&] { (void)Recording::open(folder.write("b.bag", "#ROSBAG V2.0\n")); }),
                       "does not begin with its head"));
}

TEST_F(RecordingTest, ReadsFilesOfTheReferenceLibrary) {
  for (const char* name : {"mcap_none.mcap", "mcap_lz4.mcap", "mcap_zstd.mcap",
                           "mcap_unchunked.mcap", "mcap_bare.mcap"}) {
    SCOPED_TRACE(name);
    const auto recording = Recording::open(golden(name));
    EXPECT_EQ(in_sequence(*recording), golden_messages());
    EXPECT_EQ(one_by_one(*recording), golden_messages());
    EXPECT_TRUE(recording->warnings().empty()) << recording->warnings()[0];
    ASSERT_EQ(recording->topics().size(), 2U);
    EXPECT_EQ(recording->topics()[0].name, "/imu");
    EXPECT_EQ(recording->topics()[0].type, "sensor_msgs/Imu");
    EXPECT_EQ(recording->topics()[0].encoding, MessageEncoding::cdr);
    EXPECT_EQ(recording->topics()[0].messages, 14U);
    EXPECT_EQ(recording->topics()[1].encoding, MessageEncoding::other);
  }
}

// Runs the script where the reference library is installed (see mcap_core.mjs).
class McapReference : public RecordingTest {
 protected:
  void SetUp() override {
    if (std::getenv("MCAP_NODE") == nullptr) GTEST_SKIP() << "MCAP_NODE is not set";
  }
  static bool run(const std::string& verb, const fs::path& target, const fs::path& out) {
    return std::system(("node '" + std::string(PANONAV_TEST_DATA) + "/../mcap_core.mjs' " + verb +
                        " '" + target.string() + "' > '" + out.string() + "'")
                           .c_str()) == 0;
  }
};

TEST_F(McapReference, ItsFilesAreReadWhicheverOptionalRecordsTheyHave) {
  ASSERT_TRUE(run("variants", folder.path(), folder / "out"));
  int files = 0;
  for (const auto& file : fs::directory_iterator(folder.path())) {
    if (file.path().extension() != ".mcap") continue;
    SCOPED_TRACE(file.path().filename());
    const auto recording = Recording::open(file.path());
    const auto messages = in_sequence(*recording);
    ASSERT_EQ(messages.size(), std::stoul(file.path().filename().string()));
    EXPECT_EQ(one_by_one(*recording), messages);
    for (std::size_t i = 0; i < messages.size(); ++i) {
      const auto byte = static_cast<std::uint8_t>(i);
      EXPECT_EQ(messages[i], (Message{"/imu", static_cast<std::int64_t>(i), {byte, byte}}));
    }
    if (!messages.empty()) {
      EXPECT_EQ(recording->topics().at(0).type, "Example");
    }
    EXPECT_TRUE(recording->warnings().empty()) << recording->warnings()[0];
    ++files;
  }
  EXPECT_EQ(files, 3 * 160);
}

TEST_F(McapReference, ItReadsOurFiles) {
  for (const auto compression :
       {McapCompression::none, McapCompression::lz4, McapCompression::zstd}) {
    const auto path = folder / "ours.mcap";
    {
      McapWriter writer(path, {compression, 300, "ros2"});
      const auto schema = writer.add_schema("sensor_msgs/msg/Imu", "ros2msg", "float64 x");
      const auto imu = writer.add_channel("/imu", "cdr", schema);
      const auto text = writer.add_channel("/text", "json", 0);
      for (const Message& message : golden_messages()) {
        writer.write(message.topic == "/imu" ? imu : text, message.time_ns, message.time_ns,
                     message.bytes);
      }
    }
    const auto answer = [&](const fs::path& file) {
      EXPECT_TRUE(run("read", file, folder / "out"));
      return bytes_of(folder / "out");
    };
    std::string ours = answer(path);
    std::string theirs = answer(golden("mcap_none.mcap"));
    for (std::string* text : {&ours, &theirs}) {
      text->erase(text->find(",\"chunks\""));
      // Ours have no attachments and no metadata.
      const std::size_t begin = text->find(",\"attachments\"");
      text->erase(begin, text->find(",\"streamed\"") - begin);
    }
    EXPECT_EQ(ours, theirs);
    EXPECT_TRUE(contains(ours, "\"streamed\":20"));
  }
}

}  // namespace
}  // namespace panonav::recordings
