#include "panonav_server/localisation_server.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav_server/place_json.hpp"
#include "panonav_server/upload_page.hpp"
#include "support/landmark_pictures.hpp"
#include "support/patch_views.hpp"
#include "support/temporary_folder.hpp"
#include "support/viewer_peer.hpp"

namespace panonav::server {
using namespace testing;
namespace {

std::string png_of(const Image& image) {
  const auto bytes = encode_png(image.view());
  return {bytes.begin(), bytes.end()};
}

std::string picture_at(const ToyWorld& world, const Pose2& pose) {
  return png_of(landmark_picture(world, pose));
}

void memorise(const std::filesystem::path& path, const ToyWorld& world, std::size_t from,
              std::size_t to) {
  Memoriser memoriser(path, {.source = landmark_panoramas()});
  const auto poses = grid_poses(8);
  for (std::size_t i = from; i < to; ++i) {
    Observation seen(landmark_picture(world, poses[i]));
    seen.name = "a view/" + std::to_string(i);
    seen.pose = ReferencePose{poses[i].x_m, poses[i].y_m, poses[i].heading_rad};
    memoriser.add(std::move(seen));
  }
  memoriser.finish();
}

/// A memory of 40 views of a world, learnt once, and a copy of it for each test.
class LocalisationServerTest : public ::testing::Test {
 protected:
  LocalisationServerTest() {
    static const TemporaryFolder learnt;
    if (!std::filesystem::exists(learnt / "hall.panonav")) {
      memorise(learnt / "hall.panonav", world_, 0, 40);
    }
    std::filesystem::copy(learnt / "hall.panonav", folder_ / "hall.panonav");
  }

  std::vector<ServedMemory> hall() const { return {{"hall", folder_ / "hall.panonav"}}; }

  static std::string get(const LocalisationServer& server, const std::string& path,
                         const std::string& more = "", const std::string& method = "GET",
                         const std::string& body = "") {
    return Peer(server.url() + "/").ask(path, more, method, body);
  }
  static json body_of(const std::string& answer) {
    return json::parse(answer.substr(std::min(answer.find("\r\n\r\n"), answer.size())));
  }
  std::string localise(const LocalisationServer& server, const std::string& picture,
                       const std::string& more = "") const {
    return get(server, "/v1/memories/hall/localise", more, "POST", picture);
  }

