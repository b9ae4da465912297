#include "panonav/core/random.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace panonav {

namespace {

std::uint64_t split_mix(std::uint64_t& state) {
  state += 0x9E3779B97F4A7C15ULL;
  std::uint64_t z = state;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

}  // namespace

Random::Random(std::uint64_t seed) : Random(seed, 0) {}

Random::Random(std::uint64_t seed, std::uint64_t stream) {
  // Mixes the stream number first, so that (seed, stream + 1) and (seed + 1, stream) get unrelated
  // states.
  std::uint64_t mixer = stream;
  std::uint64_t state = seed ^ split_mix(mixer);
  for (auto& word : state_) word = split_mix(state);
}

std::uint64_t Random::next() {
  const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const std::uint64_t t = state_[1] << 17U;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double Random::uniform() {
  return static_cast<double>(next() >> 11U) * 0x1.0p-53;
}

double Random::uniform(double low, double high) {
  return low + (high - low) * uniform();
}

std::uint64_t Random::index(std::uint64_t count) {
  // Draws again above the largest multiple of count, so that all indices are equally likely.
  const std::uint64_t limit = UINT64_MAX - UINT64_MAX % count;
  std::uint64_t value = next();
  while (value >= limit) value = next();
  return value % count;
}

double Random::normal() {
  // Box-Muller; drops the second value, so that no state besides the generator's is needed.
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

std::pair<double, double> Random::normal_pair() {
  // Box-Muller; the two halves of one random number serve as the two uniform numbers.
  const std::uint64_t bits = next();
  const auto half = [](std::uint32_t part) {
    return (static_cast<float>(part) + 0.5F) * 0x1.0p-32F;
  };
  const float radius =
      std::sqrt(-2.0F * std::log(std::min(half(static_cast<std::uint32_t>(bits >> 32U)), 1.0F)));
  const float angle = 2.0F * std::numbers::pi_v<float> * half(static_cast<std::uint32_t>(bits));
  return {static_cast<double>(radius * std::cos(angle)),
          static_cast<double>(radius * std::sin(angle))};
}

double Random::normal(double mean, double standard_deviation) {
  return mean + standard_deviation * normal();
}

}  // namespace panonav
