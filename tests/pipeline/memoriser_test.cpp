#include "panonav/pipeline/memoriser.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "support/memory_samples.hpp"
#include "support/temporary_folder.hpp"

namespace panonav {
namespace {

Observation seen_at(int number, double contrast = 1.0) {
  Image image(64, 16);
  for (int v = 0; v < 16; ++v) {
    for (int u = 0; u < 64; ++u) {
      const double wave = std::sin(0.1 * u + 0.05 * number * v) + std::cos(0.2 * u + number);
      image.at(u, v) = static_cast<std::uint8_t>(120.0 + contrast * 50.0 * wave);
    }
  }
  Observation observation(std::move(image));
  observation.name = "view_" + std::to_string(number);
  observation.pose = ReferencePose{0.5 * (number % 7), 0.5 * (number / 7), 0.1};
  observation.stamp_s = number;
  return observation;
}

MemoriserOptions options() {
  MemoriserOptions options;
  options.source = PictureSource{.kind = PictureKind::panorama};
  options.signature.components = 8;
  return options;
}

class Memorising : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path(std::string_view name = "m.panonav") const {
    return folder_ / name;
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Memorising, InBatchesOfAnySizeTheSameViewsAreStored) {
  constexpr int views = 45;
  std::vector<VisualMemory> memories;
  std::vector<MemoryHeader> headers;
  std::vector<std::vector<std::uint8_t>> thumbnails;
  for (const int batch : {1, 7, 32, 100}) {
    const auto file = path(std::to_string(batch));
    Memoriser memoriser(file, options());
    Executor executor(batch == 7 ? 3 : 1);
    for (int first = 0; first < views; first += batch) {
      EXPECT_EQ(memoriser.file() != nullptr, first >= 32);
      std::vector<Observation> seen;
      for (int i = first; i < std::min(views, first + batch); ++i) seen.push_back(seen_at(i));
      if (batch == 1) {
        memoriser.add(seen.front());
      } else {
        memoriser.add(std::move(seen), executor);
      }
    }
    EXPECT_EQ(memoriser.finish(executor).appended, 45U);
    const MemoryFile made = MemoryFile::open(file, Access::read_only);
    memories.push_back(made.load());
    headers.push_back(made.header());
    headers.back().created_s.reset();
    thumbnails.push_back(made.thumbnail(memories.back().views().back()).value());
    EXPECT_TRUE(load_stored_models(made, memories.back()));
  }
  for (std::size_t m = 1; m < memories.size(); ++m) {
    EXPECT_EQ(headers[m], headers[0]);
    EXPECT_EQ(thumbnails[m], thumbnails[0]);
    ASSERT_EQ(memories[m].size(), 45U);
    for (const ViewId view : memories[0].views()) {
      EXPECT_EQ(memories[m].packed(view), memories[0].packed(view));
      EXPECT_EQ(memories[m].info(view), memories[0].info(view));
    }
  }
}

TEST_F(Memorising, LargeImagesWaitAsPanoramasAndGiveTheSameViews) {
  constexpr int views = 33;  // one more than the full scale is computed from
  const auto see = [](int number) {
    Image image(2048, 1024);
    for (int v = 0; v < 1024; ++v) {
      for (int u = 0; u < 2048; ++u) {
        image.at(u, v) =
            static_cast<std::uint8_t>(((u + 37 * number) / 64 * 90 + v / 32 * 40) % 256);
      }
    }
    Observation observation(std::move(image));
    observation.name = "view_" + std::to_string(number);
    if (number % 5 == 0) observation.tilt = Tilt{0.05, -0.02};
    return observation;
  };
  MemoriserOptions spheres = options();
  spheres.source = PictureSource{.kind = PictureKind::equirectangular};
  std::vector<VisualMemory> memories;
  std::vector<double> full_scales;
  for (const int batch : {1, views}) {
    Executor executor(2);
    Memoriser memoriser(path(std::to_string(batch)), spheres);
    for (int first = 0; first < views; first += batch) {
      std::vector<Observation> seen;
      for (int i = first; i < first + batch; ++i) seen.push_back(see(i));
      memoriser.add(std::move(seen), executor);
    }
    full_scales.push_back(memoriser.file()->header().full_scale);
    memories.push_back(memoriser.file()->load());
  }
  EXPECT_EQ(full_scales[0], full_scales[1]);
  ASSERT_EQ(memories[0].size(), 33U);
  for (const ViewId view : memories[0].views()) {
    EXPECT_EQ(memories[0].packed(view), memories[1].packed(view));
  }
}

TEST_F(Memorising, OneMoreViewReadsNoSignatureButItsNeighbours) {
  constexpr int views = 1000;  // from there on models stay when one view is added
  {
    Memoriser memoriser(path(), options());
    for (int i = 0; i < views; ++i) memoriser.add(seen_at(i));
    memoriser.finish();
  }
  testing::run_sql(path(), "UPDATE views SET checksum = checksum + 1 WHERE id < 990");
  {
    const MemoryFile damaged = MemoryFile::open(path(), Access::read_only);
    EXPECT_THROW((void)damaged.load(), FileError);
  }
  Memoriser memoriser(path());
  memoriser.add(seen_at(views));
  EXPECT_EQ(memoriser.finish().appended, 1U);
  EXPECT_EQ(memoriser.file()->counts().views, views + 1U);
}

TEST_F(Memorising, GoesOnWhereItStoppedAndRefusesOtherViewsUnderKnownNames) {
  {
    Memoriser first(path(), options());
    for (int i = 0; i < 5; ++i) first.add(seen_at(i));
    EXPECT_EQ(first.finish().appended, 5U);
  }
  Memoriser more(path());
  for (int i = 3; i < 8; ++i) more.add(seen_at(i));
  Observation moved = seen_at(2);
  moved.pose->x_m += 1.0;
  EXPECT_THROW(more.add(moved), FileError);
  Observation other = seen_at(40);
  other.name = "view_2";
  other.pose = seen_at(2).pose;
  other.stamp_s = 2.0;
  EXPECT_THROW(more.add(other), FileError);
  EXPECT_THROW(more.add(Observation(Image(63, 16))), ContractError);
  Executor executor;
  std::vector<Observation> last{seen_at(8), seen_at(9), Observation(Image(63, 16)), seen_at(10)};
  EXPECT_THROW(more.add(std::move(last), executor), ContractError);
  const auto counts = more.finish();
  EXPECT_EQ(counts.appended, 5U);  // 5 .. 9
  EXPECT_EQ(counts.known_before, 2U);
  EXPECT_EQ(MemoryFile::open(path(), Access::read_only).names().back(), "view_9");
}

TEST_F(Memorising, KnowsWherePathsBegin) {
  const auto memorise = [&](const std::vector<std::pair<std::string, int>>& input) {
    Memoriser memoriser(path(), options());
    std::vector<Observation> observations;
    for (const auto& [name, number] : input) {
      Observation observation = seen_at(number);
      observation.name = name;
      observation.pose.reset();
      observations.push_back(std::move(observation));
    }
    Executor executor;
    memoriser.add(std::move(observations), executor);
    memoriser.finish(executor);
    const MemoryFile file = MemoryFile::open(path(), Access::read_only);
    std::vector<std::string> names;
    const VisualMemory views = file.load();
    for (const ViewId start : read_path_starts(file)) names.push_back(views.info(start).name);
    return names;
  };
  using Names = std::vector<std::string>;
  // Neither the names nor their endings tell which images belong together, but their input does.
  EXPECT_EQ(memorise({{"a_1.png", 1}, {"b_2.jpg", 2}, {"3.PNG", 3}}), Names());
  // The input of more images of a known walk continues it.
  EXPECT_EQ(memorise({{"b_2.jpg", 2}, {"3.PNG", 3}, {"4.png", 4}}), Names());
  EXPECT_EQ(memorise({{"5.png", 5}, {"6.png", 6}}), Names({"5.png"}));
  // Images between known ones, and after a view that others follow.
  EXPECT_EQ(memorise({{"5.png", 5}, {"5b.png", 15}, {"6.png", 6}, {"7.png", 7}}),
            Names({"5.png", "5b.png", "7.png"}));
  EXPECT_EQ(memorise({{"4.png", 4}, {"8.png", 8}, {"9.png", 9}}),
            Names({"5.png", "5b.png", "7.png", "8.png"}));
  EXPECT_EQ(
      memorise({{"9.png", 9}, {"w.mp4@1", 20}, {"w.mp4@2", 21}, {"v.mp4@1", 22}, {"x/1", 23}}),
      Names({"5.png", "5b.png", "7.png", "8.png", "w.mp4@1", "v.mp4@1", "x/1"}));
}

TEST_F(Memorising, AnImageAloneContinuesThePath) {
  const auto memorise = [&](const std::vector<std::string>& names, int first) {
    Memoriser memoriser(path(), options());
    for (const std::string& name : names) {
      Observation observation = seen_at(first++);
      observation.name = name;
      observation.pose.reset();
      memoriser.add(std::move(observation));
    }
    memoriser.finish();
    const MemoryFile file = MemoryFile::open(path(), Access::read_only);
    std::vector<std::string> starts;
    const VisualMemory views = file.load();
    for (const ViewId start : read_path_starts(file)) starts.push_back(views.info(start).name);
    return starts;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(memorise({"a.png"}, 1), Names());
  EXPECT_EQ(memorise({"b.png"}, 2), Names());
  EXPECT_EQ(memorise({"c.png"}, 3), Names());
  EXPECT_EQ(memorise({"c.png", "d.png"}, 3), Names());
  // Images that are added to one Memoriser are a walk, also if they come one by one.
  EXPECT_EQ(memorise({"e.png", "f.png"}, 20), Names({"e.png"}));
  EXPECT_EQ(memorise({"g.png"}, 22), Names({"e.png"}));
  EXPECT_EQ(memorise({"w.mp4@1"}, 23), Names({"e.png", "w.mp4@1"})) << "another video";
}

TEST_F(Memorising, MakesNoFileOfWhatItCannotCompare) {
  EXPECT_THROW(Memoriser{path()}, ContractError);  // how do pictures lie?
  Memoriser nothing(path(), options());
  EXPECT_THROW(static_cast<void>(nothing.finish()), ContractError);
  Memoriser plain(path(), options());
  plain.add(seen_at(0, 0.0));
  EXPECT_THROW(static_cast<void>(plain.finish()), FileError);
  MemoriserOptions too_many = options();
  too_many.signature.components = 33;
  Memoriser fine(path(), too_many);
  fine.add(seen_at(0));
  EXPECT_THROW(static_cast<void>(fine.finish()), ContractError);
  EXPECT_FALSE(std::filesystem::exists(path()));
}

}  // namespace
}  // namespace panonav