  const Clock::time_point started_ = Clock::now();
  const TemporaryFolder folder_;
  const ToyWorld world_ = landmark_world(5);
};

TEST_F(LocalisationServerTest, AnswersAsThePlaceRecogniserDoes) {
  const LocalisationServer server(hall(), {});
  const PlaceRecogniser recogniser(folder_ / "hall.panonav");
  for (const Pose2& pose : {Pose2{0.3, 0.8, 1.0}, Pose2{2.2, 1.1, -2.0}, Pose2{50.0, 60.0, 0.0}}) {
    const std::string picture = picture_at(world_, pose);
    nlohmann::ordered_json expected{{"memory", "hall"}};
    expected.update(place_json(recogniser.localise(decode_image(
        std::span(reinterpret_cast<const std::uint8_t*>(picture.data()), picture.size()), "it"))));
    const std::string answer = localise(server, picture);
    EXPECT_EQ(status_of(answer), 200);
    EXPECT_EQ(answer.substr(answer.find("\r\n\r\n") + 4), expected.dump() + "\n");
  }
}

TEST_F(LocalisationServerTest, AnswersNarrowPictures) {
  const auto path = folder_ / "rooms.panonav";
  Memoriser memoriser(
      path, {.source = PictureSource{.layout = {.elevations = patch_band}}, .narrow = true});
  for (std::uint64_t i = 0; i < 9; ++i) {
    Observation seen(make_patch_view(i));
    seen.name = "room " + std::to_string(i);
    seen.pose = ReferencePose{10.0 * static_cast<double>(i), 0.0, 0.0};
    memoriser.add(std::move(seen));
  }
  memoriser.finish();
  std::vector<ServedMemory> memories = hall();
  memories.push_back({"rooms", path});
  const LocalisationServer server(memories, {});
  const std::string photo = png_of(take_narrow_picture(make_patch_view(5), 1.5, radians(70.0)));
  const auto ask = [&](const std::string& memory_and_arguments) {
    return get(server, "/v1/memories/" + memory_and_arguments, "", "POST", photo);
  };
  const json answer = body_of(ask("rooms/localise?field_of_view_deg=70"));
  EXPECT_EQ(answer["matches"][0]["file"], "room 5");
  EXPECT_EQ(answer["matches"][0]["dissimilarity"], nullptr);
  EXPECT_NEAR(answer["heading_rad"].get<double>(), 1.5, radians(2.0));
  for (const auto& [refused, status] : {std::pair("rooms/localise?field_of_view_deg=exif", 422),
                                        std::pair("hall/localise?field_of_view_deg=70", 422),
                                        std::pair("rooms/localise?field_of_view_deg=170", 400),
                                        std::pair("rooms/localise?field_of_view_deg=", 400),
                                        std::pair("rooms/localise?width=70", 400)}) {
    EXPECT_EQ(status_of(ask(refused)), status) << refused;
  }
}

TEST_F(LocalisationServerTest, TellsWhatThereIs) {
  const LocalisationServer server(hall(), {});
  EXPECT_EQ(body_of(get(server, "/health")), json::parse(R"({"status": "ok"})"));
  const json listed = body_of(get(server, "/v1/memories"));
  ASSERT_EQ(listed["memories"].size(), 1U);
  EXPECT_EQ(listed["memories"][0]["name"], "hall");
  EXPECT_EQ(listed["memories"][0]["views"], 40);
  EXPECT_EQ(body_of(get(server, "/v1/memories/hall")), listed["memories"][0]);
  const std::string picture = get(server, "/v1/memories/hall/views/a%20view%2F7/picture");
  EXPECT_EQ(status_of(picture), 200);
  EXPECT_NE(picture.find("Content-Type: image/png\r\n"), std::string::npos);
  // A page of another origin does not get it as an image either, for which it sends no Origin.
  EXPECT_NE(picture.find("\r\nCross-Origin-Resource-Policy: same-origin\r\n"), std::string::npos);
  EXPECT_NE(picture.find("\r\nContent-Security-Policy: default-src 'none'"), std::string::npos);
  EXPECT_EQ(picture.substr(picture.find("\r\n\r\n") + 5, 3), "PNG");
  for (const std::string path :
       {"/v1/memories/hall/views/a view/picture", "/v1/memories/hall/views/%zz/picture",
        "/v1/memories/hall/views/%2/picture", "/v1/memories/hall/views//picture",
        "/v1/memories/hall/views/picture", "/v1/memories/cellar", "/v1/memories/", "/v1",
        "/v1/memories/hall/../hall", "/v1/memorieshall", "/v1/memories/hall/localise/"}) {
    const std::string answer = get(server, path);
    EXPECT_EQ(status_of(answer), 404) << path;
  }
  EXPECT_EQ(status_of(get(server, "/v1/memories/hall/localise")), 405);
  EXPECT_EQ(status_of(get(server, "/v1/memories", "", "DELETE")), 405);
}

TEST(UploadPage, EscapesNamesAndTellsTheAnswerInWords) {
  const std::vector<PageMemory> memories{{"a", 3}, {"b", 5}};
  const json answer{{"memory", "b"},
                    {"known", true},
                    {"known_probability", 0.874},
                    {"matches",
                     {{{"file", "<b>\"&' /%\xc3\xa9"}, {"dissimilarity", 5}, {"heading_rad", -0.5}},
                      {{"file", "next"}, {"dissimilarity", 9}, {"heading_rad", nullptr}}}},
                    {"position", {{"x_m", 1.5}, {"y_m", -2.0}, {"radius_m", nullptr}}},
                    {"heading_rad", nullptr}};
  const std::string page = make_upload_page(memories, "b", answer.dump());
  for (const auto* part :
       {"<h2>Known place</h2>", "<dd>87 %</dd>", "x 1.50 m, y -2.00 m</dd>",
        "29 degrees to the right", "/v1/memories/b/views/%3Cb%3E%22%26%27%20%2F%25%C3%A9/picture\"",
        "Most similar view: &lt;b&gt;&quot;&amp;&#39; /%\xc3\xa9</figcaption>",
        "similar views: next", "<option value=\"b\" selected>b, 5 views</option>",
        "accept=\"image/*\" capture"}) {
    EXPECT_TRUE(contains(page, part));
  }
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_EQ(page.find("http"), std::string::npos) << "no resource of another server";
  EXPECT_TRUE(
      contains(make_upload_page(memories, "a", "{\"error\": \"<i>\"}"), "<p>&lt;i&gt;</p>"));
  EXPECT_TRUE(contains(make_upload_page(memories, "a", "Busy.\n"), "<p>Busy."));
}

TEST(UploadPage, ReadsFormsAndRefusesEverythingElse) {
  const std::string kind = "multipart/form-data; boundary=xyz";
  const auto part = [](const std::string& head, const std::string& content) {
    return "--xyz\r\nContent-Disposition: form-data; " + head + "\r\n\r\n" + content + "\r\n";
  };
  const std::string whole = part("name=\"memory\"", "hall") +
                            part("name=\"image\"; filename=\"\"", "") +
                            part("name=\"image\"; filename=\"a; name=b\"", "a\r\n--xy\r\nb") +
                            part("name=\"image\"", "second") + "--xyz--\r\n";
  const auto form = read_upload_form(kind, whole);
  ASSERT_TRUE(form);
  EXPECT_EQ(form->memory, "hall");
  EXPECT_EQ(form->picture, "a\r\n--xy\r\nb") << "the first that is not empty";
  for (std::size_t length = 0; length + 4 < whole.size(); ++length) {
    EXPECT_FALSE(read_upload_form(kind, std::string_view(whole).substr(0, length))) << length;
  }
  EXPECT_FALSE(read_upload_form("multipart/form-data", whole));
  EXPECT_FALSE(read_upload_form("multipart/form-data; boundary=", whole));
  EXPECT_FALSE(read_upload_form("multipart/form-data; boundary=other", whole));
  EXPECT_FALSE(read_upload_form("text/plain; boundary=xyz", whole));
  EXPECT_FALSE(read_upload_form("multipart/form-data; boundary=" + std::string(71, 'x'), whole));
}

TEST_F(LocalisationServerTest, RefusesWhatIsNoPictureAndGoesOn) {
  const LocalisationServer server(hall(), {.threads = 1});
  const std::string good = picture_at(world_, {1.0, 1.0, 0.0});
  std::string large(2'000'000, 'x');
  for (const std::string& bad :
       {std::string("no image"), std::string(1, '\0'), good.substr(0, good.size() / 2),
        "\x89PNG\r\n\x1a\n" + std::string(100, '\xff'), large}) {
    const std::string answer = localise(server, bad);
    EXPECT_EQ(status_of(answer), 422);
    EXPECT_FALSE(body_of(answer)["error"].get<std::string>().empty());
  }
  // A picture of another shape does not fit the memory.
  EXPECT_EQ(status_of(localise(server, png_of(Image(50, 40, 1)))), 422);
  EXPECT_EQ(status_of(get(server, "/v1/memories/hall/localise", "", "POST")), 422);
  EXPECT_EQ(status_of(localise(server, good)), 200);
  const std::string metrics = get(server, "/metrics");
  EXPECT_NE(metrics.find("\npanonav_refused_total{status=\"422\"} 7\n"), std::string::npos);
  EXPECT_NE(metrics.find("{memory=\"hall\",answer=\"known\"} 1\n"), std::string::npos);
  EXPECT_NE(metrics.find("\npanonav_localisation_seconds_bucket{le=\"+Inf\"} 1\n"),
            std::string::npos);
  EXPECT_NE(metrics.find("\npanonav_memory_views{memory=\"hall\"} 40\n"), std::string::npos);
  Peer peer(server.url() + "/");
  peer.say("POST /v1/memories/hall/localise HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
           std::to_string((16 << 20) + 1) + "\r\n\r\n");
  EXPECT_EQ(status_of(peer.hear_all()), 413);
}

TEST_F(LocalisationServerTest, LetsAClientAskBeforeItSendsAPicture) {
  const LocalisationServer server(hall(), {});
  const std::string picture = picture_at(world_, {1.0, 1.0, 0.0});
  Peer peer(server.url() + "/");
  for (int times = 0; times < 2; ++times) {  // over one connection
    peer.say("POST /v1/memories/hall/localise HTTP/1.1\r\nHost: localhost\r\nExpect: " +
             std::string("100-continue\r\nContent-Length: ") + std::to_string(picture.size()) +
             "\r\n\r\n");
    ASSERT_TRUE(peer.hear_until("HTTP/1.1 100 Continue\r\n\r\n"));
    peer.say(picture);
    ASSERT_TRUE(peer.hear_until("\"memory\":\"hall\""));
    ASSERT_TRUE(peer.hear_until("}\n"));
    peer.forget();
  }
}

TEST_F(LocalisationServerTest, ManyClientsAtOnceGetTheirOwnAnswers) {
  const LocalisationServer server(hall(), {.threads = 2});
  const auto poses = grid_poses(8);
  std::vector<std::string> names(24);
  std::vector<std::thread> clients;
  for (std::size_t i = 0; i < names.size(); ++i) {
    clients.emplace_back([&, i] {
      const std::string answer = localise(server, picture_at(world_, poses[i]));
      if (status_of(answer) == 200) names[i] = body_of(answer)["matches"][0]["file"];
    });
  }
  for (std::thread& client : clients) client.join();
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(names[i], "a view/" + std::to_string(i));
}

TEST_F(LocalisationServerTest, TheQueueIsBoundedAndWhoHasGoneIsNotAnswered) {
  // One thread is kept busy by large pictures, whose decoding takes a while.
  const LocalisationServer server(hall(), {.threads = 1, .max_waiting = 2});
  const std::string slow = png_of(Image(4096, 512, 3));
  const std::string head =
      "POST /v1/memories/hall/localise HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
      std::to_string(slow.size()) + "\r\n\r\n";
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < 20; ++i) {
    peers.push_back(std::make_unique<Peer>(server.url() + "/"));
    peers.back()->say(head + slow);
  }
  int busy = 0;
  int answered = 0;
  for (std::size_t i = 0; i < peers.size(); ++i) {
    if (i % 4 == 3) continue;  // these go without an answer
    ASSERT_TRUE(peers[i]->hear_until("}\n"));
    const int status = status_of(peers[i]->heard());
    busy += status == 503 ? 1 : 0;
    answered += status == 422 ? 1 : 0;  // they do not fit the memory
  }
  EXPECT_EQ(busy + answered, 15);
  EXPECT_GE(answered, 1);
  peers.clear();
  EXPECT_EQ(status_of(localise(server, picture_at(world_, {1.0, 1.0, 0.0}))), 200);
}

TEST_F(LocalisationServerTest, AsksForTheTokenWhereThereIsOne) {
  const LocalisationServer server(hall(), {.token = "0123456789abcdef"});
  EXPECT_EQ(status_of(get(server, "/health")), 200);  // for load balancers
  for (const std::string more :
       {"", "Authorization: Bearer 0123456789abcdee\r\n", "Authorization: 0123456789abcdef\r\n",
        "Authorization: Bearer \r\n", "Authorization: Basic 0123456789abcdef\r\n"}) {
    EXPECT_EQ(status_of(get(server, "/v1/memories", more)), 401) << more;
    EXPECT_EQ(status_of(get(server, "/metrics", more)), 401) << more;
    EXPECT_EQ(status_of(localise(server, "x", more)), 401) << more;
  }
  const std::string token = "Authorization: Bearer 0123456789abcdef\r\n";
  EXPECT_EQ(status_of(get(server, "/v1/memories", token)), 200);
  // Then a proxy may call it by any name.
  Peer peer(server.url() + "/");
  peer.say("GET /v1/memories HTTP/1.1\r\nHost: panonav.example\r\n" + token +
           "Connection: close\r\n\r\n");
  EXPECT_EQ(status_of(peer.hear_all()), 200);
}

TEST_F(LocalisationServerTest, WithoutATokenPagesOfOthersGetNothing) {
  const LocalisationServer server(hall(), {});
  const auto answer = [&](const std::string& host, const std::string& origin) {
    Peer peer(server.url() + "/");
    peer.say("GET /v1/memories HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n" +
             (origin.empty() ? "" : "Origin: " + origin + "\r\n") + "\r\n");
    return status_of(peer.hear_all());
  };
  EXPECT_EQ(answer("localhost", ""), 200);
  EXPECT_EQ(answer("localhost", "http://localhost"), 200);
  EXPECT_EQ(answer("localhost", "http://example.com"), 403);
  EXPECT_EQ(answer("example.com", ""), 403);
}

TEST_F(LocalisationServerTest, StrangersGetTheirAnswerOnTheHeadAndHoldNobodyUp) {
  const LocalisationServer server(hall(), {.token = "0123456789abcdef"});
  const std::string token = "Authorization: Bearer 0123456789abcdef\r\n";
  Peer client(server.url() + "/");
  const auto asks_again = [&] {
    client.say("GET /v1/memories HTTP/1.1\r\nHost: localhost\r\n" + token + "\r\n");
    const bool answered = client.hear_until("]}\n");
    client.forget();
    return answered;
  };
  EXPECT_TRUE(asks_again());
  std::vector<std::unique_ptr<Peer>> strangers;
  for (int i = 0; i < 300; ++i) {
    strangers.push_back(std::make_unique<Peer>(server.url() + "/"));
    ASSERT_TRUE(strangers.back()->connected());
    if (i % 3 == 0) {  // announces a picture and sends none
      strangers.back()->say(
          "POST /v1/memories/hall/localise HTTP/1.1\r\nHost: localhost\r\n"
          "Content-Length: 16000000\r\n\r\n");
      ASSERT_EQ(status_of(strangers.back()->hear_all()), 401);
    } else if (i % 3 == 1) {  // stays after a question that everybody may ask
      strangers.back()->say("GET /health HTTP/1.1\r\nHost: localhost\r\n\r\n");
      ASSERT_TRUE(strangers.back()->hear_until("\"ok\"")) << i;
    }
  }
  EXPECT_EQ(status_of(localise(server, picture_at(world_, {1.0, 1.0, 0.0}), token)), 200);
  EXPECT_TRUE(asks_again());
}

TEST_F(LocalisationServerTest, BodiesThatDoNotComeHoldNobodyUp) {
  const LocalisationServer server(hall(), {});
  const std::string head =
      "POST /v1/memories/hall/localise HTTP/1.1\r\nHost: localhost\r\n"
      "Content-Length: 16000000\r\n\r\n";
  std::vector<std::unique_ptr<Peer>> slow;
  for (int i = 0; i < 8; ++i) {
    slow.push_back(std::make_unique<Peer>(server.url() + "/"));
    slow.back()->say(head + std::string(i < 4 ? 0 : 1'000'000, 'x'));
  }
  EXPECT_EQ(status_of(localise(server, picture_at(world_, {1.0, 1.0, 0.0}))), 200);
  // A byte now and then does not keep a connection, however much came before.
  for (const auto& peer : slow) {
    while (peer->say("x") && Clock::now() < started_ + patience) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    EXPECT_LT(Clock::now(), started_ + std::chrono::seconds(60));
  }
}

TEST_F(LocalisationServerTest, OpenServersLetTheLongestIdleGoFirst) {
  const LocalisationServer server(hall(), {});
  std::vector<std::unique_ptr<Peer>> idle;
  for (int i = 0; i < 260; ++i) {
    idle.push_back(std::make_unique<Peer>(server.url() + "/"));
    idle.back()->say("GET /v1/memories HTTP/1.1\r\nHost: localhost\r\n\r\n");
    ASSERT_TRUE(idle.back()->hear_until("]}\n")) << i;
  }
  EXPECT_FALSE(idle.front()->hear());
  idle.back()->forget();
  idle.back()->say("GET /v1/memories HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_TRUE(idle.back()->hear_until("]}\n"));
}

