#include "panonav_recordings/live_pictures.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_recordings/jpeg_stream.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::recordings {
using namespace testing;
namespace {

using Bytes = std::vector<std::uint8_t>;

/// In the form of a JPEG picture, so that its end can be found: segments, one of which holds
/// another picture as cameras keep thumbnails, then data with stuffed bytes and restart markers.
Bytes picture_like(Random& random) {
  Bytes bytes{0xff, 0xd8, 0xff, 0xe1};
  Bytes thumbnail{0xff, 0xd8, 0xff, 0xda, 0x00, 0x02, 0x11, 0xff, 0xd9};
  for (std::uint64_t more = random.index(60); more > 0; --more) thumbnail.push_back(0xd9);
  bytes.push_back(0);
  bytes.push_back(static_cast<std::uint8_t>(thumbnail.size() + 2));
  bytes.insert(bytes.end(), thumbnail.begin(), thumbnail.end());
  for (const int byte : {0xff, 0xff, 0xda, 0x00, 0x03, 0x01}) {
    bytes.push_back(static_cast<std::uint8_t>(byte));
  }
  for (std::uint64_t more = random.index(200); more > 0; --more) {
    const auto value = static_cast<std::uint8_t>(random.index(256));
    bytes.push_back(value);
    if (value == 0xff) bytes.push_back(random.index(2) == 0 ? 0x00 : 0xd3);
  }
  bytes.push_back(0xff);
  bytes.push_back(0xd9);
  return bytes;
}

TEST(JpegStream, GivesTheSamePicturesHoweverTheBytesCome) {
  Random random(11, 0);
  std::vector<Bytes> pictures;
  Bytes stream;
  const std::string head = "\r\n--frame\r\nContent-Type: image/jpeg\r\n\r\n";
  for (int i = 0; i < 30; ++i) {
    pictures.push_back(picture_like(random));
    if (i % 3 == 0) stream.insert(stream.end(), head.begin(), head.end());
    stream.insert(stream.end(), pictures.back().begin(), pictures.back().end());
  }
  for (const std::size_t largest :
       {std::size_t{1}, std::size_t{2}, std::size_t{50}, stream.size()}) {
    JpegStream cut;
    std::vector<Bytes> found;
    for (std::size_t at = 0; at < stream.size();) {
      const std::size_t some = std::min(stream.size() - at, 1 + random.index(largest));
      cut.add(std::span(stream).subspan(at, some), "stream");
      while (auto picture = cut.next()) found.push_back(std::move(*picture));
      at += some;
    }
    EXPECT_EQ(found, pictures) << largest;
    EXPECT_EQ(cut.unfinished_bytes(), 0U);
  }
}

TEST(JpegStream, APictureThatWasCutOffDoesNotTakeTheNextOneAway) {
  Random random(12, 0);
  const Bytes whole = picture_like(random);
  Bytes stream(whole.begin(), whole.end() - 3);
  stream.insert(stream.end(), whole.begin(), whole.end());
  JpegStream cut;
  cut.add(stream, "stream");
  EXPECT_EQ(cut.next(), whole);
  EXPECT_FALSE(cut.next());
}

TEST(JpegStream, WhatNeverEndsIsRefused) {
  JpegStream cut;
  const Bytes beginning{0xff, 0xd8, 0xff, 0xda, 0x00, 0x02};
  cut.add(beginning, "stream");
  const Bytes rest(1U << 20U, 0x42);
  const std::string error = message_of<FileError>([&] {
    for (int i = 0; i < 80; ++i) {
      cut.add(rest, "stream");
      EXPECT_FALSE(cut.next());
    }
  });
  EXPECT_NE(error.find("67108864 bytes"), std::string::npos) << error;
}

int free_port() {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(address);
  EXPECT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&address), length), 0);
  EXPECT_EQ(getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length), 0);
  close(listener);
  return ntohs(address.sin_port);
}

