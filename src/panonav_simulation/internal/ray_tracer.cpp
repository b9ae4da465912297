#include "panonav_simulation/internal/ray_tracer.hpp"

#include <algorithm>
#include <limits>
#include <string>

#if PANONAV_EMBREE_MAJOR >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "panonav/core/error.hpp"

namespace panonav::simulation {

namespace {

constexpr float unlimited_distance_m = std::numeric_limits<float>::infinity();

// Calls that differ between Embree's major versions.
#if PANONAV_EMBREE_MAJOR >= 4
void intersect_one(RTCScene scene, RTCRayHit* ray) {
  rtcIntersect1(scene, ray);
}
void intersect_eight(const int* valid, RTCScene scene, RTCRayHit8* rays) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect8(valid, scene, rays, &arguments);
}
#else
void intersect_one(RTCScene scene, RTCRayHit* ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, ray);
}
void intersect_eight(const int* valid, RTCScene scene, RTCRayHit8* rays) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &context, rays);
}
#endif

RTCRay to_embree(const Ray& ray, float far_m) {
  RTCRay r{};
  r.org_x = ray.origin[0];
  r.org_y = ray.origin[1];
  r.org_z = ray.origin[2];
  r.dir_x = ray.direction[0];
  r.dir_y = ray.direction[1];
  r.dir_z = ray.direction[2];
  r.tnear = 0.0F;
  r.tfar = far_m;
  r.mask = 0xFFFFFFFFU;
  return r;
}

}  // namespace

struct RayTracer::Handles {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  ~Handles() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

RayTracer::RayTracer(std::span<const Vertex> vertices, std::span<const Triangle> triangles,
                     const std::string& instructions)
    : handles_(std::make_unique<Handles>()) {
  // Build in one thread, because the tree, and with it the choice among equal hits, must not depend
  // on the machine.
  std::string config = "threads=1,set_affinity=0";
  if (!instructions.empty()) config += ",isa=" + instructions;
  handles_->device = rtcNewDevice(config.c_str());
  if (handles_->device == nullptr) {
    throw Error("Embree could not start with \"" + config + "\" (error " +
                std::to_string(rtcGetDeviceError(nullptr)) + ")");
  }
  handles_->scene = rtcNewScene(handles_->device);
  // Use robust mode, because rays through a shared edge must not pass between the two triangles.
  rtcSetSceneFlags(handles_->scene, RTC_SCENE_FLAG_ROBUST);
  if (!triangles.empty()) {
    RTCGeometry geometry = rtcNewGeometry(handles_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertex_buffer = static_cast<Vertex*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vertex), vertices.size()));
    auto* index_buffer = static_cast<Triangle*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), triangles.size()));
    if (vertex_buffer == nullptr || index_buffer == nullptr) {
      rtcReleaseGeometry(geometry);
      throw Error("Embree has no memory for " + std::to_string(triangles.size()) + " triangles");
    }
    std::copy(vertices.begin(), vertices.end(), vertex_buffer);
    std::copy(triangles.begin(), triangles.end(), index_buffer);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(handles_->scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(handles_->scene);
  const RTCError error = rtcGetDeviceError(handles_->device);
  if (error != RTC_ERROR_NONE) {
    throw Error("Embree could not build the scene (error " + std::to_string(error) + ")");
  }
}

RayTracer::~RayTracer() = default;

void RayTracer::trace(std::span<const Ray> rays, std::span<RayHit> hits) const {
  constexpr std::size_t width = 8;
  for (std::size_t first = 0; first < rays.size(); first += width) {
    alignas(64) RTCRayHit8 packet;
    alignas(64) int valid[width];
    const std::size_t count = std::min(width, rays.size() - first);
    for (std::size_t i = 0; i < width; ++i) {
      const Ray& ray = rays[first + std::min(i, count - 1)];
      valid[i] = i < count ? -1 : 0;
      packet.ray.org_x[i] = ray.origin[0];
      packet.ray.org_y[i] = ray.origin[1];
      packet.ray.org_z[i] = ray.origin[2];
      packet.ray.tnear[i] = 0.0F;
      packet.ray.dir_x[i] = ray.direction[0];
      packet.ray.dir_y[i] = ray.direction[1];
      packet.ray.dir_z[i] = ray.direction[2];
      packet.ray.time[i] = 0.0F;
      packet.ray.tfar[i] = unlimited_distance_m;
      packet.ray.mask[i] = 0xFFFFFFFFU;
      packet.ray.id[i] = 0;
      packet.ray.flags[i] = 0;
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    intersect_eight(valid, handles_->scene, &packet);
    for (std::size_t i = 0; i < count; ++i) {
      const bool hit = packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      hits[first + i] =
          hit ? RayHit{packet.ray.tfar[i], packet.hit.u[i], packet.hit.v[i], packet.hit.primID[i]}
              : RayHit{};
    }
  }
}

RayHit RayTracer::first_hit(const Ray& ray) const {
  RTCRayHit r{};
  r.ray = to_embree(ray, unlimited_distance_m);
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  intersect_one(handles_->scene, &r);
  if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {r.ray.tfar, r.hit.u, r.hit.v, r.hit.primID};
}

}  // namespace panonav::simulation
