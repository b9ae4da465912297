#include "panonav_recordings/live_observations.hpp"

#include <array>
#include <cmath>
#include <ctime>

namespace panonav::recordings {

std::optional<Observation> LiveObservations::next() {
  auto live_picture = live_.next();
  if (!live_picture) return std::nullopt;
  Observation observation(std::move(live_picture->picture));
  observation.encoded = std::move(live_picture->encoded);
  // Names must be unique in a memory. A picture with the stamp of the previous one gets a stamp one
  // microsecond later, and so does one up to a second earlier; a larger step back is a clock that
  // was set, and is kept.
  constexpr std::int64_t second_us = 1'000'000;
  auto stamp_us = static_cast<std::int64_t>(std::floor(1e6 * live_picture->stamp_s));
  if (last_us_ && stamp_us <= *last_us_ && *last_us_ - stamp_us < second_us) {
    stamp_us = *last_us_ + 1;
  }
  last_us_ = stamp_us;
  observation.stamp_s = 1e-6 * static_cast<double>(stamp_us);
  timing_ = {live_picture->arrived, live_picture->decoding};
  const auto micro = (stamp_us % second_us + second_us) % second_us;
  const auto whole_s = static_cast<std::time_t>((stamp_us - micro) / second_us);
  std::tm utc{};
  gmtime_r(&whole_s, &utc);
  std::array<char, 40> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  const std::string digits = std::to_string(second_us + micro);
  observation.name = std::string(text.data(), length) + "." + digits.substr(1) + "Z";
  return observation;
}

}  // namespace panonav::recordings
