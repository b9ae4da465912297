#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/memory_merge.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav/signature/gradient_features.hpp"
#include "support/patch_views.hpp"
#include "support/skips.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

class NarrowPictures : public InTemporaryFolder {
 protected:
  /// Memorises nine rooms of one view each.
  std::filesystem::path memorise(bool narrow) {
    const auto path = folder / (narrow ? "narrow.panonav" : "plain.panonav");
    MemoriserOptions options{
        .source = PictureSource{}, .narrow = narrow, .map = false, .left_out = {}};
    options.source->layout.elevations = patch_band;
    Memoriser memoriser(path, options);
    for (int i = 0; i < 9; ++i) {
      Observation view(make_patch_view(static_cast<std::uint64_t>(i)));
      view.name = "room " + std::to_string(i);
      view.pose = ReferencePose{10.0 * i, 0.0, 0.2 * i};
      memoriser.add(std::move(view));
    }
    (void)memoriser.finish();
    return path;
  }
  static PlaceRecogniserOptions narrow_options() {
    PlaceRecogniserOptions options;
    options.source.emplace();
    options.source->kind = PictureKind::pinhole;
    options.source->field_of_view_rad = radians(70.0);
    return options;
  }
};

TEST_F(NarrowPictures, AreLocalisedInAMemoryOfPanoramas) {
  const auto path = memorise(true);
  const PlaceRecogniser recogniser(path, narrow_options());
  Observation photo(take_narrow_picture(make_patch_view(5), 1.5, radians(70.0)));
  const Place place = recogniser.localise(photo);
  ASSERT_TRUE(place.known);
  EXPECT_EQ(place.matches.front().name, "room 5");
  EXPECT_NEAR(place.position->x_m, 50.0, 1e-9);
  EXPECT_NEAR(angle_difference(*place.heading_rad, 1.0 + 1.5), 0.0, radians(2.0));
  const std::vector<std::string> own{"room 5"};
  EXPECT_FALSE(recogniser.localise(photo, own).known);
  EXPECT_FALSE(
      recogniser.localise(take_narrow_picture(make_patch_view(77), 1.5, radians(70.0))).known);
}

/// Pictures of these cameras of the middle of a panorama, joined.
Image take_rig_picture(const Panorama& view, const Camera& rig) {
  const auto& model = std::get<RigModel>(rig.model);
  std::vector<Image> images;
  std::vector<ImageView> views;
  for (const Camera& camera : model.cameras) {
    images.push_back(take_narrow_picture(view, std::get<PinholeModel>(camera.model).azimuth_rad,
                                         radians(90.0), camera.image_size));
  }
  for (const Image& image : images) views.push_back(image.view());
  return join_pictures(model, views);
}

Camera make_test_rig(int used) {
  std::vector<Camera> cameras;
  for (int i = 0; i < used; ++i) {
    Camera& camera = cameras.emplace_back();
    camera.model = PinholeModel{.focal_length_px = 200.0, .azimuth_rad = radians(90.0) * i};
    camera.image_size = {400, 300};
    camera.centre = {200.0, 150.0};
  }
  return make_rig(std::move(cameras));
}

TEST_F(NarrowPictures, OfARigAreOneQuestion) {
  const auto path = memorise(true);
  for (const int used : {2, 3, 4}) {
    const Camera rig = make_test_rig(used);
    PlaceRecogniserOptions options;
    options.source = PictureSource{.kind = PictureKind::pinhole, .camera = rig};
    const PlaceRecogniser recogniser(path, options);
    const Place place = recogniser.localise(take_rig_picture(make_patch_view(5), rig));
    ASSERT_TRUE(place.known) << used;
    EXPECT_EQ(place.matches.front().name, "room 5");
    EXPECT_NEAR(angle_difference(*place.heading_rad, 1.0), 0.0, radians(2.0));
    EXPECT_FALSE(recogniser.localise(take_rig_picture(make_patch_view(77), rig)).known) << used;
    EXPECT_THROW((void)recogniser.localise(Image(400, 300)), ContractError);
  }
  const Camera around = make_test_rig(4);
  PlaceRecogniserOptions panoramic;
  panoramic.source = PictureSource{.kind = PictureKind::mirror, .camera = around};
  const PlaceRecogniser recogniser(path, panoramic);
  const Place place = recogniser.localise(take_rig_picture(make_patch_view(5), around));
  EXPECT_EQ(place.matches.front().name, "room 5");
  ASSERT_TRUE(place.known);
  EXPECT_NEAR(angle_difference(*place.heading_rad, 1.0), 0.0, radians(2.0));
}

