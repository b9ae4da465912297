#include "panonav/storage/memory_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <thread>

#include "panonav/core/error.hpp"
#include "panonav/mapping/topological_map.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/route/route_panorama.hpp"
#include "support/memory_samples.hpp"
#include "support/temporary_folder.hpp"
#include "support/test_cameras.hpp"

namespace panonav::testing {
namespace {

using MemoryFileContent = MemoryFileTest;

TEST_F(MemoryFileContent, HeadersComeBack) {
  MemoryHeader plain = small_header();
  plain.created_s.reset();
  MemoryHeader picture = small_header();
  picture.source.kind = PictureKind::equirectangular;
  picture.source.layout.direction = ColumnDirection::counter_clockwise;
  picture.source.layout.forward_column = 0.25;
  picture.source.layout.elevations = ElevationBand{-1.5, 1.5};
  picture.source.layout.kept_elevations = ElevationBand{-0.5, 0.7};
  picture.elevations = ElevationBand{-0.5, 0.7};
  MemoryHeader resampled = small_header();
  resampled.picture_shape = PanoramaShape{37, 720};
  std::vector<MemoryHeader> headers{plain, picture, resampled, mirror_header()};
  for (const CameraModel& model :
       {CameraModel(HyperboloidalModel{}), CameraModel(UnifiedModel{0.9, 200.0}),
        CameraModel(UnifiedModel{0.9, 200.0, UnifiedModel::Axis::up}),
        CameraModel(FisheyeModel{20.0, 0.01, 0.0, 0.0, 0.0, 1.7, UnifiedModel::Axis::up}),
        CameraModel(EquiangularModel{-0.9, 0.4})}) {
    headers.push_back(mirror_header());
    headers.back().source.camera->model = model;
    if (std::holds_alternative<UnifiedModel>(model)) {
      headers.back().source.camera->has_assumed_elevations = true;
      headers.back().source.camera->affine = {1.01, 0.0, -0.002};
      headers.back().source.camera->distortion = {0.01, 0.0, 1e-3, 0.0, 0.0};
    }
    headers.back().source.mask.reset();
  }
  headers.push_back(mirror_header());
  headers.back().source.camera = dual_fisheye_camera();
  headers.back().source.mask.reset();
  headers.push_back(headers.back());
  headers.back().source.camera = rig_camera(4);
  int number = 0;
  for (const MemoryHeader& header : headers) {
    const auto path = memory("m" + std::to_string(number++) + ".panonav");
    EXPECT_EQ(MemoryFile::create(path, header).header(), header);
    EXPECT_EQ(MemoryFile::open(path, Access::read_only).header(), header);
  }
}

TEST_F(MemoryFileContent, ContentComesBack) {
  const auto path = memory("a b%20?#.panonav");
  const MemoryHeader header = mirror_header();
  VisualMemory expected(header.shape, header.full_scale, header.elevations);
  Random random(1);
  {
    MemoryFile file = MemoryFile::create(path, header);
    EXPECT_TRUE(file.load().empty());
    for (int number = 0; number < 50; ++number) {
      const NewView view = random_view(random, header.shape, number);
      const ViewId id = file.append(view);
      expected.append_with_id(id, view.signature, view.info);
    }
    const auto views = expected.views();
    const std::vector<Link> links{{views[0], views[1], Link::Kind::sequence},
                                  {views[1], views[7], Link::Kind::closure},
                                  {views[2], views[3], Link::Kind::neighbour}};
    file.link(links);
    for (const Link& link : links) expected.link(link);
    EXPECT_TRUE(same_content(file.load(), expected));
  }
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  ASSERT_EQ(expected.size(), 50U);
  EXPECT_TRUE(same_content(file.load(), expected));
  EXPECT_TRUE(file.verify().empty());

  const std::vector<ViewId> views(expected.views().begin(), expected.views().end());
  const ReferencePose pose{1.25, -3.5, 0.75};
  file.set_pose(views[0], pose);
  expected.set_pose(views[0], pose);
  file.set_pose(views[1], std::nullopt);
  expected.set_pose(views[1], std::nullopt);
  const std::vector<ViewId> gone{views[7], views[49]};
  file.remove(gone);
  for (const ViewId view : gone) expected.remove(view);
  file.unlink(views[3], views[2]);
  expected.unlink(views[2], views[3]);
  EXPECT_EQ(expected.links().size(), 1U);
  EXPECT_TRUE(same_content(file.load(), expected));
  EXPECT_TRUE(file.verify().empty());

  EXPECT_EQ(file.thumbnail(views[4]), (std::vector<std::uint8_t>{1, 2, 3, 4}));
  EXPECT_EQ(file.thumbnail(views[5]), std::nullopt);
  EXPECT_EQ(file.find("view_3.png"), views[3]);
  EXPECT_EQ(file.find("view_7.png"), std::nullopt);
  EXPECT_EQ(file.names().size(), 48U);
  EXPECT_EQ(file.names().front(), "view_0.png");
  const MemoryFile::Info info = file.info();
  EXPECT_EQ(info.views, 48U);
  EXPECT_EQ(info.links, 1U);
  EXPECT_EQ(info.thumbnails, 13U);
  EXPECT_GT(info.file_bytes, 50 * 2 * header.shape.size());
  EXPECT_EQ(info.format_version, 1);
  EXPECT_EQ(file.counts(), (MemoryFile::Counts{info.views, info.views_with_position,
                                               info.views_with_heading, info.file_bytes}));
  std::uint64_t positions = 0;
  std::uint64_t headings = 0;
  for (const ViewId view : expected.views()) {
    const auto& known = expected.info(view).pose;
    positions += known.has_value();
    headings += known && known->heading_rad;
  }
  EXPECT_EQ(info.views_with_position, positions);
  EXPECT_EQ(info.views_with_heading, headings);
}

TEST_F(MemoryFileContent, IdsAreNeverUsedTwice) {
  Random random(2);
  const SignatureShape shape = small_header().shape;
  ViewId last;
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    file.append(random_view(random, shape, 0));
    last = file.append(random_view(random, shape, 1));
    file.remove(std::span(&last, 1));
  }
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  // The name is free again, the id is not.
  EXPECT_GT(file.append(random_view(random, shape, 1)), last);
}

TEST_F(MemoryFileContent, ParametersAreKept) {
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    EXPECT_EQ(file.parameter("unknown place"), std::nullopt);
    file.set_parameter("unknown place", "{\"a\": 1}");
    file.set_parameter("unknown place", "{\"a\": 2}");
  }
  const MemoryFile file = MemoryFile::open(path, Access::read_only);
  EXPECT_EQ(file.parameter("unknown place"), "{\"a\": 2}");
  EXPECT_EQ(file.header(), small_header());
}

