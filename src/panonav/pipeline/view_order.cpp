#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/pipeline/memory_map.hpp"

namespace panonav {

namespace {

/// Parameter of the views at which paths begin.
constexpr const char* path_starts_parameter = "path_starts";

}  // namespace

bool are_in_order(const VisualMemory& views) {
  constexpr std::size_t max_tested = 200;
  const auto ids = views.views();
  if (ids.size() < 3) return false;
  const std::size_t steps = ids.size() - 1;
  const std::size_t every = (steps + max_tested - 1) / max_tested;
  const std::size_t top = std::max<std::size_t>(1, ids.size() / 10);
  std::size_t tested = 0;
  std::size_t similar = 0;
  double gain = 0.0;
  double largest_gain = 0.0;
  double rank = 0.0;  // mean of the ranks of the next views, 0 .. 1
  for (std::size_t i = 0; i < steps; i += every) {
    const std::array self{ids[i]};
    const auto others = views
                            .search(views.packed(ids[i]), {.top = static_cast<int>(steps)},
                                    {.excluded_views = self})
                            .matches;
    const auto next = std::ranges::find(others, ids[i + 1], &Match::view);
    ++tested;
    const auto before = static_cast<std::size_t>(next - others.begin());
    similar += before < top ? 1 : 0;
    rank += static_cast<double>(before) / static_cast<double>(others.size() - 1);
    double sum = 0.0;
    for (const Match& other : others) sum += other.dissimilarity;
    const double average = sum / static_cast<double>(others.size());
    gain += average - next->dissimilarity;
    largest_gain += average - 0.5 * (others[0].dissimilarity + others[1].dissimilarity);
  }
  const double chance = static_cast<double>(top) / static_cast<double>(steps);
  const double by_chance = static_cast<double>(tested) * chance;
  const bool is_significant =
      static_cast<double>(similar) > by_chance + 3.0 * std::sqrt(by_chance * (1.0 - chance));
  // A random step has a rank of 0.5 on average, so at most two of five steps are random.
  constexpr double max_rank = 0.2;
  return is_significant &&
         (2.0 * gain >= largest_gain || rank <= max_rank * static_cast<double>(tested));
}

std::vector<ViewId> read_path_starts(const MemoryFile& memory) {
  const std::string text = memory.parameter(path_starts_parameter).value_or("");
  std::vector<ViewId> starts;
  for (const std::string& word : split_words(text)) {
    ViewId start;
    if (!read_number(word, start.value) || (!starts.empty() && start <= starts.back())) {
      throw FileError(memory.path().string(), std::string("parameter ") + path_starts_parameter +
                                                  " has '" + to_readable_line(word) +
                                                  "'; allowed: ascending ids of views");
    }
    starts.push_back(start);
  }
  return starts;
}

void add_path_starts(MemoryFile& memory, std::span<const ViewId> starts) {
  if (starts.empty()) return;
  const std::vector<ViewId> before = read_path_starts(memory);
  std::set<ViewId> all(before.begin(), before.end());
  all.insert(starts.begin(), starts.end());
  std::string text;
  for (const ViewId start : all) text += (text.empty() ? "" : " ") + std::to_string(start.value);
  memory.set_parameter(path_starts_parameter, text);
}

}  // namespace panonav