TEST_F(LocalisationServerTest, RefusesHeadsThatOthersWouldReadInAnotherWay) {
  const LocalisationServer server(hall(), {});
  const auto answer = [&](const std::string& head) {
    Peer peer(server.url() + "/");
    peer.say(head);
    return status_of(peer.hear_all());
  };
  const std::string line = "GET /health HTTP/1.1\r\n";
  const std::string last = "Connection: close\r\n\r\n";
  for (const std::string& good :
       {line + "Host: localhost\r\nX: 1\r\n" + last,
        line + "Host:localhost\r\nX:\t 1 \t\r\n" + last,
        line + "Host: localhost\r\nX:\r\nx-y_z: \xff\r\nCookie: a=b; c=d\r\n" + last,
        line + "Host: localhost\r\nX: " + std::string(5000, 'x') + "\r\n" + last,
        line + "Host: localhost\r\n\r\n" + line + "Host: localhost\r\n" + last,
        "GET /health?a=b HTTP/1.1\r\nHost: localhost\r\n" + last}) {
    EXPECT_EQ(answer(good), 200) << good;
  }
  for (const std::string& bad :
       {line + "Host : localhost\r\n\r\n", line + "Host\t: localhost\r\n\r\n",
        line + "Host: localhost\r\nX-A : 1\r\n\r\n",
        line + "Host: localhost\r\nContent-Length : 0\r\n\r\n",
        line + "Host: localhost\r\nX(A): 1\r\n\r\n", line + "Host: localhost\r\n: 1\r\n\r\n",
        line + "Host: localhost\r\n X: 1\r\n\r\n",
        line + "Host: localhost\r\nX: 1\r\n folded\r\n\r\n",
        line + "Host: localhost\r\nX: 1\r\n\tfolded\r\n\r\n",
        line + "Host: localhost\nX: 1\r\n\r\n", line + "Host: localhost\r\nX: 1\n\r\n",
        line + "Host: localhost\r\nX: 1\r\n\n", line + "Host: localhost\r\nX: a\rb\r\n\r\n",
        std::string("GET /health HTTP/1.1\nHost: localhost\r\n\r\n"),
        std::string("GET /health HTTP/1.1\nHost: localhost\n\n")}) {
    EXPECT_EQ(answer(bad), 400) << bad;
  }
}

