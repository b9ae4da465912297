#include "panonav/io/media_kind.hpp"

#include <gtest/gtest.h>

#include <string>

#include "panonav/io/atomic_file.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

using std::string_literals::operator""s;

TEST(MediaKind, FirstBytesDecide) {
  std::string stream(600, '\0');
  for (const std::size_t at : {0, 188, 376, 564}) stream[at] = 'G';
  std::string stamped(600, '\0');
  for (const std::size_t at : {4, 196, 388, 580}) stamped[at] = 'G';
  for (const std::string& video : {"\0\0\0\x20"
                                   "ftypisom\0\0\2\0"s,
                                   "\0\0\0\x14"
                                   "ftypqt  \0\0\0\0"s,
                                   "\0\0\2\0moov\0\0\0\x6cmvhd"s, "\x1a\x45\xdf\xa3\x01"s,
                                   "RIFF\1\2\3\4AVI LIST"s, stream, stamped, "\0\0\1\xba\x44"s}) {
    EXPECT_EQ(identify_media(video), MediaKind::video) << video.substr(0, 12);
  }
  EXPECT_EQ(identify_media("\xff\xd8\xff\xe1"s), MediaKind::picture);
  EXPECT_EQ(identify_media("\x89PNG\r\n\x1a\n\0"s), MediaKind::picture);
  for (const std::string& foreign : {"\0\0\0\x18"
                                     "ftypheic\0\0\0\0"s,
                                     "\0\0\0\x1c"
                                     "ftypavif\0\0\0\0"s,
                                     "RIFF\1\2\3\4WEBP"s}) {
    EXPECT_EQ(identify_media(foreign), MediaKind::foreign_picture) << foreign.substr(0, 12);
  }
  for (const std::string& other :
       {""s, "G"s, std::string(600, 'x'), "Good morning"s, "RIFF\1\2\3\4WAVE"s}) {
    EXPECT_EQ(identify_media(other), MediaKind::other) << other.substr(0, 12);
  }
}

TEST(MediaKind, PicturesOfAFolder) {
  const TemporaryFolder folder;
  const std::string jpeg = "\xff\xd8\xff\xe0....";
  const auto is_picture = [&](const std::string& name, const std::string& content) {
    write_file(folder / name, std::string_view(content));
    return is_folder_picture(folder / name);
  };
  EXPECT_TRUE(is_picture("a.insp", jpeg));
  EXPECT_TRUE(is_picture("photo", jpeg));
  EXPECT_TRUE(is_picture("b.JPG", "damaged"));
  EXPECT_TRUE(is_picture("empty.png", ""));
  EXPECT_FALSE(is_picture("._a.jpg", jpeg)) << "a companion of macOS";
  EXPECT_FALSE(is_picture(".hidden.jpg", jpeg));
  EXPECT_FALSE(is_picture("GX010001.THM", jpeg)) << "the thumbnail of a video";
  EXPECT_FALSE(is_picture("notes.txt", "Good morning"));
  EXPECT_FALSE(is_picture("download.jpg", "RIFF....WEBPVP8 ")) << "whatever its name";
}

}  // namespace
}  // namespace panonav::testing
