#pragma once

#include <array>
#include <cstdint>
#include <utility>

namespace panonav {

/// Random numbers with the same bits on every platform: xoshiro256++ seeded through SplitMix64, and
/// distributions of our own, because the standard ones differ between libraries. Not thread-safe:
/// give each chunk of parallel work its own `stream`.
class Random {
 public:
  explicit Random(std::uint64_t seed);  ///< Stream 0 of the seed.
  /// An engine that is independent of every other (seed, stream).
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
  /// Two independent standard normal values to 24 bits from one number of the generator, at a third
  /// of the cost; none is beyond 6.7 deviations.
  std::pair<double, double> normal_pair();
  /// Normal distribution of this mean and standard deviation (>= 0), in the unit of both.
  double normal(double mean, double standard_deviation);

 private:
  std::array<std::uint64_t, 4> state_{};
};

}  // namespace panonav
