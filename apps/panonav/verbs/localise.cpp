#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/localisation/hierarchical.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"
#include "verbs/recording.hpp"

namespace panonav::command {

namespace {

using nlohmann::ordered_json;

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
  Localisation localisation;
  std::vector<LocalisationLevel> levels;  ///< only when asked for
};

ordered_json optional_number(const std::optional<double>& value) {
  return value ? ordered_json(*value) : ordered_json();
}

ordered_json as_json(const Answer& answer, const VisualMemory& memory, bool areas) {
  const auto& found = answer.localisation;
  auto matches = ordered_json::array();
  for (const auto& match : found.matches) {
    const auto& compass = match.compass;
    matches.push_back(
        {{"file", memory.info(match.view).name},
         {"dissimilarity", match.dissimilarity},
         {"column_difference", match.column_difference},
         {"heading_rad", compass ? ordered_json(compass->heading_rad) : ordered_json()}});
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
    json["position"] = {{"x_m", found.position->position.x_m},
                        {"y_m", found.position->position.y_m},
                        {"radius_m", optional_number(found.position->radius_m)}};
  }
  if (areas) {
    auto levels = ordered_json::array();
    for (const auto& level : answer.levels) {
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

std::string as_text(const Answer& answer, const VisualMemory& memory, Session& session) {
  const auto& found = answer.localisation;
  std::string line = answer.file + "  ";
  if (found.matches.empty()) return line + session.bad("nothing to compare with");
  const auto& nearest = memory.info(found.matches.front().view).name;
  if (!found.known) {
    return line + session.bad("unknown place") + "  (most alike: " + nearest + ")";
  }
  line += session.good("near " + nearest);
  if (found.position) {
    line += "  x " + fixed(found.position->position.x_m, 2) + " m  y " +
            fixed(found.position->position.y_m, 2) + " m";
    if (found.position->radius_m) line += "  within " + fixed(*found.position->radius_m, 2) + " m";
  }
  if (found.heading_rad) {
    line += "  heading " + fixed(degrees(*found.heading_rad), 1) + " degrees";
  } else if (const auto& compass = found.matches.front().compass) {
    line += "  turned " + fixed(degrees(compass->heading_rad), 1) + " degrees from it";
  }
  for (const auto& level : answer.levels) {
    line += "\n    " + std::to_string(level.components) +
            (level.components == 1 ? " component: " : " components: ") +
            std::to_string(level.candidates.size()) +
            (level.candidates.size() == 1 ? " view" : " views");
    if (level.area_m2) line += ", " + fixed(*level.area_m2, 2) + " m2";
    if (level.region) line += ", within " + fixed(level.region->radius_m, 2) + " m";
  }
  return line;
}

/// Everything that answers queries, read once.
class Answerer {
 public:
  Answerer(const LocaliseArguments& wanted, const MemoryHeader& header, const VisualMemory& memory,
           const PictureSource& source)
      : wanted_(wanted),
        memory_(memory),
        pipeline_(header, source),
        localiser_(memory, wanted.localiser) {
    if (wanted.areas) areas_.emplace(memory);
  }

  [[nodiscard]] Answer answer(const DatasetEntry& entry, std::size_t index) const {
    Answer answer{entry.file, 0.0, {}, {}};
    auto panorama = pipeline_.read(entry);
    if (wanted_.turn_seed) {
      Random random(*wanted_.turn_seed, index);
      const auto columns = static_cast<std::uint64_t>(panorama.columns());
      const auto turned = static_cast<int>(random.index(columns));
      panorama = turn_columns(panorama, turned);
      answer.turned_rad =
          wrap_angle(2.0 * std::numbers::pi * turned / static_cast<double>(columns));
    }
    const auto query = pipeline_.packed(panorama);
    std::vector<ViewId> excluded;
    if (wanted_.exclude_same_file) {
      if (const auto same = memory_.find(entry.file)) excluded.push_back(*same);
    }
    const SearchMask mask{excluded, {}};
    answer.localisation = localiser_.localise(query, mask);
    if (areas_) {
      answer.levels = localise_hierarchically(memory_, *areas_, query, wanted_.accuracy, mask);
    }
    return answer;
  }

 private:
  const LocaliseArguments& wanted_;
  const VisualMemory& memory_;
  ViewEncoder pipeline_;
  Localiser localiser_;
  std::optional<ReferenceAreas> areas_;
};

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
  const auto memory = file.load();
  if (memory.empty()) throw FileError(wanted.memory, "holds no view; memorise a recording first");
  const auto recording = open_recording(wanted.input, wanted.pictures, file.header().source);
  const Answerer answerer(wanted, file.header(), memory, recording.source);

  const std::size_t total = recording.entries.size();
  Progress progress("localising", total);
  std::size_t known = 0;
  constexpr std::size_t batch = 32;
  for (std::size_t begin = 0; begin < total; begin += batch) {
    const std::size_t count = std::min(batch, total - begin);
    std::vector<std::optional<Answer>> answers(count);
    for_each_entry(session.executor(), count, [&](std::size_t i) {
      answers[i] = answerer.answer(recording.entries[begin + i], begin + i);
    });
    progress.clear();
    for (const auto& answer : answers) {
      known += answer->localisation.known ? 1 : 0;
      session.print(session.json() ? as_json(*answer, memory, wanted.areas).dump()
                                   : as_text(*answer, memory, session));
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
