#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>

#include "command/memorise.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

TEST_F(Memorise, SaysWhatItDidAndInfoAgrees) {
  const auto said = answer_of({"memorise", memory(), data(), "--json"});
  EXPECT_EQ(said["appended"], 16);
  EXPECT_EQ(said["known_before"], 0);
  const auto info = info_of(memory());
  EXPECT_EQ(info["views"], 16);
  EXPECT_EQ(info["rows"], 12);
  EXPECT_EQ(info["components"], 15);
  EXPECT_EQ(info["views_with_position"], 16);
  EXPECT_EQ(info["views_with_heading"], 16);
  EXPECT_EQ(answer_of({"verify", memory(), "--json"})["intact"], true);
}

TEST_F(Memorise, SecondTimeThereIsNothingToDo) {
  run_well({"memorise", memory(), data()});
  const auto again = answer_of({"memorise", memory(), data(), "--json"});
  EXPECT_EQ(again["appended"], 0);
  EXPECT_EQ(again["known_before"], 16);
  EXPECT_EQ(views_in(memory()), 16);
}

TEST_F(Memorise, PanoramasAreResampledToTheSizeAskedFor) {
  run_well({"memorise", memory(), data(), "--rows", "6", "--columns", "48"});
  const auto info = info_of(memory());
  EXPECT_EQ(info["rows"], 6);
  EXPECT_EQ(info["panorama_columns"], 48);
  EXPECT_EQ(info["views"], 16);
  // Asking resamples in the same way, so that every view finds itself.
  const auto answers = answers_of({"localise", memory(), data(), "--json"});
  ASSERT_EQ(answers.size(), 16U);
  for (const auto& answer : answers) {
    EXPECT_EQ(answer["matches"][0]["file"], answer["file"]);
    EXPECT_EQ(answer["matches"][0]["dissimilarity"], 0);
  }
  // Pictures of another size than the recording's are still no views, on both ways in.
  write_picture(data() / view_name(5), world_, {0.0, 0.0, 0.0}, 48, 6);
  const auto skipped = run_panonav({"localise", memory(), data()});
  EXPECT_TRUE(contains(skipped.err, view_name(5) + ": size is 48 x 6; allowed: 96 x 12"))
      << skipped.err;
  EXPECT_TRUE(contains(skipped.out, "15 of 15 images")) << skipped.out;
  const auto line = refusal(
      {"memorise", folder_ / "o.panonav", data(), "--rows", "6", "--columns", "48", "--strict"});
  EXPECT_TRUE(contains(line, view_name(5)));
  EXPECT_FALSE(fs::exists(folder_ / "o.panonav"));
}

TEST_F(Memorise, ARecordingOfAnotherSizeIsRefusedAsAWhole) {
  run_well({"memorise", memory(), data()});
  const std::string other = folder_ / "other";
  fs::create_directory(other);
  for (std::size_t i = 0; i < 3; ++i)
    write_picture(other + "/small" + view_name(i), world_, {0.0, 0.0, 0.0}, 48, 6);
  const std::vector<std::string> words{"memorise", memory(),          other, "--kind",
                                       "panorama", "--elevation-deg", "-20", "20"};
  const auto line = refusal(words);
  EXPECT_TRUE(contains(line, "no image fits")) << line;
  EXPECT_TRUE(contains(line, "size is 48 x 6; allowed: 96 x 12")) << line;
  write_picture(other + "/small" + view_name(3), world_, {0.0, 0.0, 0.0}, 96, 12);
  const auto result = run_panonav(words);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(contains(result.out, "1 view stored, 3 skipped")) << result.out;
}

TEST_F(Memorise, AnotherImageOfTheSameNameIsRefusedWithARemedy) {
  run_well({"memorise", memory(), data()});
  const std::string other = folder_ / "other";
  write_dataset(other, landmark_world(77), grid_poses(2));
  const auto line = refusal({"memorise", memory(), other});
  EXPECT_TRUE(contains(line, "rename the images")) << line;
  EXPECT_TRUE(contains(line, "merge both")) << line;
  run_well({"memorise", folder_ / "other.panonav", other});
  const std::string both = folder_ / "both.panonav";
  (void)run_panonav({"merge", memory(), folder_ / "other.panonav", "-o", both});
  EXPECT_EQ(info_of(both)["views"], 20);
}

