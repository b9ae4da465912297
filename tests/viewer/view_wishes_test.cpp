#include "panonav_viewer/view_server.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "panonav/io/image_file.hpp"
#include "support/viewer_peer.hpp"

namespace panonav::viewer {
namespace {

std::string below_pictures(const std::string& url, int reference) {
  return ask(url, "view/" + std::to_string(reference));
}

TEST(ViewServer, GivesPicturesOfReferences) {
  const Image picture(64, 48, 3);
  std::vector<std::string> requests;
  ViewServer server({.thumbnail = [&](const std::string& name) {
    requests.push_back(name);
    return name == "a" ? encode_png(picture.view()) : std::vector<std::uint8_t>{};
  }});
  EXPECT_EQ(status_of(below_pictures(server.url(), 0)), 404);  // none is told yet
  recordings::RunMoment moment = moment_at(0.0);
  moment.references = {{1.0, 2.0}, {3.0, 4.0}};
  moment.reference_views = {{"a", 0.5}, {"../b", std::nullopt}};
  server.add(std::move(moment));
  const std::string answer = below_pictures(server.url(), 0);
  EXPECT_EQ(status_of(answer), 200);
  EXPECT_NE(answer.find("\r\nContent-Type: image/jpeg\r\n"), std::string::npos);
  EXPECT_EQ(status_of(below_pictures(server.url(), 1)), 404);  // has none
  EXPECT_EQ(status_of(below_pictures(server.url(), 2)), 404);
  for (const std::string below : {"view/", "view/a", "view/-1", "view/0/", "view/+0", "view/0x0",
                                  "view/99999999999999999999", "view/../../etc/passwd"}) {
    EXPECT_EQ(status_of(ask(server.url(), below)), 404) << below;
  }
  EXPECT_EQ(requests, (std::vector<std::string>{"a", "../b"}));
  ViewServer without;
  without.add(moment_at(0.0));
  EXPECT_EQ(status_of(below_pictures(without.url(), 0)), 404);
}

TEST(ViewServer, AnswersWhileAMemoryIsSlow) {
  std::promise<void> reading;
  std::promise<void> release;
  std::atomic<bool> was_released = false;
  {
    const Image picture(64, 48, 3);
    ViewServer server({.thumbnail = [&, released = release.get_future().share()](const auto&) {
      reading.set_value();
      was_released = released.wait_for(std::chrono::seconds(20)) == std::future_status::ready;
      return encode_png(picture.view());
    }});
    recordings::RunMoment moment = moment_at(0.0);
    moment.references = {{1.0, 2.0}};
    moment.reference_views = {{"a", 0.5}};
    server.add(std::move(moment));
    auto slow = std::async(std::launch::async, [&] { return below_pictures(server.url(), 0); });
    reading.get_future().wait();
    for (int i = 0; i < 3; ++i) EXPECT_EQ(status_of(ask(server.url(), "")), 200);
    release.set_value();
    EXPECT_EQ(status_of(slow.get()), 200);
  }
  EXPECT_TRUE(was_released);  // before that the page was answered
}

TEST(ViewServer, TakesTheWishesThatTheRunTakes) {
  const auto post_wish = [](const ViewServer& server, const std::string& body) {
    return control(server.url(), body);
  };
  recordings::RunMoment moment = moment_at(0.0);
  moment.references = {{0.0, 0.0}, {3.0, 4.0}};
  ViewServer takes_pose({.takes = ViewerInput::pose});
  EXPECT_EQ(post_wish(takes_pose, R"({"pose": [1, 2, 0.5]})"), 400);  // no references yet
  takes_pose.add(moment);
  EXPECT_FALSE(takes_pose.consume_viewer_input());
  EXPECT_EQ(post_wish(takes_pose, R"({"pose": [9, 9, 9]})"), 400);
  EXPECT_EQ(post_wish(takes_pose, R"({"pose": [1, 2, 0.5]})"), 204);
  EXPECT_EQ(takes_pose.consume_viewer_input(), (ReferencePose{1.0, 2.0, 0.5}));
  EXPECT_FALSE(takes_pose.consume_viewer_input());  // once
  EXPECT_EQ(post_wish(takes_pose, R"({"pose": [-10, 14, null]})"), 204);
  EXPECT_EQ(post_wish(takes_pose, R"({"pose": [13, -10, null]})"), 204);  // the last one counts
  EXPECT_EQ(takes_pose.consume_viewer_input(), (ReferencePose{13.0, -10.0, std::nullopt}));
  for (const std::string wrong :
       {R"({"pose": [1, 2]})", R"({"pose": [1, 2, 0, 0]})", R"({"pose": ["1", 2, 0]})",
        R"({"pose": [null, 2, 0]})", R"({"pose": [1e999, 2, 0]})", R"({"pose": [1, NaN, 0]})",
        R"({"pose": [1, 2, "north"]})", R"({"pose": [1, 2, 1e9]})", R"({"pose": {"x": 1}})",
        R"({"pose": [13.1, 2, 0]})", R"({"pose": [1, -10.1, 0]})", R"({"goal": [1, 2]})",
        R"({"pose": [1, 2, 0], "goal": [1, 2]})", R"({"pose": [1, 2, 0], "play": true})",
        R"({"play": false})", "{}", "[]", ""}) {
    EXPECT_EQ(post_wish(takes_pose, wrong), 400) << wrong;
  }
  EXPECT_FALSE(takes_pose.consume_viewer_input());
  Peer stranger(takes_pose.url());
  EXPECT_EQ(status_of(stranger.ask("/0123456789abcdef0123456789abcdef/control", "", "POST",
                                   R"({"pose": [1, 2, 0]})")),
            404);
  Peer foreign(takes_pose.url());
  EXPECT_EQ(status_of(foreign.ask(foreign.root() + "control", "Origin: http://example.com\r\n",
                                  "POST", R"({"pose": [1, 2, 0]})")),
            404);
  EXPECT_FALSE(takes_pose.consume_viewer_input());

  ViewServer takes_goal({.takes = ViewerInput::goal});
  takes_goal.add(moment);
  EXPECT_EQ(post_wish(takes_goal, R"({"pose": [1, 2, 0.5]})"), 400);
  EXPECT_EQ(post_wish(takes_goal, R"({"goal": [1, 2]})"), 204);
  EXPECT_EQ(takes_goal.consume_viewer_input(), (ReferencePose{1.0, 2.0, std::nullopt}));
  EXPECT_NE(ask(takes_goal.url(), "").find("\"takes\":\"goal\""), std::string::npos);

  ViewServer takes_none;
  takes_none.add(moment);
  EXPECT_EQ(post_wish(takes_none, R"({"goal": [1, 2]})"), 405);
  EXPECT_NE(ask(takes_none.url(), "").find("\"takes\":\"\""), std::string::npos);
}

}  // namespace
}  // namespace panonav::viewer
