#pragma once

#include <array>
#include <cstdint>
#include <utility>

namespace panonav {

/// Random number generator with the same results on every platform: xoshiro256++ seeded by
/// SplitMix64, with its own distributions, because those of the standard differ between libraries.
/// Not thread-safe: give each chunk of parallel work its own `stream`.
class Random {
 public:
  explicit Random(std::uint64_t seed);  ///< Stream 0 of the seed.
  /// Makes a generator that is independent of those of every other (seed, stream).
  Random(std::uint64_t seed, std::uint64_t stream);

  std::uint64_t next();  ///< 64 random bits.
  /// Uniform in [0, 1).
  double uniform();
  /// Uniform in [low, high).
  double uniform(double low, double high);
  /// Uniform index 0 .. count - 1, without bias; count >= 1.
  std::uint64_t index(std::uint64_t count);
  /// Normal distribution of mean 0 and standard deviation 1.
  double normal();
  /// Draws two independent standard normal values, with 24 bits, from one 64-bit number: a third of
  /// the cost of `normal`. No value exceeds 6.7 standard deviations.
  std::pair<double, double> normal_pair();
  /// Normal distribution of this mean and standard deviation (>= 0), in the unit of both.
  double normal(double mean, double standard_deviation);

 private:
  std::array<std::uint64_t, 4> state_{};
};

}  // namespace panonav
