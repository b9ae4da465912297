#include "panonav/pipeline/learnt_route.hpp"

#include <string_view>
#include <vector>

#include "panonav/core/number_text.hpp"
#include "panonav/storage/checksum.hpp"

namespace panonav {

namespace {

/// Version of the learning method; raised when its results change, so that older limits are
/// ignored.
constexpr std::string_view limits_version = "3";

std::string make_limits_parameter_name(const std::string& name) {
  return "learnt route." + name;
}

/// Returns a hash of the lines and their poses.
std::string compute_route_fingerprint(const RoutePanorama& route, double metre) {
  RecordBytes record;
  record.add(std::int64_t{route.columns()});
  record.add(metre);
  for (std::size_t i = 0; i < route.size(); ++i) {
    const Pose2& pose = route.poses()[i];
    record.add(pose.x_m);
    record.add(pose.y_m);
    record.add(pose.heading_rad);
    record.add(route.line(i));
  }
  return to_hex_digits(checksum(record.bytes()));
}

/// Reads limits; nullopt unless they were written by `learn_and_store_route` for this fingerprint.
std::optional<RouteLimits> parse_limits(const std::string& text, const std::string& fingerprint) {
  const std::vector<std::string> words = split_words(text);
  constexpr std::size_t word_count = 7;
  if (words.size() != word_count || words[0] != limits_version || words[1] != fingerprint) {
    return std::nullopt;
  }
  RouteLimits limits;
  const bool is_read = read_hex_number(words[2], limits.min_correlation) &&
                       read_hex_number(words[3], limits.min_detail_correlation) &&
                       read_number(words[4], limits.detail_scale) &&
                       read_hex_number(words[5], limits.model_variance_m2) &&
                       read_hex_number(words[6], limits.model_variance_rad2);
  if (!is_read || !is_valid(limits)) return std::nullopt;
  return limits;
}

}  // namespace

RouteFitOptions scale_fit(RouteFitOptions fit, const RouteSource& source) {
  fit.metre = 1.0 / source.rough_unit_m();
  return fit;
}

void learn_and_store_route(MemoryFile& file, const std::string& name) {
  const auto route = file.route(name);
  if (!route || route->size() < 2) return;
  const auto fit = scale_fit({}, read_route_source(file, name, route->columns()));
  if (load_route_limits(file, name, *route, {}, fit)) return;
  const RouteLimits limits = RouteTracker(*route, {}, fit).limits();
  file.set_parameter(
      make_limits_parameter_name(name),
      std::string(limits_version) + " " + compute_route_fingerprint(*route, fit.metre) + " " +
          to_hex_text(limits.min_correlation) + " " + to_hex_text(limits.min_detail_correlation) +
          " " + std::to_string(limits.detail_scale) + " " + to_hex_text(limits.model_variance_m2) +
          " " + to_hex_text(limits.model_variance_rad2));
}

std::optional<RouteLimits> load_route_limits(const MemoryFile& file, const std::string& name,
                                             const RoutePanorama& route,
                                             const RouteTrackerOptions& options,
                                             const RouteFitOptions& fit) {
  RouteFitOptions default_fit;
  default_fit.metre = fit.metre;
  if (options != RouteTrackerOptions{} || fit != default_fit) return std::nullopt;
  const auto text = file.parameter(make_limits_parameter_name(name));
  return text ? parse_limits(*text, compute_route_fingerprint(route, fit.metre)) : std::nullopt;
}

}  // namespace panonav
