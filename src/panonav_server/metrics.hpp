#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>

/// Metrics as text in the format of Prometheus.
namespace panonav::server {

/// A histogram of durations.
class Histogram {
 public:
  void add(std::chrono::steady_clock::duration duration);
  /// Returns the lines of buckets, sum and count under `name`.
  [[nodiscard]] std::string text(const std::string& name) const;

 private:
  /// Upper bounds of the buckets, chosen because an answer takes some milliseconds.
  static constexpr std::array bounds_s{0.001, 0.002, 0.005, 0.01, 0.02, 0.05,
                                       0.1,   0.2,   0.5,   1.0,  2.0,  5.0};
  std::array<std::uint64_t, bounds_s.size() + 1> counts_{};
  double sum_s_ = 0.0;
};

/// Returns the two lines (HELP and TYPE) that begin a metric. `type` is "counter", "gauge" or
/// "histogram".
[[nodiscard]] std::string describe_metric(const std::string& name, const std::string& type,
                                          const std::string& help);

/// Returns the bytes of memory that the process holds; 0 if unknown.
[[nodiscard]] std::uint64_t resident_bytes();

}  // namespace panonav::server