TEST_F(MemoryFileContent, ABadViewChangesNothing) {
  Random random(3);
  const SignatureShape shape = small_header().shape;
  MemoryFile file = MemoryFile::create(path, small_header());
  file.append(random_view(random, shape, 1));
  const VisualMemory before = file.load();
  ASSERT_EQ(before.size(), 1U);

  const auto refused = [&](NewView view, std::string_view part) {
    const std::vector<NewView> views{random_view(random, shape, 100), std::move(view)};
    const std::string message = message_of<ContractError>([&] { file.append(views); });
    EXPECT_TRUE(contains(message, part));
    EXPECT_TRUE(same_content(file.load(), before));
  };
  refused(random_view(random, shape, 1), "\"view_1.png\"");
  refused(random_view(random, {7, 4}, 2), "7 rows x 4 components; allowed: 7 rows x 5 components");
  NewView view = random_view(random, shape, 1);
  view.info.name.clear();
  refused(view, "view name");
  view = random_view(random, shape, 4);
  view.info.pose->x_m = std::numeric_limits<double>::quiet_NaN();
  refused(view, "pose x_m is nan");
  view = random_view(random, shape, 2);
  view.info.stamp_s = std::numeric_limits<double>::infinity();
  refused(view, "stamp_s is inf");

  const ViewId id = before.views()[0];
  const ViewId unknown{77};
  EXPECT_THROW(file.remove(std::vector{id, unknown}), ContractError);
  EXPECT_THROW(file.set_pose(unknown, std::nullopt), ContractError);
  EXPECT_THROW(file.link(std::vector{Link{id, unknown, Link::Kind::closure}}), ContractError);
  EXPECT_THROW(file.link(std::vector{Link{id, id, Link::Kind::closure}}), ContractError);
  EXPECT_THROW((void)file.thumbnail(unknown), ContractError);
  EXPECT_TRUE(same_content(file.load(), before));
}

