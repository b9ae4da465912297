// The place recognition methods that [M04] argues against (sections 1, 2 and 2.1), as baselines on
// the same views.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <string>

#include "lab/baselines/rivals.hpp"
#include "lab/m04/experiment.hpp"
#include "lab/m04/support.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

namespace {

using MakeRecogniser = std::unique_ptr<RivalRecogniser> (*)();
constexpr std::array<MakeRecogniser, 6> rival_factories{
    [] { return make_fourier_signature_recogniser(m04_components); },
    [] { return make_grey_histogram_recogniser(); },
    [] { return make_colour_histogram_recogniser(); },
    // One eigenimage coefficient per signature component.
    [] { return make_eigenimage_recogniser(m04_components); },
    [] { return make_zero_phase_recogniser(); },
    [] { return make_pixels_over_all_rotations_recogniser(); }};
constexpr std::size_t rival_count = rival_factories.size();
// Maximum number of queries per scene, because comparing pixels over all turns is slow.
constexpr std::size_t max_queries = 20;

// Returns the conditions of the other experiments and a dimmer one. No view is preprocessed, so
// that no method has an advantage.
std::vector<ViewCondition> rival_conditions() {
  std::vector<ViewCondition> conditions(view_conditions().begin(), view_conditions().end());
  conditions.push_back({"dim", "30 % less light", {.exposure = 0.7}});
  return conditions;
}

// Returns the mean difference between the largest and the smallest colour channel of a pixel: 0
// (grey) to 1.
double mean_colourfulness(const Image& view) {
  double sum = 0.0;
  const auto pixels = view.pixels();
  for (std::size_t i = 0; i < pixels.size(); i += 3) {
    const auto [low, high] = std::minmax({pixels[i], pixels[i + 1], pixels[i + 2]});
    sum += (high - low) / 255.0;
  }
  return 3.0 * sum / static_cast<double>(pixels.size());
}

class Rivals final : public Experiment {
 public:
  void add(const simulation::PlaceRecording& place, Executor& executor) override {
    const simulation::Renderer colour_renderer(place.scene, {.channels = 3}, executor);
    const auto references =
        render_in_colour(place, colour_renderer, place.references, {}, 90000U, executor);
    for (const auto& view : references) colourfulness_.push_back(mean_colourfulness(view.picture));
    std::array<std::unique_ptr<RivalRecogniser>, rival_count> recognisers;
    for (std::size_t r = 0; r < rival_count; ++r) {
      recognisers[r] = rival_factories[r]();
      recognisers[r]->memorise(references);
      names_[r] = recognisers[r]->name();
      bytes_[r] = recognisers[r]->bytes_per_view();
    }
    const auto conditions = rival_conditions();
    for (std::size_t condition = 0; condition < conditions.size(); ++condition) {
      auto views = capture_queries(place, conditions[condition], executor);
      views.resize(std::min(views.size(), max_queries), views.front());
      const auto queries = render_in_colour(place, colour_renderer, views,
                                            conditions[condition].sensor, 95000U, executor);
      if (condition == 0) trials_ += queries.size();
      for (std::size_t r = 0; r < rival_count; ++r) {
        std::vector<std::size_t> found(queries.size());
        auto seconds = simulation::make_each(executor, queries.size(), [&](std::size_t q) {
          const double start = simulation::get_thread_cpu_time_s();
          found[q] = recognisers[r]->nearest(queries[q]);
          return simulation::get_thread_cpu_time_s() - start;
        });
        for (std::size_t q = 0; q < found.size(); ++q) {
          const Point2 position = views[q].pose.position();
          found_[condition][r] += found[q] == place.nearest_reference(position) ? 1 : 0;
          near_[condition][r] +=
              distance(place.references[found[q]].pose.position(), position) <= place.spacing_m ? 1
                                                                                                : 0;
          milliseconds_[r].push_back(1000.0 * seconds[q]);
        }
      }
    }
  }

