#include "reports/map_measures.hpp"

#include <string>

namespace panonav::command {

ordered_json neighbours_json(const MapComparison& comparison) {
  if (!comparison.neighbours) return {{"trustworthiness", nullptr}, {"continuity", nullptr}};
  return {{"trustworthiness", comparison.neighbours->trustworthiness},
          {"continuity", comparison.neighbours->continuity}};
}

void print_neighbours(const MapComparison& comparison, Session& session) {
  if (!comparison.neighbours) return;
  session.print("neighbours kept: trustworthiness " +
                format_fixed(comparison.neighbours->trustworthiness, 3) + ", continuity " +
                format_fixed(comparison.neighbours->continuity, 3));
}

ordered_json closures_json(const std::optional<MapComparison::Closures>& closures) {
  if (!closures) return {{"right_closures", nullptr}, {"wrong_closures", nullptr}};
  return {{"right_closures", closures->right}, {"wrong_closures", closures->wrong}};
}

void print_closures(const MapComparison::Closures& closures, Session& session) {
  session.print("closures: correct " + std::to_string(closures.right) + ", wrong " +
                std::to_string(closures.wrong));
}

}  // namespace panonav::command