TEST_F(MemoryFileContent, ImpossibleHeadersAreRefused) {
  const auto refused = [&](const MemoryHeader& header) {
    EXPECT_THROW(MemoryFile::create(path, header), Error);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  };
  MemoryHeader header = small_header();
  header.shape.rows = 0;
  refused(header);
  header = small_header();
  header.full_scale = 0.0F;
  refused(header);
  header = small_header();
  header.source.kind = PictureKind::mirror;
  refused(header);
  header = mirror_header();
  header.source.kind = PictureKind::panorama;
  refused(header);
  header = mirror_header();
  header.source.mask = Image(3, 3);
  refused(header);
  header = small_header();
  header.elevations = ElevationBand{0.5, 0.5};
  refused(header);
  header = small_header();
  header.panorama_columns = 9;
  refused(header);
  header = small_header();
  header.picture_shape = PanoramaShape{0, 720};
  refused(header);
  header = mirror_header();
  header.picture_shape = PanoramaShape{80, 720};
  refused(header);
}

TEST_F(MemoryFileContent, CreateNeverReplaces) {
  const auto path = folder.write("m.panonav", "something else");
  EXPECT_TRUE(contains(message_of<FileError>([&] { MemoryFile::create(path, small_header()); }),
                       "already exists"));
  EXPECT_EQ(std::filesystem::file_size(path), 14U);
  EXPECT_THROW(MemoryFile::create(folder / "no" / "m.panonav", small_header()), FileError);
}

TEST_F(MemoryFileContent, NothingIsLeftBesideAClosedFile) {
  Random random(4);
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    file.append(random_view(random, small_header().shape, 0));
  }
  { (void)MemoryFile::open(path, Access::read_only).load(); }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST_F(MemoryFileContent, ReadersBesideOneWriter) {
  const SignatureShape shape = small_header().shape;
  constexpr int rounds = 100;
  constexpr int views_per_round = 3;
  MemoryFile writer = MemoryFile::create(path, small_header());
  // Each reader must see whole transactions only, and never fewer views than before.
  std::vector<std::thread> readers;
  std::vector<std::string> faults(3);
  std::vector<int> loads(3);
  for (std::size_t reader = 0; reader < 3; ++reader) {
    readers.emplace_back([&, reader] {
      try {
        const MemoryFile file = MemoryFile::open(path, Access::read_only);
        std::size_t seen = 0;
        while (seen < rounds * views_per_round) {
          const VisualMemory memory = file.load();
          ++loads[reader];
          if (memory.size() < seen) faults[reader] = "views were lost";
          if (memory.size() % views_per_round != 0) faults[reader] = "half a transaction was seen";
          seen = memory.size();
          if (!faults[reader].empty()) return;
        }
      } catch (const std::exception& error) {
        faults[reader] = error.what();
      }
    });
  }
  Random random(5);
  for (int round = 0; round < rounds; ++round) {
    std::vector<NewView> views;
    for (int i = 0; i < views_per_round; ++i) {
      views.push_back(random_view(random, shape, round * views_per_round + i));
    }
    writer.append(views);
  }
  for (auto& reader : readers) reader.join();
  for (std::size_t reader = 0; reader < 3; ++reader) {
    EXPECT_EQ(faults[reader], "");
    EXPECT_GE(loads[reader], 1);
  }
}

