#include "panonav_server/metrics.hpp"

#include <algorithm>
#include <fstream>

#include "panonav/core/error.hpp"

namespace panonav::server {

void Histogram::add(std::chrono::steady_clock::duration duration) {
  const double duration_s = std::chrono::duration<double>(duration).count();
  ++counts_[static_cast<std::size_t>(std::ranges::lower_bound(bounds_s, duration_s) -
                                     bounds_s.begin())];
  sum_s_ += duration_s;
}

std::string Histogram::text(const std::string& name) const {
  std::string lines;
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < counts_.size(); ++i) {
    below += counts_[i];
    lines += name + "_bucket{le=\"" + (i < bounds_s.size() ? to_text(bounds_s[i]) : "+Inf") +
             "\"} " + std::to_string(below) + "\n";
  }
  return lines + name + "_sum " + to_text(sum_s_) + "\n" + name + "_count " +
         std::to_string(below) + "\n";
}

std::string describe_metric(const std::string& name, const std::string& type,
                            const std::string& help) {
  return "# HELP " + name + " " + help + "\n# TYPE " + name + " " + type + "\n";
}

std::uint64_t resident_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) return std::stoull(line.substr(6)) * 1024;
  }
  return 0;
}

}  // namespace panonav::server