TEST(LivePictures, AnAddressGivesPicturesIsOpenedAgainAndStops) {
  const std::string address = "tcp://127.0.0.1:" + std::to_string(free_port());
  // A server that sends ten pictures to each of three callers.
  std::thread server([&] {
    const std::string command =
        "for i in 1 2 3; do timeout 20 ffmpeg -nostdin -v quiet -re -f lavfi -i "
        "testsrc=size=64x32:rate=20 -frames:v 10 -c:v mjpeg -f mpjpeg " +
        quote_for_shell(address + "?listen=1") + "; done";
    (void)std::system(command.c_str());
  });
  const auto open = [&] {  // it may not listen yet
    for (int tries = 0;; ++tries) {
      try {
        return std::make_unique<LivePictures>(address, LiveOptions{.reopen_after_s = 0.05});
      } catch (const Error&) {
        if (tries == 100) throw;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    }
  };
  const auto live = open();
  double before_s = 0.0;
  std::size_t seen = 0;
  // A caller that connects while ffmpeg ends gets no image, so that two interruptions may not do.
  const auto arrived = [&] { return seen + live->counts().dropped; };
  while ((live->counts().interruptions < 2 || arrived() < 11U) && seen < 30) {
    const auto picture = live->next();
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->picture.size(), (ImageSize{64, 32}));
    EXPECT_GT(picture->stamp_s, before_s);
    before_s = picture->stamp_s;
    ++seen;
  }
  EXPECT_GE(live->counts().interruptions,
            2U);  // each caller sends ten images at most  // of two callers at least
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    live->stop();
  });
  while (live->next()) {
  }
  stopper.join();
  EXPECT_FALSE(live->next());
  server.join();
}

TEST(LivePictures, AnAddressThatFallsSilentIsOpenedAgain) {
  // Whoever calls gets twenty pictures and then nothing, but stays connected.
  const int port = free_port();
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_port = htons(static_cast<std::uint16_t>(port));
  place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(bind(listener, reinterpret_cast<sockaddr*>(&place), sizeof(place)), 0);
  ASSERT_EQ(listen(listener, 4), 0);
  const Image black(64, 32, 3);
  const Bytes picture = encode_jpeg(black.view());
  std::string text;
  for (int i = 0; i < 20; ++i) {
    text +=
        "--frame\r\nContent-Type: image/jpeg\r\nContent-Length: " + std::to_string(picture.size()) +
        "\r\n\r\n" + std::string(picture.begin(), picture.end()) + "\r\n";
  }
  std::vector<int> callers;
  std::thread server([&] {
    for (int caller = 0; (caller = accept(listener, nullptr, nullptr)) >= 0;) {
      callers.push_back(caller);
      (void)!send(caller, text.data(), text.size(), MSG_NOSIGNAL);
    }
  });
  const std::string address = "tcp://root:secret@127.0.0.1:" + std::to_string(port);
  std::vector<std::string> notes;
  {
    LivePictures live(address, {.reopen_after_s = 0.05,
                                .max_silence_s = 2.0,
                                .note = [&](const std::string& line) { notes.push_back(line); }});
    std::size_t seen = 0;
    while (notes.size() < 2 && live.next()) ++seen;
    EXPECT_GE(live.counts().interruptions, 1U);
    EXPECT_GE(seen, 1U);
  }
  const std::string shown = "tcp://root:***@127.0.0.1:" + std::to_string(port);
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_EQ(
      notes[0],
      shown + ": has sent no image in time; panonav tries to open it again until images come");
  EXPECT_EQ(notes[1], shown + " sends images again");
  shutdown(listener, SHUT_RDWR);
  server.join();
  for (const int caller : callers) close(caller);
  close(listener);
}

TEST(LivePictures, WhatCannotBeOpenedIsRefusedInOneLine) {
  for (const std::string address :
       {"tcp://127.0.0.1:1", "/dev/video_that_is_not_there", "walk.mp4", "/dev/null"}) {
    const std::string error = message_of<FileError>([&] { const LivePictures live(address); });
    EXPECT_TRUE(error.starts_with(address)) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace panonav::recordings
