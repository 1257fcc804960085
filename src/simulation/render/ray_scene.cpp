#include "simulation/render/ray_scene.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>

#include "core/check.hpp"
#include "core/parallel.hpp"

namespace ygslam::sim {

namespace {
/// Throws what Embree met on this thread since the last call, if anything.
/// @param device null: it could not be made.
void check_errors(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  CHECK(device != nullptr && error == RTC_ERROR_NONE, "Embree failed");
}

/// New triangle geometry with room for points; indices are filled in.
RTCGeometry make_geometry(RTCDevice device, const std::vector<Triangle>& triangles,
                          std::size_t points, float** p_buffer) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), triangles.size()));
  *p_buffer = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), points));
  check_errors(device);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    std::memcpy(indices + 3 * i, triangles[i].corner.data(), 3 * sizeof(std::uint32_t));
  }
  return geometry;
}

void fill_points(float* buffer, const std::vector<Vec3f>& points) {
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  std::memcpy(buffer, points.data(), points.size() * sizeof(Vec3f));
}
}  // namespace

struct RayScene::Embree {
  RTCDevice device = nullptr;
  RTCScene fixed = nullptr;
  RTCScene moving = nullptr;  // one instance per mover
  ~Embree() {
    if (fixed != nullptr) rtcReleaseScene(fixed);
    if (moving != nullptr) rtcReleaseScene(moving);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

struct RayScene::MoverState {
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;  // inside `scene`; owned by it
  RTCGeometry instance = nullptr;  // inside the moving scene; owned by it
  float* p_buffer = nullptr;
  Eigen::Matrix3f R = Eigen::Matrix3f::Identity();  // world from object, now
  Vec3f t = Vec3f::Zero();
  Eigen::Matrix3f R_before_now = Eigen::Matrix3f::Identity();  // rigid: world before from world now
  Vec3f t_before_now = Vec3f::Zero();
  double time_s = std::numeric_limits<double>::quiet_NaN();
  std::vector<Vec3f> points, points_before, normals;  // bodies, world
  std::vector<Corners> corners;                       // rigid things, frame of the thing
};

std::vector<RayScene::Corners> RayScene::corners_of(const Mesh& mesh) {
  std::vector<Corners> corners(mesh.triangles.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Triangle& triangle = mesh.triangles[i];
    float* const rows[3] = {corners[i].a, corners[i].b, corners[i].c};
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t id = triangle.corner[static_cast<std::size_t>(k)];
      const Vec3f& n = mesh.normals[id];
      const Vec2f& uv = mesh.uv[id];
      const float row[8] = {n.x(), n.y(), n.z(), uv.x(), uv.y(), 0, 0, 0};
      std::copy(row, row + 8, rows[k]);
    }
    corners[i].a[7] = std::bit_cast<float>(static_cast<std::uint32_t>(triangle.material));
  }
  return corners;
}

RayScene::RayScene(const Scene& scene)
    : scene_(scene), embree_(std::make_unique<Embree>()), fixed_corners_(corners_of(scene.fixed)) {
  // One build thread: the tree, and with it every tie between coincident hits, repeats.
  embree_->device = rtcNewDevice("threads=1,set_affinity=0");
  check_errors(embree_->device);
  RTCDevice device = embree_->device;
  embree_->moving = rtcNewScene(device);
  embree_->fixed = rtcNewScene(device);
  rtcSetSceneFlags(embree_->moving, RTC_SCENE_FLAG_DYNAMIC);
  rtcSetSceneFlags(embree_->fixed, RTC_SCENE_FLAG_NONE);
  rtcSetSceneBuildQuality(embree_->fixed, RTC_BUILD_QUALITY_HIGH);

  const auto add_instance = [&](RTCScene inner, unsigned id) {
    RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, inner);
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(embree_->moving, instance, id);
    rtcReleaseGeometry(instance);
    return instance;
  };
  float* buffer = nullptr;
  RTCGeometry fixed =
      make_geometry(device, scene.fixed.triangles, scene.fixed.points.size(), &buffer);
  fill_points(buffer, scene.fixed.points);
  rtcCommitGeometry(fixed);
  rtcAttachGeometry(embree_->fixed, fixed);
  rtcReleaseGeometry(fixed);
  rtcJoinCommitScene(embree_->fixed);

