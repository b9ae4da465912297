#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>

/// Text of the page that Prometheus reads.
namespace panonav::server {

/// Counts durations by how long they were.
class Histogram {
 public:
  void add(std::chrono::steady_clock::duration duration);
  /// Returns the lines of buckets, sum and count under `name`.
  [[nodiscard]] std::string text(const std::string& name) const;

 private:
  /// Upper ends of the buckets, chosen: an answer takes some milliseconds.
  static constexpr std::array bounds_s{0.001, 0.002, 0.005, 0.01, 0.02, 0.05,
                                       0.1,   0.2,   0.5,   1.0,  2.0,  5.0};
  std::array<std::uint64_t, bounds_s.size() + 1> counts_{};
  double sum_s_ = 0.0;
};

/// Returns the two lines that begin a metric. `type`: "counter", "gauge" or "histogram".
[[nodiscard]] std::string describe_metric(const std::string& name, const std::string& type,
                                          const std::string& help);

/// Returns the bytes of memory that the process holds; 0 if unknown.
[[nodiscard]] std::uint64_t resident_bytes();

}  // namespace panonav::server
