// [M04] figure 6: how well 2, 5, 15, 50 and 256 components discriminate between places.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "lab/m04/experiment.hpp"
#include "lab/m04/support.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

namespace {

constexpr std::array component_counts{2, 5, 15, 50, 256};
constexpr std::size_t component_setting_count = component_counts.size();
constexpr std::size_t index_of_fifteen = 2;
constexpr std::size_t condition_count = 3;
constexpr std::size_t hidden_condition = 1;
constexpr std::size_t band_count = 4;  // components 0 and 1, 2 .. 14, 15 .. 49, 50 .. 255

// Returns the dissimilarities between one query and all references, per number of components.
std::array<std::vector<double>, component_setting_count> dissimilarities(
    const FourierSignature& query, const std::vector<FourierSignature>& references) {
  std::array<std::vector<double>, component_setting_count> values;
  for (const auto& reference : references) {
    const auto parts = dissimilarity_by_component(query, reference);
    double sum = 0.0;
    std::size_t k = 0;
    for (std::size_t c = 0; c < component_setting_count; ++c) {
      for (; k < static_cast<std::size_t>(component_counts[c]); ++k) sum += parts[k];
      values[c].push_back(sum);
    }
  }
  return values;
}

// Returns how far the similarity falls from the nearest reference to its grid neighbours, divided
// by the range over all references; 0 for a flat profile.
double peak_sharpness(const simulation::PlaceRecording& place, std::size_t nearest,
                      const std::vector<double>& values) {
  const auto scaled = similarities(values);
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < scaled.size(); ++i) {
    const double d =
        distance(place.references[i].pose.position(), place.references[nearest].pose.position());
    if (i != nearest && d < 1.01 * place.spacing_m) {
      sum += scaled[i];
      count += 1.0;
    }
  }
  return count > 0.0 ? (scaled[nearest] - sum / count) / 1000.0 : 0.0;
}

class Discrimination final : public Experiment {
 public:
  void add(const simulation::PlaceRecording& place, Executor& executor) override {
    require(place.rendering.columns >= 2 * component_counts.back(), "columns",
            place.rendering.columns, ">= 512: figure 6 compares 256 components");
    const auto references = compute_signatures(place.references, component_counts.back(), executor);
    const auto clean = compute_signatures(place.queries, component_counts.back(), executor);
    std::vector<double> sharpness(component_setting_count);
    std::vector<double> contrast(component_setting_count);
    for (std::size_t condition = 0; condition < condition_count; ++condition) {
      const auto views = capture_queries(place, view_conditions()[condition], executor);
      const auto queries = compute_signatures(views, component_counts.back(), executor);
      auto values = simulation::make_each(executor, queries.size(), [&](std::size_t q) {
        return dissimilarities(queries[q], references);
      });
      std::array<double, component_setting_count> right{};
      const auto n = static_cast<double>(queries.size());
      for (std::size_t q = 0; q < queries.size(); ++q) {
        const Point2 position = views[q].pose.position();
        const std::size_t nearest = place.nearest_reference(position);
        for (std::size_t c = 0; c < component_setting_count; ++c) {
          const std::size_t found = find_smallest(values[q][c]);
          right[c] += found == nearest ? 1.0 / n : 0.0;
          found_[condition][c] += found == nearest ? 1 : 0;
          errors_m_[condition][c].push_back(
              distance(place.references[found].pose.position(), position));
          if (condition == 0) {
            sharpness[c] += peak_sharpness(place, nearest, values[q][c]) / n;
            contrast[c] += values[q][c][nearest] / median(values[q][c]) / n;
          }
        }
      }
      trials_ += condition == 0 ? queries.size() : 0;
      for (std::size_t c = 0; c < component_setting_count; ++c) {
        success_by_scene_[condition][c].push_back(right[c]);
      }
      if (condition == 0 && profile_.empty()) store_profile(place, values.front());
      if (condition == hidden_condition) compare_disturbance(place, clean, queries, references);
    }
    for (std::size_t c = 0; c < component_setting_count; ++c) {
      sharpness_by_scene_[c].push_back(sharpness[c]);
      contrast_by_scene_[c].push_back(contrast[c]);
    }
  }

