#include "likeness/geometry/ray_scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>

#include "likeness/base/error.h"

namespace likeness {
namespace {

// One device for the process: it holds no scene state, only Embree's settings.
RTCDevice Device() {
  // One build thread: scenes are built from many threads side by side.
  static const RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
  if (device == nullptr) throw Error("Embree cannot start: error {}", static_cast<int>(rtcGetDeviceError(nullptr)));
  return device;
}

bool FacesRay(RTCRayN* ray, RTCHitN* hit, unsigned int count, unsigned int i) {
  const float dot = RTCRayN_dir_x(ray, count, i) * RTCHitN_Ng_x(hit, count, i) +
                    RTCRayN_dir_y(ray, count, i) * RTCHitN_Ng_y(hit, count, i) +
                    RTCRayN_dir_z(ray, count, i) * RTCHitN_Ng_z(hit, count, i);
  return dot < 0;
}

void RejectBackFaces(const RTCFilterFunctionNArguments* args) {
  for (unsigned int i = 0; i < args->N; ++i) {
    if (args->valid[i] != 0 && !FacesRay(args->ray, args->hit, args->N, i)) args->valid[i] = 0;
  }
}

RTCRay SingleRay(const Ray& ray) {
  RTCRay single = {};
  single.org_x = ray.origin.x();
  single.org_y = ray.origin.y();
  single.org_z = ray.origin.z();
  single.tnear = ray.t_min;
  single.dir_x = ray.direction.x();
  single.dir_y = ray.direction.y();
  single.dir_z = ray.direction.z();
  single.tfar = ray.t_max;
  single.mask = ~0u;
  return single;
}

constexpr size_t kPacket = 16;

void FillPacket(std::span<const Ray> rays, int* valid, RTCRay16* packet) {
  for (size_t i = 0; i < rays.size(); ++i) {
    valid[i] = -1;
    packet->org_x[i] = rays[i].origin.x();
    packet->org_y[i] = rays[i].origin.y();
    packet->org_z[i] = rays[i].origin.z();
    packet->tnear[i] = rays[i].t_min;
    packet->dir_x[i] = rays[i].direction.x();
    packet->dir_y[i] = rays[i].direction.y();
    packet->dir_z[i] = rays[i].direction.z();
    packet->tfar[i] = rays[i].t_max;
    packet->mask[i] = ~0u;
  }
}

// Bit i is set when lane i is valid and occluded.
uint32_t OccludedLanes(RTCScene scene, const int* valid, RTCRay16* packet) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(valid, scene, &context, packet);
  uint32_t occluded = 0;
  for (size_t i = 0; i < kPacket; ++i) occluded |= (valid[i] != 0 && packet->tfar[i] < 0 ? 1u : 0u) << i;
  return occluded;
}

}  // namespace

struct RayScene::Impl {
  RTCScene scene = nullptr;

  Impl() : scene(rtcNewScene(Device())) { rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST); }
  ~Impl() { rtcReleaseScene(scene); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
};

RayScene::RayScene() : impl_(std::make_unique<Impl>()) {}
RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

int RayScene::Add(const Vertices& vertices, const std::vector<Eigen::Vector3i>& triangles, bool one_sided) {
  const RTCGeometry geometry = rtcNewGeometry(Device(), RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree reads 16 bytes from the last vertex, so it allocates (and pads) the buffers itself.
  void* vertex_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                3 * sizeof(float), static_cast<size_t>(vertices.rows()));
  void* index_buffer = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                               3 * sizeof(uint32_t), triangles.size());
  if ((vertices.rows() > 0 && vertex_buffer == nullptr) || (!triangles.empty() && index_buffer == nullptr)) {
    rtcReleaseGeometry(geometry);
    throw Error("Embree has no memory for {} triangles", triangles.size());
  }
  if (vertices.rows() > 0) std::memcpy(vertex_buffer, vertices.data(), sizeof(float) * vertices.size());
  if (!triangles.empty()) std::memcpy(index_buffer, triangles[0].data(), 3 * sizeof(int) * triangles.size());
  if (one_sided) {
    rtcSetGeometryIntersectFilterFunction(geometry, RejectBackFaces);
    rtcSetGeometryOccludedFilterFunction(geometry, RejectBackFaces);
  }
  rtcCommitGeometry(geometry);
  const unsigned int id = rtcAttachGeometry(impl_->scene, geometry);
  rtcReleaseGeometry(geometry);
  return static_cast<int>(id);
}

void RayScene::Build() { rtcCommitScene(impl_->scene); }

RayHit RayScene::Intersect(const Ray& ray) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query = {};
  query.ray = SingleRay(ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {static_cast<int>(query.hit.geomID), static_cast<int>(query.hit.primID), query.ray.tfar, query.hit.u,
          query.hit.v};
}

bool RayScene::Occluded(const Ray& ray) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay query = SingleRay(ray);
  rtcOccluded1(impl_->scene, &context, &query);
  return query.tfar < 0;
}

void RayScene::Intersect16(std::span<const Ray> rays, std::span<RayHit> hits) const {
  LIKENESS_CHECK(rays.size() <= kPacket && hits.size() == rays.size());
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(64) int valid[kPacket] = {};
  RTCRayHit16 query = {};
  FillPacket(rays, valid, &query.ray);
  std::fill(std::begin(query.hit.geomID), std::end(query.hit.geomID), RTC_INVALID_GEOMETRY_ID);
  rtcIntersect16(valid, impl_->scene, &context, &query);
  for (size_t i = 0; i < rays.size(); ++i) {
    hits[i] = {};
    if (query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    hits[i] = {static_cast<int>(query.hit.geomID[i]), static_cast<int>(query.hit.primID[i]), query.ray.tfar[i],
               query.hit.u[i], query.hit.v[i]};
  }
}

uint32_t RayScene::Occluded16(std::span<const Ray> rays) const {
  LIKENESS_CHECK(rays.size() <= kPacket);
  alignas(64) int valid[kPacket] = {};
  RTCRay16 query = {};
  FillPacket(rays, valid, &query);
  return OccludedLanes(impl_->scene, valid, &query);
}

uint32_t RayScene::Occluded16(const RayPacket16& rays, uint32_t active) const {
  alignas(64) int valid[kPacket];
  RTCRay16 query;
  const auto copy = [](float(&to)[kPacket], const float(&from)[kPacket]) { std::memcpy(to, from, sizeof(to)); };
  copy(query.org_x, rays.origin_x);
  copy(query.org_y, rays.origin_y);
  copy(query.org_z, rays.origin_z);
  copy(query.dir_x, rays.direction_x);
  copy(query.dir_y, rays.direction_y);
  copy(query.dir_z, rays.direction_z);
  copy(query.tnear, rays.t_min);
  copy(query.tfar, rays.t_max);
  for (size_t i = 0; i < kPacket; ++i) {
    valid[i] = (active >> i & 1) != 0 ? -1 : 0;
    query.time[i] = 0;
    query.mask[i] = ~0u;
    query.id[i] = query.flags[i] = 0;
  }
  return OccludedLanes(impl_->scene, valid, &query);
}

}  // namespace likeness