TEST_F(LocalisationServerTest, ReadsAChangedMemoryAgain) {
  std::vector<std::string> notes;
  std::mutex mutex;
  const LocalisationServer server(hall(), {.poll_interval = std::chrono::milliseconds(20),
                                           .note = [&](const std::string& line) {
                                             const std::lock_guard lock(mutex);
                                             notes.push_back(line);
                                           }});
  const auto views = [&] { return body_of(get(server, "/v1/memories/hall"))["views"]; };
  EXPECT_EQ(views(), 40);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  {
    const std::lock_guard lock(mutex);
    EXPECT_TRUE(notes.empty()) << notes.front();  // nobody changed it
  }
  memorise(folder_ / "hall.panonav", world_, 40, 64);
  EXPECT_TRUE(soon([&] { return views() == 64; }));
  // A memory that can no longer be read is served as it was.
  std::filesystem::remove(folder_ / "hall.panonav");
  std::ofstream(folder_ / "hall.panonav") << "no memory";
  EXPECT_TRUE(soon([&] {
    const std::lock_guard lock(mutex);
    return !notes.empty() && notes.back().find("cannot be read") != std::string::npos;
  }));
  EXPECT_EQ(views(), 64);
  EXPECT_EQ(status_of(localise(server, picture_at(world_, {1.0, 1.0, 0.0}))), 200);
}