  void report(Reproduction& result) const override {
    require(trials_ >= 1, "queries", 0.0, ">= 1");
    draw(result);
    for (std::size_t condition = 0; condition < condition_count; ++condition) {
      const std::string& name = view_conditions()[condition].name;
      const std::string& id = view_conditions()[condition].id;
      for (std::size_t c = 0; c < component_setting_count; ++c) {
        const Proportion found = success_rate(found_[condition][c], trials_);
        add_row(result, "m04.fig6." + id + ".found_" + format_component_count(c),
                "figure 6: nearest reference found with " + format_component_count(c) +
                    " components, " + name,
                found, "");
      }
      for (const std::size_t more : {index_of_fifteen + 1, index_of_fifteen + 2}) {
        add_difference(condition, "fifteen_against_" + format_component_count(more),
                       "15 components less that with " + format_component_count(more), more,
                       at_least(-0.02), result);
        if (id == "hidden") result.rows.back().reason = explain_disturbance();
      }
      add_difference(condition, "fifteen_against_2", "15 components less that with 2", 0,
                     at_least(0.0), result);
      add_row(
          result, "m04.fig6." + id + ".error_15",
          "figure 6: distance to the reference found, 15 components, 25 cm grid (median), " + name,
          median_figure(errors_m_[condition][index_of_fifteen]), "m", at_most(0.177));
    }
    for (std::size_t c = 0; c < component_setting_count; ++c) {
      add_row(result, "m04.fig6.sharpness_" + format_component_count(c),
              "figure 6: fall of similarity from the right reference to its neighbours, " +
                  format_component_count(c) +
                  " components (share of the whole range; more is sharper)",
              mean_figure(sharpness_by_scene_[c]), "");
      add_row(result, "m04.fig6.contrast_" + format_component_count(c),
              "figure 6: dissimilarity at the right reference over that of a typical one, " +
                  format_component_count(c) + " components (less is better)",
              mean_figure(contrast_by_scene_[c]), "");
    }
    constexpr std::array band_names{"0 and 1", "2 to 14", "15 to 49", "50 to 255"};
    for (std::size_t band = 0; band < band_count; ++band) {
      if (disturbance_over_step_[band].empty()) continue;
      add_row(result, "m04.fig6.hidden.disturbance_" + std::to_string(band + 1),
              std::string("figure 6: what hiding 10 % of the azimuths changes in components ") +
                  band_names[band] + ", over what a step of 25 cm changes there",
              mean_figure(disturbance_over_step_[band]), "");
    }
    add_row(result, "m04.fig6.sharpness_fifteen_against_2",
            "figure 6: sharpness with 15 components less that with 2",
            mean_figure(difference(sharpness_by_scene_[index_of_fifteen], sharpness_by_scene_[0])),
            "", at_least(0.0));
  }

 private:
  static std::string format_component_count(std::size_t c) {
    return std::to_string(component_counts[c]);
  }

  static std::vector<double> difference(const std::vector<double>& a,
                                        const std::vector<double>& b) {
    std::vector<double> result;
    for (std::size_t i = 0; i < a.size(); ++i) result.push_back(a[i] - b[i]);
    return result;
  }

  // Adds the difference of success rates between 15 components and `other`, paired by scene (the
  // queries are the same).
  void add_difference(std::size_t condition, const std::string& id, const std::string& what,
                      std::size_t other, Target target, Reproduction& result) const {
    const auto values = difference(success_by_scene_[condition][index_of_fifteen],
                                   success_by_scene_[condition][other]);
    add_row(result, "m04.fig6." + view_conditions()[condition].id + "." + id,
            "figure 6: share found with " + what + ", " + view_conditions()[condition].name,
            mean_figure(values), "", target);
  }

  // Explains why more components help when azimuths are hidden; empty if the measured disturbance
  // does not explain it.
  [[nodiscard]] std::string explain_disturbance() const {
    if (disturbance_over_step_[1].empty()) return "";
    const double low = mean(disturbance_over_step_[1]);
    const double high = mean(disturbance_over_step_[3]);
    if (low <= high) return "";
    const auto hundredths = [](double value) { return to_text(std::round(100.0 * value) / 100.0); };
    return "hiding 10 % of the azimuths changes components 2 to 14 " + hundredths(low) +
           " times as much as a step of 25 cm does, and components 50 to 255 only " +
           hundredths(high) + " times as much; so more components help";
  }

