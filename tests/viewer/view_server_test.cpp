#include "panonav_viewer/view_server.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/viewer_peer.hpp"

namespace panonav::viewer {
namespace {

TEST(ViewServer, GivesNothingToWhoDoesNotKnowTheToken) {
  ViewServer server;
  server.add(moment_at(1.0));
  const std::string url = server.url();
  ASSERT_EQ(status_of(ask(url, "")), 200);
  const std::string token = Peer(url).root();
  std::string other = token;
  other[5] = other[5] == '0' ? '1' : '0';
  for (const std::string& path :
       {std::string("/"), other, "/" + std::string(32, '0') + "/", token.substr(0, 20),
        std::string("/events"), other + "events", "/x/.." + token, "//" + token,
        std::string("/etc/passwd"), std::string("/../../etc/passwd"), "*" + token}) {
    const std::string answer = Peer(url).ask(path);
    EXPECT_EQ(status_of(answer), 404) << path;
    EXPECT_EQ(answer.find(token.substr(1, 32)), std::string::npos) << path;
  }
  EXPECT_NE(ViewServer().url().substr(url.size() - 33), url.substr(url.size() - 33));
}

TEST(ViewServer, SaysAtItsBareAddressWhereTheCompleteOneIs) {
  ViewServer server({.title = "the secret hall"});
  const std::string url = server.url();
  const std::string host = Peer(url).host();
  const auto answer = [&](const std::string& path, const std::string& named) {
    Peer peer(url);
    peer.say("GET " + path + " HTTP/1.1\r\nHost: " + named + "\r\nConnection: close\r\n\r\n");
    return peer.hear_all();
  };
  for (const std::string& path : {std::string("/"), Peer(url).root().substr(0, 20)}) {
    const std::string text = answer(path, host);
    EXPECT_EQ(status_of(text), 404);
    EXPECT_NE(text.find("\r\nContent-Type: text/html"), std::string::npos) << text;
    EXPECT_NE(text.find("<b>Open http://</b>"), std::string::npos);
    EXPECT_EQ(text.find("the secret hall"), std::string::npos);
    EXPECT_EQ(text.find("<script"), std::string::npos);
  }
  EXPECT_EQ(answer("/", "example.com").find("Open http"), std::string::npos);
}

TEST(ViewServer, ServesThePageAndItsRunAlone) {
  ViewServer server;
  server.add(moment_at(1.0));
  for (const std::string below :
       {"../", "..%2f", "../../etc/passwd", "picture/../../../etc/passwd", "picture/0/../camera",
        "picture//camera", "picture/-1/camera", "picture/99999999999999999999/camera",
        "picture/0/camera", "picture/0", "control", "index.html", "web/main.js", "events/"}) {
    EXPECT_EQ(status_of(ask(server.url(), below)), 404) << below;
  }
  for (const std::string method : {"POST", "PUT", "DELETE", "HEAD", "OPTIONS", "get"}) {
    Peer peer(server.url());
    EXPECT_EQ(status_of(peer.ask(peer.root(), "", method)), 405) << method;
  }
}

TEST(ViewServer, RefusesOtherOriginsAndNamesOfThisMachine) {
  ViewServer server;
  const std::string url = server.url();
  const std::string host = Peer(url).host();
  const std::string port = host.substr(host.find(':'));
  const auto answer = [&](const std::string& named, const std::string& origin) {
    Peer peer(url);
    peer.say("GET " + peer.root() + " HTTP/1.1\r\nHost: " + named + "\r\nConnection: close\r\n" +
             (origin.empty() ? "" : "Origin: " + origin + "\r\n") + "\r\n");
    return status_of(peer.hear_all());
  };
  EXPECT_EQ(answer(host, ""), 200);
  EXPECT_EQ(answer(host, "http://" + host), 200);
  EXPECT_EQ(answer("localhost" + port, "http://localhost" + port), 200);
  EXPECT_EQ(answer(host, "http://example.com"), 404);
  EXPECT_EQ(answer(host, "null"), 404);
  EXPECT_EQ(answer(host, "http://127.0.0.1:1"), 404);
  // A name server of somebody else's says that this machine is example.com.
  EXPECT_EQ(answer("example.com" + port, "http://example.com" + port), 404);
  EXPECT_EQ(answer("example.com" + port, ""), 404);
  EXPECT_EQ(answer("127.0.0.1.example.com" + port, ""), 404);
  const std::string page = ask(url, "");
  EXPECT_NE(page.find("\r\nContent-Security-Policy: default-src 'self';"), std::string::npos);
  EXPECT_NE(page.find("\r\nReferrer-Policy: no-referrer\r\n"), std::string::npos);
  EXPECT_EQ(page.find("Access-Control-Allow"), std::string::npos);
}

TEST(ViewServer, RefusesWhatIsTooLargeOrNoRequest) {
  ViewServer server({.replay = true});
  const std::string url = server.url();
  const auto answer = [&](const std::string& text) {
    Peer peer(url);
    peer.say(text);
    return status_of(peer.hear_all());
  };
  const std::string head = "POST " + Peer(url).root() + "control HTTP/1.1\r\nHost: localhost\r\n";
  EXPECT_EQ(answer(head + "Connection: close\r\nContent-Length: 14\r\n\r\n{\"play\": true}"), 204);
  EXPECT_EQ(answer(head + "Content-Length: 1025\r\n\r\n"), 413);
  EXPECT_EQ(answer(head + "Content-Length: 99999999999999999999\r\n\r\n"), 413);
  EXPECT_EQ(answer(head + "Content-Length: -1\r\n\r\n"), 400);
  EXPECT_EQ(answer(head + "Content-Length: 1\r\nContent-Length: 2\r\n\r\n"), 400);
  EXPECT_EQ(answer(head + "Transfer-Encoding: chunked\r\n\r\nffffff\r\n"), 501);
  EXPECT_EQ(answer(head + "no field\r\n\r\n"), 400);
  EXPECT_EQ(answer(head + "Host: two\r\n\r\n"), 400);
  EXPECT_EQ(answer("GET / HTTP/1.1\r\n\r\n"), 400);
  EXPECT_EQ(answer("GET /\r\n\r\n"), 400);
  EXPECT_EQ(answer("\r\n\r\n"), 400);
  EXPECT_EQ(answer(std::string(100, '\0') + "\r\n\r\n"), 400);
  // A head without an end: the server goes away long before 10 MB.
  Peer endless(url);
  endless.say("GET / HTTP/1.1\r\n");
  const std::string field = "X-Field: " + std::string(990, 'x') + "\r\n";
  int sent = 0;
  while (sent < 10'000 && endless.say(field)) ++sent;
  EXPECT_LT(sent, 5'000);
  EXPECT_EQ(status_of(ask(url, "")), 200);
}

TEST(ViewServer, ReadsNoMoreRequestsThanItCanAnswer) {
  ViewServer server;
  Peer greedy(server.url(), std::chrono::seconds(2));
  std::string requests;
  for (int i = 0; i < 1'000; ++i) {
    requests += "GET " + greedy.root() + " HTTP/1.1\r\nHost: localhost\r\n\r\n";
  }
  std::size_t sent = 0;  // and not one answer read
  while (sent < 50'000'000 && greedy.say(requests)) sent += requests.size();
  EXPECT_LT(sent, 20'000'000U);
  EXPECT_EQ(status_of(ask(server.url(), "")), 200);
}

TEST(ViewServer, TellsEachMomentInOrder) {
  ViewServer server;
  Peer peer(server.url());
  peer.follow();
  ASSERT_TRUE(soon([&] { return server.viewers() == 1; }));
  for (int i = 0; i < 200; ++i) {
    server.add(moment_at(i));
    if (i % 10 == 9) {
      ASSERT_TRUE(peer.hear_until("\"n\":" + std::to_string(i) + ",\"t\":"));
    }
  }
  ASSERT_TRUE(peer.hear_until("\"n\":199,\"t\":199.0,\"pose\":[199.0,2.0,0.5]"));
  const auto moments = peer.events("moment");
  ASSERT_EQ(moments.size(), 200U);
  for (std::size_t i = 0; i < moments.size(); ++i) EXPECT_EQ(moments[i]["n"], i);
  EXPECT_EQ(moments.back()["probability"], 0.75);
}

TEST(ViewServer, TellsWhoComesLateWhatWas) {
  ViewServer server;
  for (int i = 0; i < 30; ++i) {
    recordings::RunMoment moment = moment_at(i);
    if (i == 0) moment.references = {{1.0, 2.0}, {3.0, 4.0}};
    if (i == 4) moment.truth = ReferencePose{5.0, 6.0, 7.0};
    if (i == 3) moment.goal = Pose2{7.0, 8.0, 0.0};
    server.add(std::move(moment));
  }
  for (int times = 0; times < 2; ++times) {  // and who comes back
    Peer peer(server.url());
    peer.follow();
    ASSERT_TRUE(peer.hear_until("event: moment\n"));
    ASSERT_TRUE(peer.hear_until("\"probability\":0.75}\n\n"));
    const auto past = peer.events("past");
    ASSERT_EQ(past.size(), 1U);
    ASSERT_EQ(past[0].size(), 30U);
    EXPECT_EQ(past[0][4],
              json::parse(R"([4.0, 4.0, 2.0, 0.5, 0.75, true, "localised", 5.0, 6.0])"));
    EXPECT_EQ(past[0][7],
              json::parse(R"([7.0, 7.0, 2.0, 0.5, 0.75, true, "localised", null, null])"));
    const auto retained = peer.events("retained");
    ASSERT_EQ(retained.size(), 1U);
    EXPECT_EQ(retained[0]["references"], json::parse("[1.0, 2.0, 3.0, 4.0]"));
    EXPECT_EQ(retained[0]["goal"], json::parse("[7.0, 8.0, 0.0]"));
    const auto moments = peer.events("moment");
    ASSERT_EQ(moments.size(), 1U);
    EXPECT_EQ(moments[0]["n"], 29);
  }
}

TEST(ViewServer, KeepsABoundedPath) {
  ViewServer server;
  for (int i = 0; i < 20'000; ++i) server.add(moment_at(i));
  Peer peer(server.url());
  peer.follow();
  ASSERT_TRUE(peer.hear_until("event: moment\n"));
  const json past = peer.events("past")[0];
  EXPECT_LE(past.size(), 4096U);
  EXPECT_GE(past.size(), 2048U);
  EXPECT_EQ(past.front()[0], 0.0);
  EXPECT_EQ(past.back()[0], 19'999.0);
  for (std::size_t i = 1; i < past.size(); ++i) {
    EXPECT_LT(past[i - 1][0].get<double>(), past[i][0].get<double>());
  }
}

TEST(ViewServer, GivesPicturesOfTheNewestMoments) {
  ViewServer server;
  Peer viewer(server.url());
  viewer.follow();
  ASSERT_TRUE(soon([&] { return server.viewers() == 1; }));
  Image picture(64, 48, 3);
  for (std::size_t i = 0; i < picture.pixels().size(); ++i) {
    picture.pixels()[i] = static_cast<std::uint8_t>(i / 64);
  }
  const std::vector<std::uint8_t> thumbnail = encode_png(picture.view());
  const auto body = [](const std::string& answer) {
    const std::string text = answer.substr(answer.find("\r\n\r\n") + 4);
    return std::vector<std::uint8_t>(text.begin(), text.end());
  };
  for (int i = 0; i < 20; ++i) {
    recordings::RunMoment moment = moment_at(i);
    moment.picture = picture;
    moment.best_match = thumbnail;
    server.add(std::move(moment));
  }
  const std::string camera = ask(server.url(), "picture/19/camera");
  EXPECT_NE(camera.find("\r\nContent-Type: image/jpeg\r\n"), std::string::npos);
  const Image seen = decode_image(body(camera), "camera");
  ASSERT_EQ(seen.pixels().size(), picture.pixels().size());
  int largest = 0;
  for (std::size_t i = 0; i < seen.pixels().size(); ++i) {
    largest = std::max(largest, std::abs(seen.pixels()[i] - picture.pixels()[i]));
  }
  EXPECT_LE(largest, 24);
  const std::string best = ask(server.url(), "picture/19/best");
  EXPECT_NE(best.find("\r\nContent-Type: image/jpeg\r\n"), std::string::npos);
  EXPECT_EQ(body(best), body(camera));
  EXPECT_EQ(status_of(ask(server.url(), "picture/19/panorama")), 404);
  EXPECT_EQ(status_of(ask(server.url(), "picture/4/camera")), 200);
  EXPECT_EQ(status_of(ask(server.url(), "picture/3/camera")), 404);  // only 16 are kept
  EXPECT_EQ(status_of(ask(server.url(), "picture/20/camera")), 404);
}

TEST(ViewServer, DoesNotWaitForSlowViewers) {
  recordings::RunMoment moment = moment_at(0.0);
  moment.particles.assign(4000, {1.0, 2.0, 3.0});  // 64 kB of text
  constexpr int count = 300;
  // The time that adding took, and all of it.
  const auto add_all = [&](ViewServer& server, Peer& quick) {
    const auto begun = Clock::now();
    Clock::duration adding{};
    for (int i = 0; i < count; ++i) {
      const auto start = Clock::now();
      server.add(moment);
      adding += Clock::now() - start;
      if (i % 8 == 7) {
        EXPECT_TRUE(quick.hear_until("\"n\":" + std::to_string(i) + ","));
      }
    }
    return std::pair(adding, Clock::now() - begun);
  };
  // Who does not read is let go after 5 s, and would hold up by as much who waited for him.
  constexpr const char* too_slow =
      "this machine is too slow: the viewer is let go before it begins to read";
  {
    ViewServer server;
    Peer quick(server.url());
    quick.follow();
    ASSERT_TRUE(soon([&] { return server.viewers() == 1; }));
    if (add_all(server, quick).second > std::chrono::seconds(3)) GTEST_SKIP() << too_slow;
  }
  ViewServer server;
  Peer slow(server.url());
  slow.follow();
  Peer quick(server.url());
  quick.follow();
  ASSERT_TRUE(soon([&] { return server.viewers() == 2; }));
  const auto [adding, all] = add_all(server, quick);
  EXPECT_LT(adding, std::chrono::seconds(5));
  if (all > std::chrono::seconds(4)) GTEST_SKIP() << too_slow;
  ASSERT_TRUE(slow.hear_until("\"n\":" + std::to_string(count - 1) + ","));
  ASSERT_TRUE(slow.hear_until("\"probability\":0.75}\n\n"));
  const auto moments = slow.events("moment");
  EXPECT_LT(moments.size(), static_cast<std::size_t>(count) / 2);  // the rest was never kept for it
  for (std::size_t i = 1; i < moments.size(); ++i) {
    EXPECT_LT(moments[i - 1]["n"].get<int>(), moments[i]["n"].get<int>());
  }
}

TEST(ViewServer, OutlivesAThousandConnections) {
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = std::min<rlim_t>(files.rlim_max, 4096);
  setrlimit(RLIMIT_NOFILE, &files);
  if (files.rlim_cur < 2048) GTEST_SKIP() << "a process may open 2048 files at least";
  ViewServer server({.max_viewers = 3});
  server.add(moment_at(0.0));
  Peer viewer(server.url());
  viewer.follow();
  ASSERT_TRUE(viewer.hear_until("\"n\":0,"));
  std::vector<std::unique_ptr<Peer>> strangers;
  for (int i = 0; i < 1000; ++i) {
    strangers.push_back(std::make_unique<Peer>(server.url()));
    ASSERT_TRUE(strangers.back()->connected()) << i;
    strangers.back()->say("GET /");  // and no more
  }
  EXPECT_EQ(status_of(ask(server.url(), "")), 200);
  server.add(moment_at(1.0));
  EXPECT_TRUE(viewer.hear_until("\"n\":1,"));
  EXPECT_FALSE(strangers.front()->hear());  // made room for others
  // The number of viewers is limited also for those who know the token.
  std::vector<std::unique_ptr<Peer>> viewers;
  for (int i = 0; i < 5; ++i) {
    viewers.push_back(std::make_unique<Peer>(server.url()));
    viewers.back()->follow();
    ASSERT_TRUE(viewers.back()->hear_until("\r\n\r\n"));
    EXPECT_EQ(status_of(viewers.back()->heard()), i < 2 ? 200 : 503);
  }
  EXPECT_EQ(server.viewers(), 3U);
  viewers.clear();
  EXPECT_TRUE(soon([&] { return server.viewers() == 1; }));
}

TEST(ViewServer, SaysThatTheRunHasEnded) {
  auto server = std::make_unique<ViewServer>();
  Peer peer(server->url());
  peer.follow();
  ASSERT_TRUE(peer.hear_until("event: past\n"));
  server->add(moment_at(0.0));
  server.reset();
  const std::string& all = peer.hear_all();
  EXPECT_EQ(peer.events("moment").size(), 1U);
  EXPECT_TRUE(all.ends_with("event: ended\ndata: {}\n\n"));
}

TEST(ViewServer, PlaysReplaysAsViewersWish) {
  ViewServer server({.replay = true});
  std::atomic<int> added = 0;
  std::thread run([&] {
    for (int i = 0; i < 9; ++i) {
      server.add(moment_at(0.1 * (i < 6 ? i : i + 1000)));
      ++added;
    }
  });
  const auto stays = [&](int count) {
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    return added == count;
  };
  const auto reaches = [&](int count) { return soon([&] { return added >= count; }); };
  EXPECT_TRUE(stays(0));  // nobody looks
  auto peer = std::make_unique<Peer>(server.url());
  const auto start = Clock::now();
  peer->follow();
  EXPECT_TRUE(reaches(4));
  EXPECT_GE(Clock::now() - start, std::chrono::milliseconds(290));  // as fast as it was
  EXPECT_EQ(control(server.url(), R"({"play": false})"), 204);
  std::this_thread::sleep_for(std::chrono::milliseconds(150));  // one may be on its way
  const int held = added;
  EXPECT_TRUE(stays(held));
  EXPECT_EQ(control(server.url(), R"({"step": 1})"), 204);
  EXPECT_TRUE(reaches(held + 1));
  EXPECT_TRUE(stays(held + 1));
  for (const std::string wrong : {"", "[]", "{\"speed\": 0}", "{\"speed\": 1e9}", "{\"play\": 1}",
                                  "{\"step\": -1}", "{\"speed\": \"fast\"}"}) {
    EXPECT_EQ(control(server.url(), wrong), 400) << wrong;
  }
  EXPECT_TRUE(stays(held + 1));
  peer.reset();  // who held it goes away
  EXPECT_TRUE(soon([&] { return added == 9; }));
  run.join();
}

TEST(ViewServer, NamesTheAddressThatIsNotToBeHad) {
  const ViewServer server;
  const std::string port = Peer(server.url()).host().substr(10);
  try {
    const ViewServer second({.port = std::stoi(port)});
    FAIL() << "two servers share a port";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("127.0.0.1, port " + port), std::string::npos);
  }
  EXPECT_THROW(ViewServer({.address = "here"}), Error);
  EXPECT_THROW(ViewServer({.address = "192.0.2.1"}), Error);
  EXPECT_THROW(ViewServer({.port = 65'536}), ContractError);
}

}  // namespace
}  // namespace panonav::viewer