  void report(Reproduction& result) const override {
    require(trials_ >= 1, "queries", 0.0, ">= 1");
    const auto conditions = rival_conditions();
    viewer::LinePlot plot{.title = "Nearest reference found, by way of recognising places",
                          .x_label = "",
                          .y_label = "share of queries",
                          .series = {},
                          .x_range = std::pair{-0.6, static_cast<double>(rival_count) - 0.4},
                          .y_range = std::pair{0.0, 1.05}};
    plot.x_tick_labels.assign(names_.begin(), names_.end());
    for (std::size_t condition = 0; condition < conditions.size(); ++condition) {
      viewer::Series marks{.label = conditions[condition].name,
                           .style = viewer::SeriesStyle::points};
      for (std::size_t r = 0; r < rival_count; ++r) {
        const Proportion exact = success_rate(found_[condition][r], trials_);
        const Proportion near = success_rate(near_[condition][r], trials_);
        add_point(marks, static_cast<double>(r) + 0.12 * (static_cast<double>(condition) - 1.5),
                  exact);
        const std::string& name = conditions[condition].name;
        add_rival_row(r, conditions[condition].id + ".found", "nearest reference found, " + name,
                      exact, "", result);
        add_rival_row(r, conditions[condition].id + ".near",
                      "a reference within one spacing found, " + name, near, "", result);
      }
      plot.series.push_back(std::move(marks));
    }
    for (std::size_t r = 0; r < rival_count; ++r) {
      add_rival_row(r, "bytes", "bytes a view", bytes_[r], "B", result);
      add_rival_row(r, "time", "processor time a query, image to answer (median)",
                    median(milliseconds_[r]), "ms", result);
    }
    add_row(result, "m04.rivals.colourfulness",
            "rivals: difference between the colour channels of a pixel (mean; 0: grey, 1: pure "
            "colours)",
            mean_figure(colourfulness_), "");
    add_plot(result, "rivals.svg",
             "The Fourier signature beside what the paper argues against, on the same views.",
             plot);
  }

 private:
  static constexpr std::size_t rival_condition_count = 4;

  // Adds to each view a colour rendering from the same pose through the same kind of sensor.
  static std::vector<RivalView> render_in_colour(const simulation::PlaceRecording& place,
                                                 const simulation::Renderer& colour_renderer,
                                                 const std::vector<simulation::PlacedView>& views,
                                                 const simulation::SensorOptions& sensor,
                                                 std::uint64_t noise, Executor& executor) {
    const Camera camera{.model = EquirectangularModel{place.rendering.elevations.bottom_rad,
                                                      place.rendering.elevations.top_rad},
                        .image_size = {place.rendering.columns, place.rendering.rows}};
    return simulation::make_each(executor, views.size(), [&](std::size_t i) {
      Executor here(1);
      const simulation::Radiance light = colour_renderer.render_image(
          {.pose = views[i].pose, .height_m = place.scene.camera_height_m}, camera,
          place.rendering.rays_per_axis, here);
      return RivalView{
          views[i].panorama,
          simulation::apply_sensor(light, camera, sensor, place.seed * 100003U + noise + i)};
    });
  }

  void add_rival_row(std::size_t rival, const std::string& key, const std::string& what,
                     const Figure& ours, const std::string& unit, Reproduction& result) const {
    std::string id = names_[rival];
    std::ranges::replace(id, ' ', '_');
    add_row(result, "m04.rivals." + id + "." + key, "rivals: " + names_[rival] + ", " + what, ours,
            unit);
  }

  std::size_t trials_ = 0;
  std::array<std::string, rival_count> names_;
  std::array<double, rival_count> bytes_{};
  std::array<std::array<std::size_t, rival_count>, rival_condition_count> found_{};
  std::array<std::array<std::size_t, rival_count>, rival_condition_count> near_{};
  std::array<std::vector<double>, rival_count> milliseconds_;
  std::vector<double> colourfulness_;
};

}  // namespace

std::unique_ptr<Experiment> make_rivals_experiment() {
  return std::make_unique<Rivals>();
}

}  // namespace panonav::lab
