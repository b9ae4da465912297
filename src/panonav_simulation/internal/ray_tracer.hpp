#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace panonav::simulation {

struct Ray {
  std::array<float, 3> origin{};
  std::array<float, 3> direction{};  ///< of unit length
};

struct RayHit {
  static constexpr std::uint32_t no_triangle = 0xFFFFFFFFU;
  float distance_m = 0.0F;
  float u = 0.0F;  ///< weight of the triangle's second corner
  float v = 0.0F;  ///< weight of the triangle's third corner
  std::uint32_t triangle = no_triangle;
};

/// A wrapper of Embree with plain value types. Immutable after construction, so any number of
/// threads may trace.
class RayTracer {
 public:
  using Vertex = std::array<float, 3>;
  using Triangle = std::array<std::uint32_t, 3>;

  /// `instructions` is Embree's name of an instruction set; if empty, the best one of the processor
  /// is used.
  RayTracer(std::span<const Vertex> vertices, std::span<const Triangle> triangles,
            const std::string& instructions);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  /// Finds the first hit of each ray. Neighbouring rays should be similar, because they are traced
  /// in packets.
  void trace(std::span<const Ray> rays, std::span<RayHit> hits) const;
  [[nodiscard]] RayHit first_hit(const Ray& ray) const;

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

}  // namespace panonav::simulation
