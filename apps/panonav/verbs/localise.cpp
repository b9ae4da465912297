#include <cmath>
#include <memory>
#include <numbers>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "verbs/recording.hpp"

namespace panonav::command {

namespace {

struct LocaliseArguments {
  std::string memory;
  std::string input;
  PictureArguments pictures;
  LocaliserOptions localiser;
  WantedAccuracy accuracy;
  std::optional<std::uint64_t> turn_seed;
  bool exclude_same_file = false;
  bool areas = false;
};

/// One query with everything that is said about it.
struct Answer {
  std::string file;
  double turned_rad = 0.0;
  Place place;
};

ordered_json optional_number(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json as_json(const Answer& answer, bool areas) {
  const Place& found = answer.place;
  auto matches = ordered_json::array();
  for (const PlaceMatch& match : found.matches) {
    matches.push_back({{"file", match.name},
                       {"dissimilarity", match.dissimilarity},
                       {"column_difference", match.column_difference},
                       {"heading_rad", optional_number(match.heading_rad)}});
  }
  ordered_json json{{"file", answer.file},
                    {"known", found.known},
                    {"matches", std::move(matches)},
                    {"position", nullptr},
                    {"heading_rad", optional_number(found.heading_rad)},
                    {"components", found.components},
                    {"bytes_read", found.bytes_read},
                    {"turned_rad", answer.turned_rad}};
  if (found.position) {
    json["position"] = {{"x_m", found.position->x_m},
                        {"y_m", found.position->y_m},
                        {"radius_m", optional_number(found.position->radius_m)}};
  }
  if (areas) {
    auto levels = ordered_json::array();
    for (const auto& level : found.areas) {
      levels.push_back(
          {{"components", level.components},
           {"candidates", level.candidates.size()},
           {"area_m2", optional_number(level.area_m2)},
           {"radius_m", level.region ? ordered_json(level.region->radius_m) : ordered_json()},
           {"bytes_read", level.bytes_read}});
    }
    json["areas"] = std::move(levels);
  }
  return json;
}

std::string as_text(const Answer& answer, Session& session) {
  const Place& found = answer.place;
  std::string line = answer.file + "  ";
  if (found.matches.empty()) return line + session.bad("nothing to compare with");
  const PlaceMatch& nearest = found.matches.front();
  if (!found.known) {
    return line + session.bad("unknown place") + "  (most similar: " + nearest.name + ")";
  }
  line += session.good("near " + nearest.name);
  if (found.position) {
    line +=
        "  x " + fixed(found.position->x_m, 2) + " m  y " + fixed(found.position->y_m, 2) + " m";
    if (found.position->radius_m) line += "  within " + fixed(*found.position->radius_m, 2) + " m";
  }
  if (found.heading_rad) {
    line += "  heading " + fixed(degrees(*found.heading_rad), 1) + " degrees";
  } else if (nearest.heading_rad) {
    line += "  turned " + fixed(degrees(*nearest.heading_rad), 1) + " degrees from it";
  }
  for (const auto& level : found.areas) {
    line += "\n    " + std::to_string(level.components) +
            (level.components == 1 ? " component: " : " components: ") +
            std::to_string(level.candidates.size()) +
            (level.candidates.size() == 1 ? " view" : " views");
    if (level.area_m2) line += ", " + fixed(*level.area_m2, 2) + " m2";
    if (level.region) line += ", within " + fixed(level.region->radius_m, 2) + " m";
  }
  return line;
}

Answer answer(const PlaceRecogniser& recogniser, const LocaliseArguments& wanted,
              const DatasetEntry& entry, std::size_t index) {
  Answer answer{entry.file, 0.0, {}};
  Observation seen = read_observation(entry);
  if (wanted.turn_seed) {
    const Panorama panorama = recogniser.encoder().panorama(seen);
    Random random(*wanted.turn_seed, index);
    const auto columns = static_cast<std::uint64_t>(panorama.columns());
    const auto turned = static_cast<int>(random.index(columns));
    seen.picture = turn_columns(panorama, turned);
    answer.turned_rad = wrap_angle(2.0 * std::numbers::pi * turned / static_cast<double>(columns));
  }
  answer.place =
      recogniser.localise(seen, std::span(&entry.file, wanted.exclude_same_file ? 1 : 0));
  return answer;
}

void check(const Arguments& arguments, const LocaliseArguments& wanted,
           const MemoryHeader& header) {
  const int components = wanted.localiser.components;
  const bool zero = components == 0 && arguments.given("localiser", "components");
  if (zero || components > header.shape.components) {
    throw ContractError("components", components,
                        "1 to " + std::to_string(header.shape.components) + ", the memory's");
  }
}

ExitCode localise(const Arguments& arguments, const LocaliseArguments& wanted, Session& session) {
  const auto file = MemoryFile::open(wanted.memory, Access::read_only);
  check(arguments, wanted, file.header());
  const auto recording =
      open_recording(wanted.input, wanted.pictures, file.header().source, session);
  const PlaceRecogniser recogniser(
      file, {.localiser = wanted.localiser,
             .source = recording.source,
             .areas = wanted.areas ? std::optional(wanted.accuracy) : std::nullopt});

  const std::size_t total = recording.entries.size();
  Progress progress("localising", total);
  std::size_t known = 0;
  constexpr std::size_t batch = 32;
  for (std::size_t begin = 0; begin < total; begin += batch) {
    const std::size_t count = std::min(batch, total - begin);
    std::vector<std::optional<Answer>> answers(count);
    for_each_entry(session.executor(), count, [&](std::size_t i) {
      answers[i] = answer(recogniser, wanted, recording.entries[begin + i], begin + i);
    });
    progress.clear();
    for (const auto& given : answers) {
      known += given->place.known ? 1 : 0;
      session.print(session.json() ? json_line(as_json(*given, wanted.areas))
                                   : as_text(*given, session));
    }
    progress.advance(count);
  }
  if (!session.json() && total > 1) {
    session.print(session.strong(std::to_string(known) + " of " + std::to_string(total)) +
                  " views show a place of " + wanted.memory);
  }
  return known > 0 ? ExitCode::done : ExitCode::no_answer;
}

Run declare(Arguments& arguments) {
  auto wanted = std::make_shared<LocaliseArguments>();
  arguments.positional("MEMORY", wanted->memory, "Memory file");
  arguments.positional("INPUT", wanted->input, "Data set, folder of pictures, or one picture");
  declare_pictures(arguments, wanted->pictures);
  arguments.flag("--exclude-same-file", wanted->exclude_same_file,
                 "Leave out the reference view of the same file name (leave-one-out)");
  arguments.option("--turn-randomly", wanted->turn_seed,
                   "Turn the robot before each query by a random number of whole columns; "
                   "turned_rad is the turn, counter-clockwise positive. SEED");
  arguments.flag("--areas", wanted->areas,
                 "Also show the area where the robot may be, component by component");
  arguments.options("localiser", wanted->localiser);
  arguments.options("accuracy", wanted->accuracy, "area");
  return [wanted, &arguments](Session& session) { return localise(arguments, *wanted, session); };
}

}  // namespace

Verb localise_verb() {
  return {
      "localise", "Tell where pictures were taken and which way the robot faced",
      "Pictures without a dataset.toml are read as those that the memory was made from. Ends with "
      "1\n"
      "when no picture shows a place of the memory.",
      "  panonav localise office.panonav query_run\n"
      "  panonav localise office.panonav view.png --json\n"
      "  panonav localise office.panonav office_run --exclude-same-file --turn-randomly 7 --json",
      declare};
}

}  // namespace panonav::command
