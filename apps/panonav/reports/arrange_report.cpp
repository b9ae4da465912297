#include "reports/arrange_report.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "panonav/core/text.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "reports/lattice_picture.hpp"

namespace panonav::command {

namespace {

using Springs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Those that hold, at most two of each view where there are many.
Springs shown_springs(const Lattice& lattice) {
  constexpr std::size_t many = 1500;
  std::vector<const Lattice::Spring*> all;
  for (const Lattice::Spring& spring : lattice.springs) {
    if (spring.weight >= 0.25) all.push_back(&spring);
  }
  const bool thin = all.size() > many;
  if (thin) std::ranges::stable_sort(all, {}, [](const auto* spring) { return spring->length; });
  std::vector<int> of(lattice.nodes.size(), 0);
  Springs shown;
  for (const Lattice::Spring* spring : all) {
    if (thin && of[spring->a] >= 2 && of[spring->b] >= 2) continue;
    ++of[spring->a];
    ++of[spring->b];
    shown.emplace_back(spring->a, spring->b);
  }
  return shown;
}

/// Each group moved, turned and scaled to where its views end; empty for those of one or two, which
/// have no shape.
std::vector<std::optional<Point2>> laid_over(const std::vector<Pose2>& poses,
                                             const std::vector<std::size_t>& components,
                                             const std::vector<std::optional<Point2>>& end) {
  std::map<std::size_t, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (end[i]) groups[components[i]].push_back(i);
  }
  std::vector<std::optional<Point2>> places(poses.size());
  for (const auto& [unused, views] : groups) {
    std::vector<Point2> from;
    std::vector<Point2> to;
    for (const std::size_t view : views) {
      from.push_back(poses[view].position());
      to.push_back(*end[view]);
    }
    if (!is_comparable(from, to)) continue;
    const Alignment end_from_step = align(from, to, {.allow_scale = true});
    for (const std::size_t view : views) {
      places[view] = end_from_step.apply(poses[view].position());
    }
  }
  return places;
}

}  // namespace

LatticeWatch LatticeSteps::watch() {
  constexpr std::size_t most = 200;
  return [this](std::span<const Pose2> poses, std::span<const std::size_t> components) {
    const std::size_t number = count_++;
    if (number % every_ != 0) return;
    steps_.push_back(
        {number, {poses.begin(), poses.end()}, {components.begin(), components.end()}});
    if (steps_.size() < most) return;
    every_ *= 2;
    std::erase_if(steps_, [this](const Step& step) { return step.number % every_ != 0; });
  };
}

viewer::UnfoldingMap LatticeSteps::unfold(const Lattice& lattice,
                                          const VisualMemory& memory) const {
  const auto end = places_of(lattice, memory);
  const Springs springs = shown_springs(lattice);
  constexpr std::size_t numbers = 600'000;
  const std::size_t each = 1 + 2 * lattice.nodes.size() + 4 * springs.size();
  const std::size_t frames = std::clamp<std::size_t>(numbers / each, 10, 100);
  viewer::UnfoldingMap map{.title = "The arrangement as it unfolds"};
  const std::string of = " of " + std::to_string(count_);
  const auto add = [&](const std::string& title, const std::vector<std::optional<Point2>>& places,
                       const std::vector<std::size_t>& components) {
    // The group that most views of the largest component are in.
    std::map<std::size_t, std::size_t> sizes;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i]) ++sizes[components[i]];
    }
    const auto largest =
        std::ranges::max_element(sizes, {}, [](const auto& entry) { return entry.second; });
    viewer::MapLayer held{.label = "springs", .colour = viewer::PlotColour::light_grey};
    viewer::MapLayer views{.label = "largest group", .colour = viewer::PlotColour::blue};
    viewer::MapLayer others{.label = "other groups", .colour = viewer::PlotColour::orange};
    for (const auto& [a, b] : springs) {
      if (!places[a] || !places[b] || components[a] != components[b]) continue;
      held.lines.push_back({*places[a], *places[b]});
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!places[i]) continue;
      (components[i] == largest->first ? views : others).circles.push_back(*places[i]);
    }
    map.frames.push_back({.title = title, .layers = {held, others, views}});
    if (!lattice.metric && !is_known(lattice, memory)) {
      map.frames.back().unit = "median distance to the nearest view";
    }
  };
  const std::size_t step = steps_.size() / frames + 1;
  for (std::size_t i = 0; i < steps_.size(); i += step) {
    add("step " + std::to_string(steps_[i].number + 1) + of,
        laid_over(steps_[i].poses, steps_[i].components, end), steps_[i].components);
  }
  std::vector<std::size_t> components;
  for (const Lattice::Node& node : lattice.nodes) components.push_back(node.component);
  add("the arrangement", end, components);
  return map;
}

void write_arrange_report(const std::filesystem::path& folder, const std::string& name,
                          const Lattice& lattice, const VisualMemory& memory,
                          const LatticeSteps& steps) {
  viewer::ReportPage page(
      "How do the places lie?",
      "The " + std::to_string(lattice.nodes.size()) + " views of " + name +
          " in no order. From their similarity alone follows which lie near each "
          "other and in which direction, and from that how all of them lie.");
  const auto& components = lattice.components;
  std::vector<std::pair<std::string, std::string>> figures{
      {std::to_string(components.front().views) + " of " + std::to_string(lattice.nodes.size()),
       "views in the largest group that holds together"}};
  const auto comparison = compare_with_ground_truth(lattice, memory);
  if (comparison) {
    figures.emplace_back(format_fixed(comparison->rms_m, 2) + " m",
                         "from the true places, root mean square, after the best alignment");
    figures.emplace_back(format_fixed(comparison->shape_difference, 4),
                         "Procrustes disparity (shape difference): 0 the same shape, 1 none");
    if (comparison->trustworthiness) {
      figures.emplace_back(format_fixed(100.0 * *comparison->trustworthiness, 0) + " %",
                           "trustworthiness: neighbours on the map that truly are");
    }
  }
  page.add_figures(figures);
  page.begin_section("Step by step");
  page.add_text(
      "Groups grow where views are certain to belong together, and join where both agree how they "
      "lie. Each group is drawn over where it ends, in the shape that it has at that step.");
  page.add_plots(
      {{steps.unfold(lattice, memory),
        "Grey lines are springs: pairs of views that tell how far and in which direction "
        "the other one is"}});
  if (comparison) {
    page.begin_section("Beside the true places");
    page.add_text(
        "True places were not used; they only turn, move and scale the arrangement so that both "
        "can be compared.");
    std::vector<viewer::ReportPlot> plots;
    for (viewer::MapPlot& plot : lattice_plots(lattice, memory))
      plots.push_back({std::move(plot), ""});
    plots.front().caption = "Where the views were taken";
    plots.back().caption = "Where their similarity puts them";
    page.add_plots(plots);
  }
  page.begin_section("Groups");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < std::min<std::size_t>(20, components.size()); ++i) {
    rows.push_back({std::to_string(i + 1), std::to_string(components[i].views),
                    components[i].handedness_known ? "yes" : "no: may be the mirror image"});
  }
  page.add_table({"group", "views", "left and right told apart"}, rows);
  if (rows.size() < components.size()) {
    page.add_text("The largest 20 of " + std::to_string(components.size()) + " groups.");
  }
  page.write(folder, "index.html", "panonav arrange");
}

}  // namespace panonav::command