  movers_.resize(scene.movers.size());
  for (std::size_t i = 0; i < movers_.size(); ++i) {
    const Mover& mover = scene.movers[i];
    MoverState& state = movers_[i];
    const Mesh& mesh = mover.is_body() ? mover.body->topology() : mover.mesh;
    state.scene = rtcNewScene(device);
    rtcSetSceneFlags(state.scene, RTC_SCENE_FLAG_DYNAMIC);
    std::size_t count = mesh.points.size();
    if (mover.is_body()) {
      mover.body->shape_at(0, state.points, state.normals);
      count = state.points.size();
      rtcSetSceneBuildQuality(state.scene, RTC_BUILD_QUALITY_LOW);
    } else {
      state.corners = corners_of(mesh);
    }
    state.geometry = make_geometry(device, mesh.triangles, count, &state.p_buffer);
    // A body keeps the tree of its first pose; only the boxes of the tree follow its motion.
    // (Embree refits a geometry only within a scene of low quality.)
    if (mover.is_body()) rtcSetGeometryBuildQuality(state.geometry, RTC_BUILD_QUALITY_REFIT);
    fill_points(state.p_buffer, mover.is_body() ? state.points : mesh.points);
    rtcCommitGeometry(state.geometry);
    rtcAttachGeometry(state.scene, state.geometry);
    rtcReleaseGeometry(state.geometry);
    rtcJoinCommitScene(state.scene);
    state.instance = add_instance(state.scene, static_cast<unsigned>(i));
  }
  rtcJoinCommitScene(embree_->moving);
  check_errors(embree_->device);
}

RayScene::~RayScene() {
  for (const MoverState& state : movers_) rtcReleaseScene(state.scene);
}

void RayScene::move_mover(std::size_t i, double t_s, double before_s) {
  const Mover& mover = scene_.movers[i];
  MoverState& state = movers_[i];
  if (mover.is_body()) {
    if (state.time_s == before_s) {
      state.points_before.swap(state.points);
    } else {
      mover.body->shape_at(before_s, state.points_before, state.normals);
    }
    mover.body->shape_at(t_s, state.points, state.normals);
    fill_points(state.p_buffer, state.points);
  } else {
    const SE3 T_world_object = mover.T_world_object(t_s);
    const SE3 T_before_now = mover.T_world_object(before_s) * T_world_object.inverse();
    state.R = T_world_object.R().cast<float>();
    state.t = T_world_object.t().cast<float>();
    state.R_before_now = T_before_now.R().cast<float>();
    state.t_before_now = T_before_now.t().cast<float>();
    float transform[12];
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) transform[3 * c + r] = state.R(r, c);
      transform[9 + c] = state.t[c];
    }
    rtcSetGeometryTransform(state.instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform);
  }
  state.time_s = t_s;
}

void RayScene::set_time(double t_s, double before_s, int threads) {
  parallel_for(static_cast<int>(movers_.size()), threads,
               [&](int i) { move_mover(static_cast<std::size_t>(i), t_s, before_s); });
  // One after the other, and always by "join": that way Embree works in its device's own arena of
  // one thread. A plain commit hands its work to the program's arena, whose worker then spins.
  for (std::size_t i = 0; i < movers_.size(); ++i) {
    const MoverState& state = movers_[i];
    if (scene_.movers[i].is_body()) {
      rtcUpdateGeometryBuffer(state.geometry, RTC_BUFFER_TYPE_VERTEX, 0);
      rtcCommitGeometry(state.geometry);
      rtcJoinCommitScene(state.scene);
    }
    rtcCommitGeometry(state.instance);
  }
  rtcJoinCommitScene(embree_->moving);
  check_errors(embree_->device);
}

namespace {
/// Fills the rays of an Embree packet; works for RTCRay16 alone and within a RTCRayHit16.
void fill(const RayPacket& rays, RTCRay16& packet) {
  int any = 0;
  while (any + 1 < kLanes && rays.active[any] == 0) ++any;
  const auto put = [&](const Floats16& from, float* to) {
    // Lanes that are not in use hold no stray numbers: Embree computes with them all the same.
    const float instead = from[any];
    for (int k = 0; k < kLanes; ++k) to[k] = rays.active[k] != 0 ? from[k] : instead;
  };
  put(rays.origin.x, packet.org_x);
  put(rays.origin.y, packet.org_y);
  put(rays.origin.z, packet.org_z);
  put(rays.direction.x, packet.dir_x);
  put(rays.direction.y, packet.dir_y);
  put(rays.direction.z, packet.dir_z);
  put(rays.reach, packet.tfar);
  for (int k = 0; k < kLanes; ++k) {
    packet.tnear[k] = packet.time[k] = 0;
    packet.mask[k] = ~0U;
    packet.id[k] = packet.flags[k] = 0;
  }
}

void read(const RayPacket& rays, const RTCRayHit16& packet, Hits16& hits) {
  for (int k = 0; k < kLanes; ++k) {
    const bool met = rays.active[k] != 0 && packet.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
    // Nothing in an instance (all ones) is the fixed scene.
    const auto object = static_cast<std::int32_t>(packet.hit.instID[0][k] + 1U);
    hits.object[k] = met ? object : Hits16::kNothing;
    hits.triangle[k] = met ? static_cast<std::int32_t>(packet.hit.primID[k]) : 0;
    hits.distance[k] = met ? packet.ray.tfar[k] : 0.0F;
    hits.u[k] = packet.hit.u[k];
    hits.v[k] = packet.hit.v[k];
  }
}

void clear(RTCHit16& hit) {
  for (int k = 0; k < kLanes; ++k) {
    hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    hit.primID[k] = 0;
    hit.u[k] = hit.v[k] = 0;
  }
}

void meet(RTCScene scene, const RayPacket& rays, RTCRayHit16& packet) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(rays.active.lane, scene, &context, &packet);
}