TEST_F(NarrowPictures, AreTrackedByOdometry) {
  const auto path = memorise(true);
  TrackerOptions options;
  options.source = narrow_options().source;
  const auto drive = [&](Tracker& tracker, int from, int to) {
    MonteCarloEstimate estimate;
    for (int room = from; room <= to; ++room) {
      Observation photo(take_narrow_picture(make_patch_view(static_cast<std::uint64_t>(room)),
                                            0.3 - 0.2 * room, radians(70.0)));
      photo.odometry = Pose2{10.0 * (room - from), 0.0, 0.0};  // the robot does not turn
      estimate = tracker.observe(photo);
    }
    return estimate;
  };
  Tracker tracker(path, options);
  ASSERT_TRUE(tracker.takes_narrow_pictures());
  const MonteCarloEstimate estimate = drive(tracker, 2, 6);
  ASSERT_TRUE(estimate.position);
  EXPECT_LT(distance(*estimate.position, {60.0, 0.0}), 10.0) << "as far as the next room";
  EXPECT_GT(estimate.p_inside, 0.9);
  EXPECT_EQ(tracker.visual_odometry(), nullptr);
  Tracker again(path, options);
  EXPECT_EQ(drive(again, 2, 6).modes.front().mean, estimate.modes.front().mean) << "same bits";
  // Pictures of rooms that were not memorised.
  Tracker outside(path, options);
  EXPECT_EQ(drive(outside, 20, 26).state, LocalisationState::lost);

  EXPECT_THROW((void)Tracker(memorise(false), options), FileError);
  EXPECT_THROW((void)Tracker(path).localise(take_narrow_picture(make_patch_view(1), 0.0, 1.2)),
               ContractError);
}

TEST_F(NarrowPictures, AreLocalisedAmongPanoramas) {
  const auto path = memorise(true);
  const PlaceRecogniser narrow(path, narrow_options());
  const PlaceRecogniser recogniser(path);
  Observation photo(take_narrow_picture(make_patch_view(5), 1.5, radians(70.0)));
  const Place expected = narrow.localise(photo);
  photo.narrow_source = narrow_options().source;
  const Place place = recogniser.localise(photo);
  EXPECT_EQ(place.known_probability, expected.known_probability);
  EXPECT_EQ(place.position->x_m, expected.position->x_m);
  EXPECT_EQ(place.heading_rad, expected.heading_rad);
  EXPECT_EQ(recogniser.localise(Observation(make_patch_view(3))).matches.front().name, "room 3");
  EXPECT_THROW((void)recogniser.encoder().packed(photo), ContractError);
  const PlaceRecogniser plain(memorise(false));
  EXPECT_TRUE(
      contains(message_of<ContractError>([&] { (void)plain.localise(photo); }), "option narrow"));
}

TEST_F(NarrowPictures, UseTheModelThatIsStored) {
  const MemoryFile file = MemoryFile::open(memorise(true), Access::read_only);
  const VisualMemory memory = file.load();
  const auto stored = load_stored_models(file, memory);
  ASSERT_TRUE(stored && stored->sector && stored->sector->learnt);
  EXPECT_EQ(*stored->sector, SectorLocaliser(memory, make_gradient_source(file)).model());
}

TEST_F(NarrowPictures, AreMissedByMemoriesWithoutCorners) {
  const auto path = folder / "plain walls.panonav";
  Panorama smooth(48, 256, patch_band);
  for (int y = 0; y < smooth.rows(); ++y) {
    for (int x = 0; x < smooth.columns(); ++x) {
      smooth.at(y, x) = static_cast<float>(0.5 + 0.3 * std::sin(2.0 * std::numbers::pi * x / 256));
    }
  }
  MemoriserOptions options{.source = PictureSource{}, .narrow = true, .map = false, .left_out = {}};
  options.source->layout.elevations = patch_band;
  Memoriser memoriser(path, options);
  for (int i = 0; i < 9; ++i) {
    Observation view(rotate_columns(smooth, 20 * i));
    view.name = std::to_string(i);
    view.pose = ReferencePose{1.0 * i, 0.0, 0.0};
    memoriser.add(std::move(view));
  }
  EXPECT_NO_THROW((void)memoriser.finish());
  EXPECT_TRUE(contains(message_of<ContractError>([&] { PlaceRecogniser(path, narrow_options()); }),
                       "features for narrow pictures"));
}

