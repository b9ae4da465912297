#include "lab/s06/support.hpp"

#include <cstdint>

#include "panonav/homing/homing_pursuit.hpp"

namespace panonav::lab {

namespace {

constexpr std::array<int, 6> own_stages{1, 2, 3, 4, 6, 10};
constexpr int own_rounds = 3;
constexpr int own_highest = 10;

std::string join_numbers(std::span<const int> numbers) {
  std::string text;
  for (const int number : numbers) {
    text += (text.empty() ? "" : ", ") + std::to_string(number);
  }
  return text;
}

}  // namespace

HomingStrategy make_published_strategy(std::vector<int> highest) {
  std::string label = "K = " + join_numbers(highest);
  return {std::move(label), HomingStrategy::Rule::published, std::move(highest)};
}

HomingStrategy make_own_strategy() {
  return {"a chain of 20 stages", HomingStrategy::Rule::own, {}};
}

HomingStrategy make_library_strategy() {
  return {"the library's rule", HomingStrategy::Rule::library, {}};
}

HomingStrategy make_expected_image_strategy() {
  return {"expected images", HomingStrategy::Rule::expected_images, {}};
}

ArenaSurveys::ArenaSurveys(const Arena& arena, std::size_t goal_stride, Executor& executor)
    : arena_(arena),
      goal_stride_(goal_stride),
      executor_(executor),
      expected_image_homing_(s06_columns) {}

template <typename Rule>
const HomingSurvey& ArenaSurveys::survey(const std::string& key, const Rule& rule) {
  const auto at = surveys_.find(key);
  if (at != surveys_.end()) return at->second;
  return surveys_.emplace(key, survey_arena(arena_, rule, executor_, goal_stride_)).first->second;
}

const HomingSurvey& ArenaSurveys::survey_published(int highest, int iterations) {
  const std::string key = "published " + std::to_string(highest) + " " + std::to_string(iterations);
  return survey(key, published_homing_options(highest, iterations));
}

const HomingSurvey& ArenaSurveys::survey_own(int highest) {
  return survey("own " + std::to_string(highest), FourierHomingOptions{.highest = highest});
}

const HomingSurvey& ArenaSurveys::survey_own_without_search(int highest) {
  const FourierHomingOptions coarse{.highest = highest, .displacement_search = false};
  const FourierHomingOptions fine{.highest = own_highest, .displacement_search = false};
  const auto rule = [&](std::size_t goal, std::size_t place) {
    const HomingView& home = arena_.homes.views[goal].view;
    const HomingView& current = arena_.currents.views[place].view;
    const bool is_similar =
        image_difference(home, current, own_highest) < s06_max_similar_difference;
    return home_vector_unchecked(home, current, is_similar ? fine : coarse);
  };
  return survey("own again " + std::to_string(highest), HomingRule(rule));
}

const HomingSurvey& ArenaSurveys::survey_expected_images() {
  return survey("expected images", expected_image_homing_);
}

std::vector<const HomingSurvey*> ArenaSurveys::survey_stages(const HomingStrategy& strategy) {
  if (strategy.rule == HomingStrategy::Rule::expected_images) return {&survey_expected_images()};
  std::vector<const HomingSurvey*> stages;
  if (strategy.rule == HomingStrategy::Rule::own) {
    stages.push_back(&survey_own(own_highest));
    for (int round = 0; round < own_rounds; ++round) {
      for (const int highest : own_stages) stages.push_back(&survey_own_without_search(highest));
    }
    stages.push_back(&survey_own(own_highest));
  }
  if (strategy.rule == HomingStrategy::Rule::library) {
    const HomingPursuitOptions options;
    for (const int highest : {0, options.coarse, options.middle, 0}) {
      stages.push_back(&survey_own(highest));
    }
  }
  for (const int highest : strategy.highest) stages.push_back(&survey_published(highest));
  return stages;
}

std::vector<float> ArenaSurveys::compute_library_distances() {
  const auto stages = survey_stages(make_library_strategy());
  const double arrived_difference = HomingPursuitOptions{}.arrived_difference;
  const HomingSurvey& first = *stages.front();
  const std::size_t places = first.places.size();
  std::vector<float> distances(first.goals.size() * places);
  executor_.for_each_chunk(
      first.goals.size(), 16, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t g = begin; g < end; ++g) {
          const HomingView& home = arena_.homes.views[g * goal_stride_].view;
          std::vector<std::vector<std::uint32_t>> ends;
          for (std::size_t k = 1; k <= stages.size(); ++k) {
            ends.push_back(final_places(std::span(stages).first(k), g, survey_options(arena_)));
          }
          for (std::size_t p = 0; p < places; ++p) {
            std::size_t stage = 0;
            while (stage + 1 < stages.size() &&
                   image_difference(home, arena_.currents.views[ends[stage][p]].view) >
                       arrived_difference) {
              ++stage;
            }
            distances[g * places + p] = static_cast<float>(
                distance(first.goals[g].position(), first.places[ends[stage][p]].position()));
          }
        }
      });
  return distances;
}

std::vector<float> ArenaSurveys::compute_final_distances(const HomingStrategy& strategy) {
  if (strategy.rule == HomingStrategy::Rule::library) return compute_library_distances();
  return final_distances(survey_stages(strategy), survey_options(arena_), executor_);
}

std::vector<float> ArenaSurveys::compute_final_distances(
    std::span<const HomingSurvey* const> stages) {
  return final_distances(stages, survey_options(arena_), executor_);
}

std::vector<double> ArenaSurveys::compute_areas(const HomingStrategy& strategy,
                                                std::span<const double> accepted_m) {
  return mean_catchment_areas(compute_final_distances(strategy),
                              survey_stages(strategy).front()->goals.size(), accepted_m);
}

}  // namespace panonav::lab