TEST_F(LocalisationServerTest, RefusesOptionsOutOfRange) {
  const auto path = folder_ / "hall.panonav";
  EXPECT_THROW(LocalisationServer({}, {}), ContractError);
  for (const std::string name : {"", "a/b", "a b", "\"", "ä"}) {
    const std::vector<ServedMemory> memories{{name, path}};
    EXPECT_THROW(LocalisationServer(memories, {}), ContractError) << name;
  }
  const std::vector<ServedMemory> twice{{"a", path}, {"a", path}};
  EXPECT_THROW(LocalisationServer(twice, {}), ContractError);
  const std::vector<ServedMemory> missing{{"a", folder_ / "none.panonav"}};
  EXPECT_THROW(LocalisationServer(missing, {}), FileError);
  EXPECT_THROW(LocalisationServer(hall(), {.max_waiting = 0}), ContractError);
  EXPECT_THROW(LocalisationServer(hall(), {.threads = -1}), ContractError);
  EXPECT_THROW(LocalisationServer(hall(), {.port = 65536}), ContractError);
}

TEST_F(LocalisationServerTest, WhoWaitsAtTheEndIsAnswered) {
  std::optional<Peer> peer;
  {
    const LocalisationServer server(hall(), {.threads = 1});
    peer.emplace(server.url() + "/");
    const std::string picture = picture_at(world_, {1.0, 1.0, 0.0});
    peer->say("POST /v1/memories/hall/localise HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
              std::to_string(picture.size()) + "\r\n\r\n" + picture);
    ASSERT_TRUE(soon([&] {
      return get(server, "/metrics").find("panonav_waiting_seconds_count 1\n") != std::string::npos;
    }));
  }
  EXPECT_EQ(status_of(peer->hear_all()), 200);
}

}  // namespace
}  // namespace panonav::server