  // Compares, per band of components, how much hidden azimuths change a view with how much a
  // step of one spacing does.
  void compare_disturbance(const simulation::PlaceRecording& place,
                           const std::vector<FourierSignature>& clean,
                           const std::vector<FourierSignature>& hidden,
                           const std::vector<FourierSignature>& references) {
    if (references.size() < 2) return;
    std::array<double, band_count> by_people{};
    std::array<double, band_count> by_step{};
    for (std::size_t q = 0; q < clean.size(); ++q) {
      const std::size_t nearest = place.nearest_reference(place.queries[q].pose.position());
      const auto people = dissimilarity_by_component(clean[q], hidden[q]);
      // References are in raster order: the next one is a grid neighbour, except at the end of a
      // row.
      const std::size_t next = nearest + 1 < references.size() ? nearest + 1 : nearest - 1;
      if (distance(place.references[nearest].pose.position(),
                   place.references[next].pose.position()) > 1.01 * place.spacing_m) {
        continue;
      }
      const auto step = dissimilarity_by_component(references[nearest], references[next]);
      for (std::size_t k = 0; k < people.size(); ++k) {
        const std::size_t band = k < 2 ? 0 : k < 15 ? 1 : k < 50 ? 2 : 3;
        by_people[band] += people[k];
        by_step[band] += step[k];
      }
    }
    for (std::size_t band = 0; band < band_count; ++band) {
      if (by_step[band] > 0.0)
        disturbance_over_step_[band].push_back(by_people[band] / by_step[band]);
    }
  }

  void store_profile(const simulation::PlaceRecording& place,
                     const std::array<std::vector<double>, component_setting_count>& values) {
    const simulation::PlacedView& query = place.queries.front();
    const std::size_t nearest = place.nearest_reference(query.pose.position());
    const double row_y_m = place.references[nearest].pose.y_m;
    for (std::size_t c = 0; c < component_setting_count; ++c) {
      const auto scaled = similarities(values[c]);
      viewer::Series line{.label = format_component_count(c) + " components"};
      for (std::size_t i = 0; i < place.references.size(); ++i) {
        if (std::abs(place.references[i].pose.y_m - row_y_m) < 1e-6) {
          line.add(place.references[i].pose.x_m, scaled[i]);
        }
      }
      profile_.push_back(std::move(line));
    }
    const double x_m = query.pose.x_m;
    profile_.push_back({.label = "true position",
                        .x = {x_m, x_m},
                        .y = {0.0, 1000.0},
                        .style = viewer::SeriesStyle::lines});
  }

  void draw(Reproduction& result) const {
    add_plot(
        result, "fig06_similarity_profile.svg",
        "With 2 components the peak is broad; from 15 on it is narrow and stands at the true "
        "position.",
        viewer::LinePlot{
            .title =
                "Similarity of one view to the references along a row of the grid ([M04] figure 6)",
            .x_label = "x of the reference [m]",
            .y_label = "similarity (0 .. 1000)",
            .series = profile_});
    viewer::LinePlot rates{.title = "Nearest reference found, by number of components",
                           .x_label = "number of components",
                           .y_label = "share of queries",
                           .series = {},
                           .log_x = true,
                           .x_range = std::pair{1.5, 400.0}};
    for (std::size_t condition = 0; condition < condition_count; ++condition) {
      viewer::Series line{.label = view_conditions()[condition].name};
      for (std::size_t c = 0; c < component_setting_count; ++c) {
        const Proportion found = success_rate(found_[condition][c], trials_);
        // Shift the conditions slightly in x, so that their error bars do not hide each other.
        line.add(component_counts[c] * (1.0 + 0.03 * static_cast<double>(condition)), found.value);
        line.y_low.push_back(found.low);
        line.y_high.push_back(found.high);
      }
      rates.series.push_back(std::move(line));
    }
    add_plot(result, "fig06_success.svg",
             "How often the most similar reference is the nearest one: clean views, views with "
             "people around, and a noisy camera.",
             rates);
  }

  std::size_t trials_ = 0;
  std::array<std::array<std::size_t, component_setting_count>, condition_count> found_{};
  std::array<std::array<std::vector<double>, component_setting_count>, condition_count> errors_m_;
  std::array<std::array<std::vector<double>, component_setting_count>, condition_count>
      success_by_scene_;
  std::array<std::vector<double>, component_setting_count> sharpness_by_scene_;
  std::array<std::vector<double>, component_setting_count> contrast_by_scene_;
  std::array<std::vector<double>, band_count> disturbance_over_step_;
  std::vector<viewer::Series> profile_;
};

}  // namespace

std::unique_ptr<Experiment> make_discrimination_experiment() {
  return std::make_unique<Discrimination>();
}

}  // namespace panonav::lab
