// [M04] eq. 6: component weights alpha_k, left open by the authors ("not trivial because they
// depend on the structure of the environment"), learnt in one scene and applied in the next.

#include <array>
#include <numeric>
#include <optional>
#include <string>

#include "lab/m04/experiment.hpp"
#include "lab/m04/learn_weights.hpp"
#include "lab/m04/support.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/error.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

namespace {

constexpr std::size_t view_condition_count = 3;
enum Weighting : std::size_t { equal, learnt, weighting_count };

class WeightsOfComponents final : public Experiment {
 public:
  void add(const simulation::PlaceRecording& place, Executor& executor) override {
    const auto references = compute_signatures(place.references, m04_components, executor);
    if (previous_weights_) apply_previous_weights(place, references, executor);
    const auto learnt_here = learn_component_weights(make_memory(place.references, references));
    if (!learnt_here) return;
    previous_weights_ = learnt_here->weights;
    margins_[equal].push_back(learnt_here->margin_of_equal_weights);
    margins_[learnt].push_back(learnt_here->margin);
    for (std::size_t k = 0; k < previous_weights_->size(); ++k)
      weights_[k].push_back((*previous_weights_)[k]);
  }

  void report(Reproduction& result) const override {
    require(trials_ >= 1, "scenes to learn weights in and to use them in",
            static_cast<double>(margins_[equal].size()), ">= 2");
    viewer::Series line{.label = "mean of " + std::to_string(margins_[equal].size()) + " scenes"};
    for (std::size_t k = 0; k < weights_.size(); ++k) {
      add_point(line, static_cast<double>(k), mean_figure(weights_[k]));
    }
    const viewer::Series ones{.label = "equal weights",
                              .x = {0.0, static_cast<double>(weights_.size() - 1)},
                              .y = {1.0, 1.0},
                              .style = viewer::SeriesStyle::lines};
    add_plot(
        result, "eq06_weights.svg", "How much each component should count, learnt in each scene.",
        viewer::LinePlot{
            .title = "Weights of the components, learnt from memories with poses ([M04] eq. 6)",
            .x_label = "component k [cycles per turn]",
            .y_label = "weight (mean 1)",
            .series = {line, ones}});
    for (std::size_t condition = 0; condition < view_condition_count; ++condition) {
      const ViewCondition& under = view_conditions()[condition];
      for (const std::size_t w : {equal, learnt}) {
        const Proportion found = success_rate(found_[condition][w], trials_);
        const std::string name = w == equal ? "equal weights" : "weights learnt in another scene";
        add_row(result, "m04.eq6." + under.id + "." + (w == equal ? "equal" : "learnt"),
                "eq. 6: nearest reference found with " + name + ", " + under.name, found, "");
      }
      add_row(result, "m04.eq6." + under.id + ".gain",
              "eq. 6: share found with learnt weights less that with equal ones (same queries), " +
                  under.name,
              mean_figure(gain_by_scene_[condition]), "");
    }
    for (const std::size_t w : {equal, learnt}) {
      add_row(result, std::string("m04.eq6.margin.") + (w == equal ? "equal" : "learnt"),
              std::string("eq. 6: margin between near and far views over its deviation, left out "
                          "of the learning, ") +
                  (w == equal ? "equal weights" : "learnt weights") + " (mean over scenes)",
              mean_figure(margins_[w]), "");
    }
  }

 private:
  // Applies the weights learnt in the previous scene to this one.
  void apply_previous_weights(const simulation::PlaceRecording& place,
                              const std::vector<FourierSignature>& references, Executor& executor) {
    const std::array<std::vector<double>, weighting_count> weights{
        std::vector<double>(previous_weights_->size(), 1.0), *previous_weights_};
    for (std::size_t condition = 0; condition < view_condition_count; ++condition) {
      const auto views = capture_queries(place, view_conditions()[condition], executor);
      const auto queries = compute_signatures(views, m04_components, executor);
      std::array<double, weighting_count> right{};
      for (std::size_t q = 0; q < queries.size(); ++q) {
        const std::size_t nearest = place.nearest_reference(views[q].pose.position());
        for (std::size_t w = 0; w < weighting_count; ++w) {
          std::vector<double> values;
          for (const auto& reference : references) {
            values.push_back(dissimilarity_weighted(queries[q], reference, weights[w]));
          }
          const bool found = find_smallest(values) == nearest;
          found_[condition][w] += found ? 1 : 0;
          right[w] += found ? 1.0 / static_cast<double>(queries.size()) : 0.0;
        }
      }
      gain_by_scene_[condition].push_back(right[learnt] - right[equal]);
      if (condition == 0) trials_ += queries.size();
    }
  }

  std::optional<std::vector<double>> previous_weights_;
  std::array<std::vector<double>, m04_components> weights_;
  std::array<std::vector<double>, weighting_count> margins_;
  std::size_t trials_ = 0;
  std::array<std::array<std::size_t, weighting_count>, view_condition_count> found_{};
  std::array<std::vector<double>, view_condition_count> gain_by_scene_;
};

}  // namespace

std::unique_ptr<Experiment> make_component_weights_experiment() {
  return std::make_unique<WeightsOfComponents>();
}

}  // namespace panonav::lab