TEST_F(MemoryFileContent, TwoWritersTakeTurns) {
  Random random(6);
  const SignatureShape shape = small_header().shape;
  MemoryFile first = MemoryFile::create(path, small_header());
  MemoryFile second = MemoryFile::open(path, Access::read_write);
  std::vector<ViewId> ids;
  for (int number = 0; number < 20; ++number) {
    ids.push_back((number % 2 == 0 ? first : second).append(random_view(random, shape, number)));
  }
  EXPECT_TRUE(std::ranges::is_sorted(ids));
  EXPECT_EQ(first.load().size(), 20U);
  EXPECT_THROW(second.append(random_view(random, shape, 0)), ContractError);
}

// Many pages and several levels of the tables; how long loading takes is bench/storage_bench's
// question.
TEST_F(MemoryFileContent, ALargeMemoryComesBackWhole) {
  MemoryHeader header = small_header();
  header.shape = {80, 15};
  header.panorama_columns = 512;
  constexpr int count = 3000;
  VisualMemory expected(header.shape, header.full_scale, header.elevations);
  Random random(7);
  {
    MemoryFile file = MemoryFile::create(path, header);
    std::vector<NewView> views;
    for (int number = 0; number < count; ++number) {
      views.push_back(random_view(random, header.shape, number));
    }
    const std::vector<ViewId> ids = file.append(views);
    ASSERT_EQ(ids.size(), views.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
      expected.append_with_id(ids[i], views[i].signature, views[i].info);
    }
  }
  const MemoryFile file = MemoryFile::open(path, Access::read_only);
  EXPECT_TRUE(same_content(file.load(), expected));
  EXPECT_TRUE(file.verify().empty());
}

TEST_F(MemoryFileContent, LocalFeaturesAreKeptCheckedAndGoWithTheirView) {
  Random random(10);
  const SignatureShape shape = small_header().shape;
  (void)MemoryFile::create(path, small_header()).append(random_view(random, shape, 1));
  const ViewId without{1};
  NewView added = random_view(random, shape, 2);
  added.features.assign(72, 7);
  {
    MemoryFile file = MemoryFile::open(path, Access::read_write);
    const ViewId view = file.append(added);
    EXPECT_FALSE(file.features(without));
    EXPECT_EQ(file.features(view), added.features);
    EXPECT_EQ(file.info().views_with_features, 1U);
    EXPECT_EQ(file.info().feature_bytes, 72U);
    EXPECT_TRUE(file.verify().empty());
    file.change([&] { file.remove(std::array{view}); }, "removed");
    EXPECT_EQ(file.info().views_with_features, 0U);
    file.undo();
    EXPECT_EQ(file.features(view), added.features);
    EXPECT_THROW((void)file.features(ViewId{99}), ContractError);
  }
  run_sql(path, "UPDATE features SET bytes = zeroblob(72)");
  const MemoryFile file = MemoryFile::open(path, Access::read_only);
  EXPECT_THROW((void)file.features(ViewId{2}), FileError);
  EXPECT_EQ(file.verify().size(), 1U);
}

TEST_F(MemoryFileContent, PlacesAreThoseOfTheViews) {
  MemoryFile file = MemoryFile::create(path, small_header());
  Random random(12);
  std::vector<NewView> views;
  for (int i = 0; i < 40; ++i) {
    views.push_back(random_view(random, small_header().shape, i));
    if (i % 5 == 1) views.back().info.name = "floor=ground/" + views.back().info.name;
    if (i % 5 == 2) views.back().info.name = "floor=/" + views.back().info.name;
    if (i % 5 == 3) views.back().info.name = "floor>" + views.back().info.name;
  }
  const std::vector<ViewId> ids = file.append(views);
  const auto expect_places = [&] {
    const VisualMemory memory = file.load();
    std::vector<MemoryFile::ViewPlace> expected;
    for (const ViewId view : memory.views()) {
      const ReferenceInfo& info = memory.info(view);
      expected.push_back({view, std::string(floor_of(info.name)), info.pose});
    }
    EXPECT_EQ(file.places(), expected);
    EXPECT_EQ(file.counts().views, memory.size());
  };
  expect_places();
  file.change(
      [&] {
        file.remove(std::vector{ids[0], ids[6], ids[39]});
        file.set_pose(ids[3], ReferencePose{-4.0, 4.0, {}});
        file.set_pose(ids[4], std::nullopt);
        file.rename(ids[5], "floor=attic/view");
      },
      "changed");
  expect_places();
  EXPECT_EQ(file.places()[4].floor, "attic");
  file.undo();
  expect_places();
  EXPECT_EQ(file.counts().views, 40U);
}