TEST_F(NarrowPictures, OfRealRoomsAreRecognisedAndOthersAreUnknown) {
  const auto rooms = real_data("ciirc_b670");
  const auto walk = real_data("indoor_walk_360");
  PANONAV_REQUIRE_DATA(rooms, "ciirc_b670");
  PANONAV_REQUIRE_DATA(walk, "indoor_walk_360");
  const Dataset here = read_dataset(*rooms);
  const auto path = folder / "rooms.panonav";
  Memoriser memoriser(path, {.source = here.source, .narrow = true, .map = false, .left_out = {}});
  const auto observe = [](const DatasetEntry& entry) {
    Observation view(read_picture(entry));
    view.name = entry.file;
    view.pose = entry.pose;
    return view;
  };
  for (const DatasetEntry& entry : here.entries) memoriser.add(observe(entry));
  (void)memoriser.finish();
  const PlaceRecogniser recogniser(path, narrow_options());
  Random random(1);
  const auto photograph = [&](const DatasetEntry& entry) {
    const Image whole = read_grey_picture(entry);
    const Panorama sphere = panorama_from_picture(
        whole.view(), {.elevations = ElevationBand{-std::numbers::pi / 2, std::numbers::pi / 2}},
        {whole.height(), whole.width()});
    return take_narrow_picture(sphere, random.uniform(-3.0, 3.0), radians(70.0), {640, 480});
  };
  const auto apart = [&](std::size_t i, std::size_t j) {
    const auto& [a, b] = std::pair(*here.entries[i].pose, *here.entries[j].pose);
    return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
  };
  int right = 0;
  for (std::size_t i = 0; i < here.entries.size(); ++i) {
    const std::vector<std::string> own{here.entries[i].file};
    const Place place = recogniser.localise(photograph(here.entries[i]), own);
    double nearest_m = 1e9;
    double found_m = 1e9;
    for (std::size_t j = 0; j < here.entries.size(); ++j) {
      if (j == i) continue;
      nearest_m = std::min(nearest_m, apart(i, j));
      if (here.entries[j].file == place.matches.front().name) found_m = apart(i, j);
    }
    if (found_m <= 1.5 * nearest_m) ++right;
  }
  EXPECT_GE(right, 22) << "of 31";  // 82 % of 620 pictures; 22 are 2 deviations less
  int known = 0;
  const Dataset elsewhere = read_dataset(*walk);
  for (std::size_t i = 0; i < elsewhere.entries.size(); i += 4) {
    if (recogniser.localise(photograph(elsewhere.entries[i])).known) ++known;
  }
  EXPECT_LE(known, 1) << "of 30 pictures of another building";
}

TEST_F(NarrowPictures, NeedTheElevationsOfTheMemory) {
  const auto path = folder / "unknown.panonav";
  Memoriser memoriser(path,
                      {.source = PictureSource{}, .narrow = true, .map = false, .left_out = {}});
  Random random(1);
  const auto memorise = [&] {
    for (int i = 0; i < 9; ++i) {
      Observation view(random_panorama(random, 48, 256));
      view.name = std::to_string(i);
      memoriser.add(std::move(view));
    }
    (void)memoriser.finish();
  };
  EXPECT_TRUE(contains(message_of<ContractError>(memorise), "elevation_deg"));
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(NarrowPictures, ChangeNothingForWholePanoramas) {
  const auto narrow_path = memorise(true);
  const auto plain_path = memorise(false);
  const MemoryFile narrow = MemoryFile::open(narrow_path, Access::read_only);
  const MemoryFile plain = MemoryFile::open(plain_path, Access::read_only);
  int views = 0;
  for (const ViewId view : narrow.views()) {
    const auto both = narrow.features(view).value();
    const auto parts = split_feature_bytes(both);
    EXPECT_FALSE(parts.gradient.empty());
    EXPECT_TRUE(std::ranges::equal(parts.local, plain.features(view).value()));
    ++views;
  }
  EXPECT_EQ(views, 9);
  const PlaceRecogniser with(narrow_path);
  const PlaceRecogniser without(plain_path);
  const Observation query(rotate_columns(make_patch_view(3), 40));
  const Place a = with.localise(query);
  const Place b = without.localise(query);
  EXPECT_EQ(a.known_probability, b.known_probability);
  EXPECT_EQ(a.heading_rad, b.heading_rad);
  EXPECT_EQ(a.matches.front().name, b.matches.front().name);
}

TEST_F(NarrowPictures, AreLocalisedInAMergedMemory) {
  const auto path = memorise(true);
  const auto other = folder / "other.panonav";
  std::filesystem::copy_file(path, other);
  const auto merged = folder / "merged.panonav";
  (void)merge_memories(path, other, merged);
  const PlaceRecogniser recogniser(merged, narrow_options());
  const Place place =
      recogniser.localise(take_narrow_picture(make_patch_view(5), 1.5, radians(70.0)));
  ASSERT_TRUE(place.known);
  EXPECT_TRUE(contains(place.matches.front().name, "room 5"));
  EXPECT_TRUE(contains(message_of<ContractError>([&] {
                         (void)merge_memories(path, memorise(false), folder / "mixed.panonav");
                       }),
                       "narrow"));
}

TEST_F(NarrowPictures, FaultsAreNamed) {
  const auto plain = memorise(false);
  EXPECT_TRUE(
      contains(message_of<FileError>([&] { PlaceRecogniser(plain, narrow_options()); }), "narrow"));
  const auto path = memorise(true);
  auto unknown_lens = narrow_options();
  unknown_lens.source->field_of_view_rad.reset();
  const PlaceRecogniser recogniser(path, unknown_lens);
  const Observation photo(take_narrow_picture(make_patch_view(5), 1.5, radians(70.0)));
  EXPECT_TRUE(contains(message_of<ContractError>([&] { (void)recogniser.localise(photo); }),
                       "field of view"));
  // A memory needs views of all azimuths.
  MemoriserOptions options{.source = narrow_options().source, .left_out = {}};
  Memoriser memoriser(folder / "phone.panonav", options);
  EXPECT_THROW(
      {
        memoriser.add(photo);
        (void)memoriser.finish();
      },
      ContractError);
}

}  // namespace
}  // namespace panonav::testing
