#include "reports/arrange_report.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav/pipeline/arrangement.hpp"
#include "reports/lattice_picture.hpp"

namespace panonav::command {

namespace {

using Springs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Selects the springs that were not rejected. If there are more than 1500, a spring is dropped if
/// both its views already have two shorter springs.
Springs choose_springs(const Lattice& lattice) {
  constexpr std::size_t max_unthinned_springs = 1500;
  std::vector<const Lattice::Spring*> all;
  for (const Lattice::Spring& spring : lattice.springs) {
    if (spring.weight >= min_spring_weight) all.push_back(&spring);
  }
  const bool is_thinned = all.size() > max_unthinned_springs;
  if (is_thinned)
    std::ranges::stable_sort(all, {}, [](const auto* spring) { return spring->length; });
  std::vector<int> spring_counts(lattice.nodes.size(), 0);
  Springs shown;
  for (const Lattice::Spring* spring : all) {
    if (is_thinned && spring_counts[spring->a] >= 2 && spring_counts[spring->b] >= 2) continue;
    ++spring_counts[spring->a];
    ++spring_counts[spring->b];
    shown.emplace_back(spring->a, spring->b);
  }
  return shown;
}

/// Moves, rotates and scales each part to the final positions of its views. Views of parts that
/// are too small for this get nullopt.
std::vector<std::optional<Point2>> align_to_end(const std::vector<Pose2>& poses,
                                                const std::vector<std::size_t>& components,
                                                const std::vector<std::optional<Point2>>& end) {
  std::map<std::size_t, std::vector<std::size_t>> parts;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (end[i]) parts[components[i]].push_back(i);
  }
  std::vector<std::optional<Point2>> places(poses.size());
  for (const auto& [unused, views] : parts) {
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

LatticeStepCallback LatticeSteps::step_callback() {
  constexpr std::size_t max_steps = 200;
  return [this](std::span<const Pose2> poses, std::span<const std::size_t> components) {
    const std::size_t number = count_++;
    if (number % every_ != 0) return;
    steps_.push_back(
        {number, {poses.begin(), poses.end()}, {components.begin(), components.end()}});
    if (steps_.size() < max_steps) return;
    every_ *= 2;
    std::erase_if(steps_, [this](const Step& step) { return step.number % every_ != 0; });
  };
}

viewer::MapAnimation LatticeSteps::make_animation(const Lattice& lattice,
                                                  const VisualMemory& memory) const {
  const auto end = align_to_truth(lattice, memory);
  const Springs springs = choose_springs(lattice);
  constexpr std::size_t max_coordinates = 600'000;
  const std::size_t coordinates_per_frame = 1 + 2 * lattice.nodes.size() + 4 * springs.size();
  const std::size_t frames =
      std::clamp<std::size_t>(max_coordinates / coordinates_per_frame, 10, 100);
  viewer::MapAnimation map{.title = "Arrangement, step by step"};
  const std::string of_all = " of " + std::to_string(count_);
  const auto add = [&](const std::string& title, const std::vector<std::optional<Point2>>& places,
                       const std::vector<std::size_t>& components) {
    // Finds the largest part of the drawn views.
    std::map<std::size_t, std::size_t> sizes;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i]) ++sizes[components[i]];
    }
    if (sizes.empty()) return;  // there is nothing to draw before the first views are joined
    const auto largest =
        std::ranges::max_element(sizes, {}, [](const auto& entry) { return entry.second; });
    viewer::MapLayer spring_layer{.label = "pairs of similar views",
                                  .colour = viewer::PlotColour::light_grey};
    viewer::MapLayer views{.label = "largest part", .colour = viewer::PlotColour::blue};
    viewer::MapLayer others{.label = "other parts", .colour = viewer::PlotColour::orange};
    for (const auto& [a, b] : springs) {
      if (!places[a] || !places[b] || components[a] != components[b]) continue;
      spring_layer.lines.push_back({*places[a], *places[b]});
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!places[i]) continue;
      (components[i] == largest->first ? views : others).circles.push_back(*places[i]);
    }
    map.frames.push_back({.title = title, .layers = {spring_layer, others, views}});
    if (!lattice.metric && !has_true_positions(lattice, memory)) {
      map.frames.back().unit = "median distance to the nearest view";
    }
  };
  const std::size_t step = steps_.size() / frames + 1;
  for (std::size_t i = 0; i < steps_.size(); i += step) {
    add("step " + std::to_string(steps_[i].number + 1) + of_all,
        align_to_end(steps_[i].poses, steps_[i].components, end), steps_[i].components);
  }
  std::vector<std::size_t> components;
  for (const Lattice::Node& node : lattice.nodes) components.push_back(node.component);
  add("result", end, components);
  return map;
}

void write_arrange_report(const std::filesystem::path& folder, const std::string& name,
                          const Lattice& lattice, const VisualMemory& memory,
                          const LatticeSteps& steps) {
  viewer::ReportPage page(
      "Arrangement of the views",
      "The " + format_count(lattice.nodes.size(), "view") + " of " + name +
          " were given in no order. panonav estimated the distance and direction between similar "
          "views, and computed the positions of all views from these estimates.");
  const auto& components = lattice.components;
  std::vector<std::pair<std::string, std::string>> figures{
      {std::to_string(components.front().views) + " of " + std::to_string(lattice.nodes.size()),
       "views in the largest part"}};
  const auto comparison = compare_with_ground_truth(lattice, memory);
  if (comparison) {
    figures.emplace_back(format_fixed(comparison->truth_from_map.rms_m, 2) + " m",
                         "root mean square error of the positions after the best alignment");
    figures.emplace_back(
        format_fixed(comparison->shape.value, 4),
        "Procrustes disparity (difference of the shapes): 0 if the shapes are equal, at most 1");
    if (comparison->neighbours) {
      figures.emplace_back(
          format_fixed(100.0 * comparison->neighbours->trustworthiness, 0) + " %",
          "trustworthiness: degree to which neighbours in the result are true neighbours");
    }
  }
  page.add_figures(figures);
  page.begin_section("Step by step");
  page.add_text(
      "Views that certainly belong together form parts. Two parts are joined if several pairs of "
      "views agree on the relative position of the parts. Each part is drawn at its final "
      "position, with its shape at that step.");
  page.add_plots(
      {{steps.make_animation(lattice, memory),
        "Grey lines are pairs of similar views with an estimated distance and direction"}});
  if (comparison) {
    page.begin_section("Comparison with the true positions");
    page.add_text(
        "The true positions were used only to rotate, move and scale the arrangement for this "
        "comparison.");
    std::vector<viewer::ReportPlot> plots;
    for (viewer::MapPlot& plot : draw_lattice(lattice, memory))
      plots.push_back({std::move(plot), ""});
    page.add_plots(plots);
  }
  page.begin_section("Parts");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < std::min<std::size_t>(20, components.size()); ++i) {
    rows.push_back({std::to_string(i + 1), std::to_string(components[i].views),
                    components[i].handedness_known ? "yes" : "no: the part may be mirrored"});
  }
  page.add_table({"part", "views", "left and right known"}, rows);
  if (rows.size() < components.size()) {
    page.add_text("The largest 20 of " + std::to_string(components.size()) + " parts.");
  }
  page.write(folder, "index.html", "panonav arrange");
}

}  // namespace panonav::command