void blocked_by(RTCScene scene, const RayPacket& rays, Ints16& blocked) {
  alignas(64) RTCRay16 packet;
  fill(rays, packet);
  RTCIntersectContext context;
  rtcInitIntersectContext(
      &context);  // as coherent rays, some packets never come back (Embree 3.13)
  rtcOccluded16(rays.active.lane, scene, &context, &packet);
  for (int k = 0; k < kLanes; ++k) blocked[k] = rays.active[k] != 0 && packet.tfar[k] < 0 ? -1 : 0;
}
}  // namespace

void RayScene::intersect(const RayPacket& rays, Hits16& hits, Hits16* on_fixed) const {
  alignas(64) RTCRayHit16 packet;
  fill(rays, packet.ray);
  clear(packet.hit);
  meet(embree_->fixed, rays, packet);
  if (on_fixed != nullptr) read(rays, packet, *on_fixed);
  // Only what is nearer than the fixed scene is found now.
  if (!movers_.empty()) meet(embree_->moving, rays, packet);
  read(rays, packet, hits);
}

void RayScene::intersect_fixed(const RayPacket& rays, Hits16& hits) const {
  alignas(64) RTCRayHit16 packet;
  fill(rays, packet.ray);
  clear(packet.hit);
  meet(embree_->fixed, rays, packet);
  read(rays, packet, hits);
}

void RayScene::blocked_by_fixed(const RayPacket& rays, Ints16& blocked) const {
  blocked_by(embree_->fixed, rays, blocked);
}

void RayScene::blocked_by_movers(const RayPacket& rays, Ints16& blocked) const {
  if (movers_.empty()) {
    blocked.fill(0);
  } else {
    blocked_by(embree_->moving, rays, blocked);
  }
}

void RayScene::surfaces(const Hits16& hits, Surfaces16& surfaces) const {
  for (int k = 0; k < kLanes; ++k) {
    const std::int32_t object = hits.object[k];
    const float u = hits.u[k];
    const float v = hits.v[k];
    const float w = 1 - u - v;
    const auto index = static_cast<std::size_t>(hits.triangle[k]);
    Vec3f normal = Vec3f::UnitZ();
    Vec2f uv = Vec2f::Zero();
    std::int32_t material = 0;
    const bool fixed = object == 0;
    if (object > 0 && scene_.movers[static_cast<std::size_t>(object - 1)].is_body()) {
      const auto i = static_cast<std::size_t>(object - 1);
      const Mesh& mesh = scene_.movers[i].body->topology();
      const Triangle& triangle = mesh.triangles[index];
      const auto& [a, b, c] = triangle.corner;
      const std::vector<Vec3f>& normals = movers_[i].normals;
      normal = w * normals[a] + u * normals[b] + v * normals[c];
      uv = w * mesh.uv[a] + u * mesh.uv[b] + v * mesh.uv[c];
      material = triangle.material;
    } else if (object >= 0) {
      const Corners& corners = fixed ? fixed_corners_[index]
                                     : movers_[static_cast<std::size_t>(object - 1)].corners[index];
      float mixed[5];
      for (int j = 0; j < 5; ++j) mixed[j] = w * corners.a[j] + u * corners.b[j] + v * corners.c[j];
      normal = Vec3f(mixed[0], mixed[1], mixed[2]);
      if (!fixed) normal = movers_[static_cast<std::size_t>(object - 1)].R * normal;
      uv = Vec2f(mixed[3], mixed[4]);
      material = std::bit_cast<std::int32_t>(corners.a[7]);
    }
    surfaces.normal.x[k] = normal.x();
    surfaces.normal.y[k] = normal.y();
    surfaces.normal.z[k] = normal.z();
    surfaces.u[k] = uv.x();
    surfaces.v[k] = uv.y();
    surfaces.material[k] = material;
  }
  auto& [x, y, z] = surfaces.normal;
  for (int k = 0; k < kLanes; ++k) {
    const float norm = std::sqrt(x[k] * x[k] + y[k] * y[k] + z[k] * z[k]);
    const float scale = 1 / (norm > 0 ? norm : 1.0F);
    x[k] *= scale;
    y[k] *= scale;
    z[k] *= scale;
  }
}

Vec3f RayScene::point_before(const Hits16& hits, int lane, const Vec3f& p_world) const {
  const std::int32_t object = hits.object[lane];
  if (object <= 0) return p_world;
  const MoverState& state = movers_[static_cast<std::size_t>(object - 1)];
  const Mover& mover = scene_.movers[static_cast<std::size_t>(object - 1)];
  if (!mover.is_body()) return state.R_before_now * p_world + state.t_before_now;
  const auto index = static_cast<std::size_t>(hits.triangle[lane]);
  const auto& [a, b, c] = mover.body->topology().triangles[index].corner;
  const float u = hits.u[lane];
  const float v = hits.v[lane];
  return (1 - u - v) * state.points_before[a] + u * state.points_before[b] +
         v * state.points_before[c];
}

}  // namespace ygslam::sim