TEST_F(Memorise, APictureOfAnotherSizeIsSkippedAndNamed) {
  for (const std::size_t odd : {std::size_t{0}, std::size_t{5}}) {
    const std::string memory = folder_ / ("odd" + std::to_string(odd) + ".panonav");
    write_dataset(data(), world_, grid_poses(4));
    write_picture(data() / view_name(odd), world_, {0.0, 0.0, 0.0}, 80, 6);
    EXPECT_FALSE(fs::exists(memory));
    expect_refusal({"memorise", memory, data(), "--strict"}, "size is ");
    fs::remove(memory);
    const auto result = run_panonav({"memorise", memory, data(), "--json"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto said = json::parse(result.out);
    EXPECT_EQ(said["appended"], 15);
    ASSERT_EQ(said["skipped"].size(), 1U);
    EXPECT_EQ(said["skipped"][0]["file"], view_name(odd));
    EXPECT_TRUE(contains(result.err, "skipped: "));
    EXPECT_TRUE(contains(result.err, view_name(odd) + ": size is 80 x 6; allowed: 96 x 12"));
    EXPECT_EQ(answer_of({"memorise", memory, data(), "--json"})["appended"], 0);
  }
}

TEST_F(Memorise, ASizeThatMostImagesHaveButNotTheKindIsSkipped) {
  const auto mixed = folder_ / "mixed";
  fs::create_directories(mixed);
  for (std::size_t i = 0; i < 9; ++i) {
    const bool is_sphere = i % 3 == 0;
    write_picture(mixed / view_name(i), world_, {0.1 * static_cast<double>(i), 0.0, 0.0}, 64,
                  is_sphere ? 32 : 12);
  }
  const auto said =
      answer_of({"memorise", folder_ / "m.panonav", mixed, "--kind", "equirectangular", "--json"});
  EXPECT_EQ(said["appended"], 3);
  EXPECT_EQ(said["skipped"].size(), 6U);
}

TEST_F(Memorise, AResumedMemoryTakesNoOtherPictureUnderAKnownName) {
  run_well({"memorise", memory(), data()});
  // Same name, same pose, one other picture out of sixteen.
  write_picture(data() / view_name(6), world_, {1.7, 0.1, 0.0});
  auto line = refusal({"memorise", memory(), data()});
  EXPECT_TRUE(contains(line, "m.panonav"));
  EXPECT_TRUE(contains(line, "another image under the name " + view_name(6)));
  // The robot turned on the spot: the same place, but another view.
  write_picture(data() / view_name(6), world_, {0.5, 1.0, 0.4});
  line = refusal({"memorise", memory(), data()});
  EXPECT_TRUE(contains(line, view_name(6)));
  // The true image, written again, is the same view.
  write_picture(data() / view_name(6), world_, grid_poses(4)[6]);
  run_well({"memorise", memory(), data()});
  fs::remove(data() / view_name(6));
  line = refusal({"memorise", memory(), data()});
  EXPECT_TRUE(contains(line, view_name(6)));
  EXPECT_EQ(views_in(memory()), 16);
}

TEST_F(Memorise, AResumedMemoryTakesNoOtherPoseUnderAKnownName) {
  run_well({"memorise", memory(), data()});
  auto moved = grid_poses(4);
  moved[9].x_m += 0.01;
  write_dataset(data(), world_, moved);
  expect_refusal({"memorise", memory(), data()}, view_name(9));
  EXPECT_EQ(views_in(memory()), 16);
}

TEST_F(Memorise, WhatWasForgottenAndReplacedIsComparedAgain) {
  run_well({"memorise", memory(), data()});
  run_well({"forget", memory(), view_name(6)});
  const fs::path other = folder_ / "other";
  auto poses = grid_poses(4);
  write_dataset(other, landmark_world(99), poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i != 6) fs::remove(other / view_name(i));
  }
  write_text(other / "poses.csv", "file,x_m,y_m,heading_deg\nview_006.png,0.5,1,0\n");
  run_well({"memorise", memory(), other});
  expect_refusal({"memorise", memory(), data()}, view_name(6));
}

TEST_F(Memorise, TakesAFolderOfImagesWithoutPoses) {
  fs::remove(data() / "dataset.toml");
  const auto said = answer_of({"memorise", memory(), data(), "--kind", "panorama", "--json"});
  const auto info = info_of(memory());
  EXPECT_EQ(info["views"], 16);
  // The positions come from a map of the images, which has no metres.
  EXPECT_EQ(said["map"]["unit"], "view_steps");
  EXPECT_EQ(said["map"]["views"], 16);
  EXPECT_GT(info["views_with_position"], 1);
}

TEST_F(Memorise, OneDamagedPictureIsNamedAndSkipped) {
  const auto damage = [&](std::size_t number) {
    const fs::path file = data() / view_name(number);
    fs::resize_file(file, fs::file_size(file) / 2);
  };
  damage(0);
  damage(5);
  const auto result = run_panonav({"memorise", memory(), data(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto said = json::parse(result.out);
  EXPECT_EQ(said["appended"], 14);
  ASSERT_EQ(said["skipped"].size(), 2U);
  EXPECT_EQ(said["skipped"][1]["file"], view_name(5));
  EXPECT_TRUE(contains(said["skipped"][1]["why"].get<std::string>(), "damaged PNG"));
  ASSERT_EQ(lines(result.err).size(), 2U);
  EXPECT_TRUE(contains(lines(result.err)[0], "skipped: " + (data() / view_name(0)).string()));
  EXPECT_EQ(views_in(memory()), 14);

  // Once it is whole, the same command takes it.
  write_picture(data() / view_name(5), world_, grid_poses(4)[5]);
  const auto again = run_panonav({"memorise", memory(), data()});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(contains(again.out, "1 view stored, 14 already in the memory, 1 skipped"));
  EXPECT_EQ(views_in(memory()), 15);

  expect_refusal({"memorise", folder_ / "s.panonav", data(), "--strict"},
                 view_name(0) + ": damaged PNG");
  EXPECT_FALSE(fs::exists(folder_ / "s.panonav"));
}

TEST_F(Memorise, WhereNoPictureCanBeReadThereIsNoMemory) {
  const fs::path file = folder_ / "a.png";
  write_text(file, "no image");
  const auto result = run_panonav({"memorise", memory(), file, "--kind", "panorama"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(contains(result.err, "is not an image that can be read"));
  EXPECT_FALSE(fs::exists(memory()));
}

TEST_F(Memorise, NamesWhatOfAFolderItLeavesOutAndTakesFoldersWithinWhenAsked) {
  const fs::path folder = folder_ / "photos";
  for (const std::string name : {"view_9.png", "view_10.png", "evening/view_1.png"}) {
    fs::create_directories((folder / name).parent_path());
    write_picture(folder / name, world_, grid_poses(2)[1]);
  }
  write_text(folder / "notes.txt", "mine");
  const auto flat = run_panonav({"memorise", memory(), folder, "--kind", "panorama"});
  ASSERT_EQ(flat.exit_code, 0) << flat.err;
  EXPECT_TRUE(contains(flat.err, "left out, no image: notes.txt\n"));
  EXPECT_TRUE(contains(flat.err, "left out, folders within: evening/\n"));
  EXPECT_EQ(views_in(memory()), 2);
  const auto deep =
      run_panonav({"memorise", memory(), folder, "--kind", "panorama", "--recursive"});
  ASSERT_EQ(deep.exit_code, 0) << deep.err;
  EXPECT_EQ(deep.err, "left out, no image: notes.txt\n");
  EXPECT_EQ(views_in(memory()), 3);
  const auto found = answers_of({"localise", memory(), folder / "evening", "--json"}, 0);
  EXPECT_EQ(found.size(), 1U);
  expect_refusal({"memorise", folder_ / "r.panonav", data(), "--recursive"},
                 "leave out --recursive");
}

/// Memorises 360 degree images: without a stated band, the band around the horizon is used, and one
/// line says so. A memory that exists has its own band.
void expect_default_band(const fs::path& folder, const fs::path& memory) {
  const std::string note =
      "Of the 360 degree images, the elevations from -30 to 40 degrees are used; to use another "
      "part: --elevation-deg LOW HIGH\n";
  const auto band_of = [](const fs::path& file) {
    std::vector<long> band_deg;
    const json info = answer_of({"info", file, "--json"}, 0);
    for (const double edge_rad : info["elevations_rad"])
      band_deg.push_back(std::lround(edge_rad * 180.0 / std::numbers::pi));
    return band_deg;
  };
  const std::vector<std::string> typed{"memorise", memory, folder, "--kind", "equirectangular"};
  EXPECT_EQ(run_panonav(typed).err, note);
  EXPECT_EQ(band_of(memory), (std::vector<long>{-30, 40}));
  EXPECT_EQ(run_panonav(typed).err, "");
  EXPECT_EQ(run_panonav({"localise", memory, folder, "--exclude-same-file"}).err.find(note),
            std::string::npos);
  const fs::path whole = memory.string() + "_whole";
  const auto stated = run_panonav(
      {"memorise", whole, folder, "--kind", "equirectangular", "--elevation-deg", "-90", "90"});
  EXPECT_EQ(stated.err, "");
  EXPECT_EQ(band_of(whole), (std::vector<long>{-90, 90}));

  // Where a dataset.toml describes the images, only a band in this file has an effect.
  const fs::path toml = folder / "dataset.toml";
  const std::string list = "[list]\nfile = \"images.csv\"\n";
  write_file(folder / "images.csv", std::string_view("file\na.png\n"));
  write_file(toml, list + "[images]\nkind = \"equirectangular\"\n");
  const fs::path described = memory.string() + "_described";
  const std::string way = "elevation_deg = [LOW, HIGH] below [images] in " + toml.string() + "\n";
  for (const char* verb : {"memorise", "try"}) {
    std::vector<std::string> words{verb, described, folder};
    if (verb == std::string_view("try")) words = {verb, folder, "-o", described.string() + "_try"};
    const std::string noted = run_panonav(words).err;
    EXPECT_TRUE(contains(noted, "to use another part: " + way)) << noted;
    EXPECT_FALSE(contains(noted, "--elevation-deg")) << noted;
  }
  expect_refusal({"memorise", described.string() + "_new", folder, "--elevation-deg", "-20", "30"},
                 "--elevation-deg cannot be used where a dataset.toml describes the images; leave "
                 "it out, or write elevation_deg = [LOW, HIGH] below [images] in " +
                     toml.string());
  write_file(toml, list + "[images]\nkind = \"equirectangular\"\nelevation_deg = [-20, 30]\n");
  const fs::path again = memory.string() + "_again";
  EXPECT_EQ(run_panonav({"memorise", again, folder}).err, "");
  EXPECT_EQ(band_of(again), (std::vector<long>{-20, 30}));
  fs::remove(toml);
  fs::remove(folder / "images.csv");
}

TEST_F(Memorise, ImplausiblePicturesAreRefusedOrHinted) {
  const fs::path folder = folder_ / "sphere";
  fs::create_directory(folder);
  write_picture(folder / "a.png", world_, grid_poses(2)[1], 96, 48);
  const auto hinted = run_panonav({"memorise", memory(), folder, "--kind", "panorama"});
  ASSERT_EQ(hinted.exit_code, 0) << hinted.err;
  EXPECT_TRUE(contains(hinted.err, "hint: " + (folder / "a.png").string() + " is 96 x 48 px"));
  EXPECT_TRUE(contains(hinted.err, "of the kind equirectangular"));
  const auto known = run_panonav({"memorise", folder_ / "b.panonav", folder, "--kind", "panorama",
                                  "--elevation-deg", "-30", "60"});
  EXPECT_EQ(known.exit_code, 0);
  EXPECT_EQ(known.err, "");
  expect_default_band(folder, folder_ / "c.panonav");

  write_picture(folder / "a.png", world_, grid_poses(2)[1], 96, 40);
  const std::vector<std::string> whole{"memorise", folder_ / "d.panonav", folder, "--kind",
                                       "equirectangular"};
  expect_refusal(whole,
                 "a.png: equirectangular image is 96 x 40 px; allowed: twice as wide as high");
  // Radians in the place of degrees.
  expect_refusal({"memorise", folder_ / "d.panonav", folder, "--kind", "panorama",
                  "--elevation-deg", "-0.52", "0.7"},
                 "--elevation-deg is -0.52 0.7; allowed: LOW HIGH in degrees");
  EXPECT_FALSE(fs::exists(folder_ / "d.panonav"));
  write_text(data() / "dataset.toml",
             "[images]\nkind = \"panorama\"\nelevation_deg = [-0.35, 0.35]\n[poses]\nfile = "
             "\"poses.csv\"\n");
  const auto radians_there = run_panonav({"memorise", folder_ / "e.panonav", data()});
  EXPECT_EQ(radians_there.exit_code, 0);
  EXPECT_TRUE(contains(radians_there.err, "is -0.35 to 0.35 degrees; are these radians?"));
}

TEST_F(Memorise, AFolderWithoutDatasetTomlNeedsAKind) {
  fs::remove(data() / "dataset.toml");
  expect_refusal({"memorise", memory(), data()}, "--kind");
  EXPECT_FALSE(fs::exists(memory()));
}

TEST_F(Memorise, ForgetDropsViewsByNameAndRefusesUnknownOnes) {
  run_well({"memorise", memory(), data()});
  expect_refusal({"forget", memory(), view_name(2), "never_seen.png"}, "never_seen.png");
  EXPECT_EQ(views_in(memory()), 16) << "a refused forget must forget nothing";
  run_well({"forget", memory(), view_name(2), view_name(3)});
  EXPECT_EQ(views_in(memory()), 14);
}

TEST_F(Memorise, OptionsComeFromFlagsAndFromAFile) {
  write_text(folder_ / "options.toml", "[signature]\ncomponents = 7\n");
  run_well({"memorise", memory(), data(), "--config", folder_ / "options.toml"});
  EXPECT_EQ(info_of(memory())["components"], 7);
  const std::string other = folder_ / "other.panonav";
  run_well({"memorise", other, data(), "--config", folder_ / "options.toml", "--components", "5"});
  EXPECT_EQ(info_of(other)["components"], 5);
}

TEST_F(Memorise, WrongOptionsInAFileAreRefusedByName) {
  const std::string config = folder_ / "options.toml";
  const std::vector<std::pair<std::string, std::vector<std::string>>> wrong{
      {"[signature]\ncomponentz = 7\n", {"options.toml", "componentz"}},
      {"[signatures]\ncomponents = 7\n", {"signatures"}},
      {"[signature]\ncomponents = 0\n", {"components"}},
      {"not toml [", {"options.toml"}}};
  for (const auto& [text, words] : wrong) {
    write_text(config, text);
    const auto line = refusal({"memorise", memory(), data(), "--config", config});
    for (const auto& word : words) EXPECT_TRUE(contains(line, word));
  }
  expect_refusal({"memorise", memory(), data(), "--config", folder_ / "no.toml"}, "no.toml");
  EXPECT_FALSE(fs::exists(memory()));
}

TEST_F(Memorise, WhatWasForgottenComesBackWithUndo) {
  run_well({"memorise", memory(), data()});
  expect_refusal({"undo", memory()}, "contains no change that can be reverted");
  const auto shown =
      answer_of({"forget", memory(), view_name(2), view_name(3), "--dry-run", "--json"});
  EXPECT_EQ(shown["forgotten"], 2);
  EXPECT_EQ(shown["views"], 14);
  EXPECT_EQ(views_in(memory()), 16) << "--dry-run must forget nothing";
  const auto before = run_panonav({"localise", memory(), data(), "--json"});
  run_well({"forget", memory(), view_name(2), view_name(3)});
  EXPECT_EQ(views_in(memory()), 14);
  EXPECT_EQ(answer_of({"undo", memory(), "--dry-run", "--json"})["views"], 14);
  const auto undone = answer_of({"undo", memory(), "--json"});
  EXPECT_EQ(undone["views"], 16);
  EXPECT_EQ(undone["undone"], "forget: 2 views deleted");
  EXPECT_EQ(run_panonav({"localise", memory(), data(), "--json"}).out, before.out);
  expect_refusal({"undo", memory()}, "contains no change that can be reverted");
  run_well({"verify", memory()});

  const auto dry = answer_of({"prune", memory(), "--max-difference", "0.5", "--dry-run", "--json"});
  const auto pruned = answer_of({"prune", memory(), "--max-difference", "0.5", "--json"});
  EXPECT_EQ(pruned["dropped"], dry["dropped"]);
  ASSERT_GT(pruned["dropped"].size(), 0U);
  EXPECT_EQ(views_in(memory()), 16 - static_cast<int>(pruned["dropped"].size()));
  run_well({"undo", memory()});
  EXPECT_EQ(run_panonav({"localise", memory(), data(), "--json"}).out, before.out);
}

// Without room for a part of it, `prune` changes nothing.
TEST_F(Memorise, PruneIsAllOrNothing) {
  run_well({"memorise", memory(), data()});
  run_well({"arrange", memory()});
  const std::string whole = bytes_of(memory());
  const auto links = info_of(memory())["links"];
  ASSERT_GT(links, 0);
  int refused = 0;
  for (std::uint64_t more = 0; more < 400000; more += 12000) {
    write_text(memory(), whole);
    const auto result = run_panonav({"prune", memory(), "--max-difference", "0.5"},
                                    {.file_size_limit_bytes = 8192 + more, .kill_after_ms = {}});
    if (result.exit_code == 0) break;
    ++refused;
    EXPECT_EQ(lines(result.err).size(), 1U) << result.err;
    EXPECT_EQ(views_in(memory()), 16);
    EXPECT_EQ(info_of(memory())["links"], links);
  }
  EXPECT_GT(refused, 2);
  EXPECT_LT(views_in(memory()), 16);
}

TEST_F(Memorise, AMemoryThatIsTakenAwayIsNoticed) {
  write_dataset(data(), world_, grid_poses(18));
  for (const bool replaced : {false, true}) {
    run_well({"memorise", folder_ / "other.panonav", data() / view_name(0), "--kind", "panorama"});
    std::thread thief([&] {
      std::error_code missing;  // until the first views are there
      while (fs::file_size(memory() + "-wal", missing) + 1 < 20000) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      if (replaced) {
        fs::rename(folder_ / "other.panonav", memory());
      } else {
        fs::remove(memory());
      }
    });
    const auto line = refusal({"memorise", memory(), data()});
    thief.join();
    EXPECT_TRUE(
        contains(line, "m.panonav: was deleted, moved or replaced while it was being written"));
    for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(memory() + suffix);
  }
}

// A name that the system refuses gives one line; bytes that are not UTF-8 are escaped.
TEST_F(Memorise, NamesThatAreTooLongOrNotUtf8) {
  const std::string long_name(300, 'n');
  for (const auto& arguments : std::vector<std::vector<std::string>>{
           {"memorise", folder_ / (long_name + ".panonav"), data()},
           {"memorise", memory(), folder_ / long_name},
           {"map", folder_ / long_name, data()},
           {"route", "record", folder_ / long_name, data()},
           {"info", folder_ / long_name},
           {"forget", folder_ / long_name, view_name(1)}}) {
    const auto line = refusal(arguments);
    EXPECT_TRUE(contains(line, long_name)) << arguments.front();
    EXPECT_EQ(line.find("internal error of the program"), std::string::npos);
  }
  fs::remove(data() / "dataset.toml");
  fs::remove(data() / "poses.csv");
  const std::string latin = "caf\xE9.png";
  const std::string control = "a\x1B[2J\nb.png";
  fs::rename(data() / view_name(1), data() / latin);
  fs::rename(data() / view_name(2), data() / control);
  const std::vector<std::string> kind{"--kind", "panorama"};
  run_well(with({"memorise", memory(), data()}, kind));
  EXPECT_EQ(views_in(memory()), 16);
  const auto found = answers_of({"localise", memory(), data() / latin, "--json"});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0]["matches"][0]["file"], "caf%E9.png");
  const auto text = run_panonav({"localise", memory(), data()});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_EQ(text.out.find('\x1B'), std::string::npos);
  EXPECT_EQ(text.out.find('\xE9'), std::string::npos);
  EXPECT_TRUE(contains(text.out, "caf%E9.png"));
  for (const auto& arguments : std::vector<std::vector<std::string>>{
           {"arrange", memory(), "--json", "--graphml", folder_ / "g.graphml"},
           {"prune", memory(), "--dry-run", "--max-difference", "0.5", "--json"},
           {"verify", memory(), "--json"},
           {"info", memory(), "--json"},
           {"forget", memory(), latin, control, "--json"},
           {"undo", memory(), "--json"}}) {
    SCOPED_TRACE(arguments.front());
    EXPECT_TRUE(answer_of(arguments).is_object());
  }
  const auto refused = refusal({"forget", memory(), "\xFF\xFE"});
  EXPECT_EQ(refused.find('\xFF'), std::string::npos);
  const std::string odd_memory = folder_ / "m\xE9moire.panonav";
  EXPECT_EQ(answer_of(with({"memorise", odd_memory, data(), "--json"}, kind))["views"], 16);
}

}  // namespace
}  // namespace panonav::testing
