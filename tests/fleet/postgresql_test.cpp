// Memories on a PostgreSQL server, whose address is PANONAV_TEST_SERVER
// (tests/fleet/test_server.py starts one); addresses of servers.
#include <gtest/gtest.h>

#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_fleet/memory_changes.hpp"
#include "support/memory_samples.hpp"

namespace panonav::fleet {
using namespace testing;
using nlohmann::json;
namespace {

TEST(MemoryAddress, AddressesAreToldFromPaths) {
  EXPECT_TRUE(is_server_address("postgresql://host/db?memory=m"));
  EXPECT_TRUE(is_server_address("postgres:///db?memory=m"));
  EXPECT_FALSE(is_server_address("postgresql"));
  EXPECT_FALSE(is_server_address("folder/postgresql://host"));
  EXPECT_FALSE(memory_exists("no_such_folder/m.panonav"));
  EXPECT_EQ(memory_name("folder/m.panonav"), "m.panonav");
  EXPECT_EQ(memory_name("postgresql:///db?host=/a/b&memory=the%20hall&sslmode=require"),
            "the hall");
}

TEST(MemoryAddress, PasswordsAreNotShown) {
  EXPECT_EQ(mask_passwords("postgresql://u:secret@h:5/d?memory=m"),
            "postgresql://u:***@h:5/d?memory=m");
  EXPECT_EQ(mask_passwords("to postgres://u:se/cr@et@h/d and postgresql://h/d?password=secret&a=1"),
            "to postgres://u:***@h/d and postgresql://h/d?password=***&a=1");
  for (const char* plain : {"", "a:b@c", "postgresql://h:5432/d?memory=m", "postgresql://u@h/d",
                            "rtsp://camera:554/stream?profile=1", "? token=1 in http://h/"}) {
    EXPECT_EQ(mask_passwords(plain), plain);
    EXPECT_EQ(mask_credentials(plain), plain);
  }
  for (const char* plain : {"serving at http://127.0.0.1:80; Ctrl-C ends it",
                            "\033[1mat http://127.0.0.1:80\033[0m", "http://h:80: away"}) {
    EXPECT_EQ(mask_passwords(plain), plain);
  }
  EXPECT_EQ(mask_passwords("at rtsp://root:secret@10.0.0.7:554/main, again"),
            "at rtsp://root:***@10.0.0.7:554/main, again");
  EXPECT_EQ(mask_credentials("http://10.0.0.7/video.cgi?User=root&Pwd=se'c r@et&size=1"),
            "http://10.0.0.7/video.cgi?User=root&Pwd=***&size=1");
  EXPECT_EQ(mask_credentials("postgresql://h:5/d?password=a@secret"), "postgresql://h:***");
  // Whatever was not escaped in an address that is known.
  for (const std::string secret : {"se cret", "'secret", "a\"secret", "a\\secret", "a\tsecret",
                                   "\xff secret", "secret&x secret", "a' \"b secret"}) {
    const std::string address = "rtsp://root:" + secret + "@h/1";
    remember_address(address);
    for (const std::string& text :
         {address, json(address).dump(-1, ' ', false, json::error_handler_t::replace),
          "'" + address + "'", std::string(FileError(address, "does not exist").what()),
          to_readable_line(address)}) {
      const std::string shown = mask_passwords("x " + text + " y");
      EXPECT_EQ(shown.find("secret"), std::string::npos) << shown;
      EXPECT_NE(shown.find("rtsp://root:***@h/1"), std::string::npos) << shown;
    }
    const std::string message = message_of<FileError>([&] {
      static_cast<void>(MemoryFile::open("postgresql://u:" + secret + "@127.0.0.1:1/d?memory=m",
                                         Access::read_only));
    });
    EXPECT_EQ(message.find("secret"), std::string::npos) << message;
  }
}

TEST(MemoryAddress, WrongOnesAreRefusedInOneLine) {
  for (const char* wrong :
       {"postgresql://u:secret@h/d", "postgresql://u:secret@h/d?memory=",
        "postgres://u:secret@h?memory=%0A", "postgresql://u:secret@h/d?memory=%4",
        "postgresql://u:secret@h/d?memory=m&robot=", "postgresql://u:secret/a@h/d?memory=m",
        "postgresql://u:a/secret@h/d?memory=m", "postgresql://u:1?secret@h/d?memory=m",
        "postgresql://u:1/secret@h/d?memory=m", "postgresql://u:a@secret@h/d?memory=m",
        "postgresql://h:secret/d?memory=m"}) {
    const std::string message = message_of<FileError>(
        [&] { static_cast<void>(MemoryFile::open(wrong, Access::read_only)); });
    EXPECT_TRUE(contains(message, "allowed")) << message;
    EXPECT_EQ(message.find("secret"), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

class MemoryOnServer : public MemoryFileTest {
 protected:
  void SetUp() override {
    if (std::getenv("PANONAV_TEST_SERVER") == nullptr) GTEST_SKIP() << "no PANONAV_TEST_SERVER";
  }
};

std::vector<NewView> random_views(int first, int count) {
  Random random(static_cast<std::uint64_t>(first) + 1);
  std::vector<NewView> views;
  for (int i = first; i < first + count; ++i) {
    views.push_back(random_view(random, small_header().shape, i));
    if (i % 5 == 0) views.back().features = {4, 5, static_cast<std::uint8_t>(i % 256)};
  }
  return views;
}

TEST_F(MemoryOnServer, CopiesAreTheSameThereAndBack) {
  MemoryFile file = MemoryFile::create(folder / "first.panonav", small_header());
  const std::vector<ViewId> ids = file.append(random_views(0, 1500));
  file.remove(std::vector{ids[3], ids[700]});
  file.rename(ids[8], "floor=attic/stairs");
  file.link(std::vector<Link>{{ids[1], ids[2], Link::Kind::sequence},
                              {ids[9], ids[4], Link::Kind::closure}});
  file.set_parameter("a 'name'; DROP TABLE panonav.views; --", "1.5");
  RoutePanorama route(16);
  for (int i = 0; i < 600; ++i) {
    (void)route.append({0.1 * i, 0.0, -0.0},
                       std::vector<std::uint8_t>(16, static_cast<std::uint8_t>(i)));
  }
  file.append_route("way", route);
  TopologicalMap map;
  for (const std::size_t i : {1U, 2U, 5U})
    map.nodes.push_back({ids[i], {0.5 * static_cast<double>(i), -0.0, 0.0}});
  file.save_map("map", map);
  file.copy_to(path);
  MemoryFile::open(path, Access::read_only).copy_to(folder / "second.panonav");
  EXPECT_THROW(file.copy_to(path), FileError);
  for (const auto& copy : {path, folder / "second.panonav"}) {
    const MemoryFile other = MemoryFile::open(copy, Access::read_only);
    EXPECT_EQ(other.header(), file.header());
    EXPECT_TRUE(same_content(other.load(), file.load()));
    EXPECT_EQ(other.names(), file.names());
    EXPECT_EQ(other.places(), file.places());
    EXPECT_EQ(other.views_with_thumbnail(), file.views_with_thumbnail());
    EXPECT_EQ(other.thumbnail(ids[4]), file.thumbnail(ids[4]));
    EXPECT_EQ(other.features(ids[5]), file.features(ids[5]));
    EXPECT_EQ(other.parameter("a 'name'; DROP TABLE panonav.views; --"), "1.5");
    EXPECT_EQ(other.map("map"), file.map("map"));
    EXPECT_EQ(other.route("way"), file.route("way"));
    const PositionBounds bounds{-1.0, 2.0, -0.5, 3.0};
    EXPECT_EQ(other.views_within(bounds), file.views_within(bounds));
    EXPECT_GT(other.views_within(bounds).size(), 20U);
    EXPECT_TRUE(other.verify().empty());
  }
}

TEST_F(MemoryOnServer, ATrackerHoldsOnlyMemoriesThatAreSmallEnough) {
  MemoryFile file = MemoryFile::create(path, small_header());
  file.append(random_views(0, 60));
  const Tracker held(path);
  const Tracker searched(path, {.max_held_views = 59});
  EXPECT_TRUE(held.is_memory_held());
  EXPECT_FALSE(searched.is_memory_held());
  EXPECT_EQ(searched.localiser().model(), held.localiser().model());
  EXPECT_EQ(searched.localiser().particles().x_m, held.localiser().particles().x_m);
  EXPECT_EQ(searched.index()->posed_views().size(), 40U);
}

TEST_F(MemoryOnServer, StatementsInNamesAreNames) {
  MemoryFile file = MemoryFile::create(path, small_header());
  Random random(1);
  const std::vector<std::string> names{"'; DROP SCHEMA panonav CASCADE; --", "\\'\"$1$$%s",
                                       "\xc3\xa4 \t\\N"};
  for (const std::string& name : names) {
    NewView view = random_view(random, small_header().shape, 4);
    view.info.name = name;
    const ViewId id = file.append(view);
    EXPECT_EQ(file.find(name), id);
    RoutePanorama route(16);
    (void)route.append({}, std::vector<std::uint8_t>(16));
    file.append_route(name, route);
    file.save_map(name, TopologicalMap{{{id, {}}}, {}});
    file.set_parameter(name, name);
    EXPECT_EQ(file.parameter(name), name);
  }
  EXPECT_EQ(file.names(), names);
  EXPECT_EQ(file.map_names().size(), names.size());
  EXPECT_EQ(file.route_names(), file.map_names());
  const auto again = random_views(0, 1);
  const std::string duplicate = message_of<ContractError>([&] {
    NewView view = again[0];
    view.info.name = names[0];
    file.append(std::vector{again[0], view});
  });
  EXPECT_TRUE(contains(duplicate, names[0])) << duplicate;
  EXPECT_EQ(file.names(), names);
  // Text that the server cannot hold is refused, and nothing is left of it.
  NewView wrong = random_view(random, small_header().shape, 4);
  wrong.info.name = "\xff";
  const std::string message = message_of<FileError>([&] { file.append(wrong); });
  EXPECT_TRUE(contains(message, "invalid byte sequence")) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos);
  EXPECT_EQ(file.append(again[0]).value, names.size() + 1);
  EXPECT_TRUE(file.verify().empty());
}

TEST_F(MemoryOnServer, ChangesAreToldWithTheirAreas) {
  MemoryFile file = MemoryFile::create(path, small_header());
  MemoryChanges changes(path);
  EXPECT_FALSE(changes.wait(std::chrono::milliseconds(0)));
  NewView view = random_views(1, 1)[0];
  view.info.pose = ReferencePose{-0.5, 25.0, {}};
  const ViewId id = file.append(view);
  const auto added = changes.wait(std::chrono::seconds(20));
  ASSERT_TRUE(added);
  EXPECT_EQ(added->areas, (std::vector<MemoryArea>{{-1.0, 2.0}}));
  file.set_pose(id, ReferencePose{31.0, 5.0, {}});
  EXPECT_EQ(changes.wait(std::chrono::seconds(20))->areas,
            (std::vector<MemoryArea>{{-1.0, 2.0}, {3.0, 0.0}}));
  EXPECT_THROW(file.change([&] {
    file.remove(std::vector{id});
    throw FileError("a", "b");
  }),
               FileError);
  // A view without a position lies in no area, beside one that does.
  std::vector<NewView> two = random_views(3, 2);
  two[0].info.pose.reset();
  two[1].info.pose = ReferencePose{1.0, 1.0, {}};
  file.append(two);
  EXPECT_TRUE(changes.wait(std::chrono::seconds(20)).value().areas.empty());
  file.set_parameter("a", "b");
  EXPECT_TRUE(changes.wait(std::chrono::seconds(20))->areas.empty());
  EXPECT_THROW(MemoryChanges(folder / "m.panonav"), FileError);
}

// Reports each batch once it is acknowledged, for test_server.py to count, until the server is
// gone.
TEST_F(MemoryOnServer, AppendsUntilTheServerIsGone) {
  const char* memory = std::getenv("PANONAV_TEST_APPEND");
  if (memory == nullptr) GTEST_SKIP() << "no PANONAV_TEST_APPEND";
  MemoryFile file = MemoryFile::create(memory, small_header());
  const std::string message = message_of<FileError>([&] {
    for (int batch = 0; batch < 100000; ++batch) {
      const auto views = random_views(20 * batch, 20);
      file.append(views);
      std::cout << "acknowledged " << 20 * (batch + 1) << std::endl;
    }
  });
  EXPECT_EQ(message.find('\n'), std::string::npos);
  EXPECT_TRUE(contains(message, "lost the connection to its server"));
  EXPECT_THROW(file.append(random_views(0, 1)), FileError);  // and nothing worse
}

}  // namespace
}  // namespace panonav::fleet