TEST_F(MemoryFileContent, ThumbnailsAndFeaturesOfAnySizeComeBack) {
  MemoryFile file = MemoryFile::create(path, small_header());
  Random random(13);
  std::vector<NewView> views;
  for (const std::size_t size : {1U, 599U, 600U, 601U, 1201U, 4292U, 300000U}) {
    NewView view = random_view(random, small_header().shape, static_cast<int>(views.size()));
    for (auto* bytes : {&view.thumbnail, &view.features}) {
      bytes->resize(size);
      for (auto& byte : *bytes) byte = static_cast<std::uint8_t>(random.index(256));
    }
    views.push_back(std::move(view));
  }
  const std::vector<ViewId> ids = file.append(views);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    EXPECT_EQ(file.thumbnail(ids[i]), views[i].thumbnail);
    EXPECT_EQ(file.features(ids[i]), views[i].features);
  }
  EXPECT_EQ(file.views_with_thumbnail(), ids);
  EXPECT_EQ(file.info().thumbnails, ids.size());
  EXPECT_TRUE(file.verify().empty());
  file.change([&] { file.remove(std::array{ids[5]}); }, "removed");
  EXPECT_EQ(file.info().views_with_features, ids.size() - 1);
  EXPECT_TRUE(file.verify().empty());
  file.undo();
  EXPECT_EQ(file.features(ids[5]), views[5].features);
}

TEST_F(MemoryFileContent, AViewTakesHardlyMoreThanItsContent) {
  MemoryHeader header = small_header();
  header.shape = {80, 15};
  header.panorama_columns = 512;
  constexpr std::uint64_t count = 500;
  std::uint64_t content = 0;  // sizes of thumbnails and features vary as in recordings
  {
    MemoryFile file = MemoryFile::create(path, header);
    Random random(14);
    std::vector<NewView> views;
    for (std::uint64_t i = 0; i < count; ++i) {
      NewView view = random_view(random, header.shape, static_cast<int>(i));
      view.info.pose = ReferencePose{random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), 0.5};
      view.thumbnail.assign(2000 + random.index(700), 7);
      view.features.assign(36 * (100 + random.index(40)), 7);
      content += 2 * header.shape.size() + view.thumbnail.size() + view.features.size();
      views.push_back(std::move(view));
    }
    file.append(views);
  }
  const std::uint64_t bytes = MemoryFile::open(path, Access::read_only).counts().file_bytes;
  constexpr std::uint64_t empty_bytes = 200'000;  // of a file without views
  EXPECT_LT(static_cast<double>(bytes - empty_bytes), 1.12 * static_cast<double>(content));
  EXPECT_LT((bytes - empty_bytes) / count, 10'000U);
}

TEST_F(MemoryFileContent, APartOfAThumbnailThatIsMissingIsDamage) {
  NewView view = numbered_view(small_header().shape, 1);
  view.thumbnail.assign(2000, 7);
  int number = 0;
  for (const char* sql :
       {"DELETE FROM thumbnails WHERE part = 256", "DELETE FROM thumbnails WHERE part = 259",
        "UPDATE thumbnails SET part = 265 WHERE part = 256",
        "UPDATE thumbnails SET checksum = 1 WHERE part = 256"}) {
    const auto file_path = folder / (std::to_string(number++) + ".panonav");
    {
      MemoryFile file = MemoryFile::create(file_path, small_header());
      file.append(view);
    }
    run_sql(file_path, sql);
    const MemoryFile file = MemoryFile::open(file_path, Access::read_only);
    EXPECT_THROW((void)file.thumbnail(ViewId{1}), FileError) << sql;
    EXPECT_EQ(file.verify().size(), 1U) << sql;
  }
}

}  // namespace
}  // namespace panonav::testing
