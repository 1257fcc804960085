#include "simulation/ray_scene.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/check.hpp"
#include "simulation/parallel.hpp"

namespace ygslam::sim {

namespace {
/// New triangle geometry with room for points; indices are filled in.
RTCGeometry make_geometry(RTCDevice device, const std::vector<Triangle>& triangles,
                          std::size_t points, float** p_buffer) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* indices = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), triangles.size()));
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    std::memcpy(indices + 3 * i, triangles[i].corner.data(), 3 * sizeof(std::uint32_t));
  }
  *p_buffer = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), points));
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
};

RayScene::RayScene(const Scene& scene) : scene_(scene), embree_(std::make_unique<Embree>()) {
  // One build thread: the tree, and with it every tie between coincident hits, repeats.
  embree_->device = rtcNewDevice("threads=1,set_affinity=0");
  CHECK(embree_->device != nullptr, "Embree does not start");
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
  rtcCommitScene(embree_->fixed);

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
    }
    state.geometry = make_geometry(device, mesh.triangles, count, &state.p_buffer);
    // A body keeps the tree of its first pose; only the boxes of the tree follow its motion.
    // (Embree refits a geometry only within a scene of low quality.)
    if (mover.is_body()) rtcSetGeometryBuildQuality(state.geometry, RTC_BUILD_QUALITY_REFIT);
    fill_points(state.p_buffer, mover.is_body() ? state.points : mesh.points);
    rtcCommitGeometry(state.geometry);
    rtcAttachGeometry(state.scene, state.geometry);
    rtcReleaseGeometry(state.geometry);
    rtcCommitScene(state.scene);
    state.instance = add_instance(state.scene, static_cast<unsigned>(i));
  }
  rtcCommitScene(embree_->moving);
}

RayScene::~RayScene() {
  for (const MoverState& state : movers_) rtcReleaseScene(state.scene);
}

void RayScene::update_mover(std::size_t i, double t_s, double before_s) {
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
    rtcUpdateGeometryBuffer(state.geometry, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(state.geometry);
    rtcCommitScene(state.scene);
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
               [&](int i) { update_mover(static_cast<std::size_t>(i), t_s, before_s); });
  for (const MoverState& state : movers_) rtcCommitGeometry(state.instance);
  rtcCommitScene(embree_->moving);
}

namespace {
/// Fills the rays of an Embree packet; works for RTCRay16 alone and within a RTCRayHit16.
void fill(const RayPacket& rays, RTCRay16& packet, int* valid) {
  const auto first = std::find(rays.active.begin(), rays.active.end(), true);
  const int any = first == rays.active.end() ? 0 : static_cast<int>(first - rays.active.begin());
  for (int k = 0; k < kPacket; ++k) {
    // Lanes that are not in use hold no stray numbers: Embree computes with them all the same.
    const int from = rays.active[k] ? k : any;
    valid[k] = rays.active[k] ? -1 : 0;
    packet.org_x[k] = rays.origin[from].x();
    packet.org_y[k] = rays.origin[from].y();
    packet.org_z[k] = rays.origin[from].z();
    packet.dir_x[k] = rays.direction[from].x();
    packet.dir_y[k] = rays.direction[from].y();
    packet.dir_z[k] = rays.direction[from].z();
    packet.tnear[k] = 0;
    packet.tfar[k] = rays.reach[from];
    packet.time[k] = 0;
    packet.mask[k] = ~0U;
    packet.id[k] = 0;
    packet.flags[k] = 0;
  }
}

void read(const RayPacket& rays, const RTCRayHit16& packet, RayScene::Hits& hits) {
  for (int k = 0; k < kPacket; ++k) {
    hits[k] = RayHit{};
    if (!rays.active[k] || packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
    hits[k].distance = packet.ray.tfar[k];
    hits[k].triangle = packet.hit.primID[k];
    hits[k].u = packet.hit.u[k];
    hits[k].v = packet.hit.v[k];
    const unsigned instance = packet.hit.instID[0][k];
    hits[k].object = instance == RTC_INVALID_GEOMETRY_ID ? std::uint16_t{0}
                                                         : static_cast<std::uint16_t>(1 + instance);
  }
}
}  // namespace

void RayScene::intersect(const RayPacket& rays, RayTarget target, Hits& hits,
                         Hits* on_fixed) const {
  alignas(64) RTCRayHit16 packet;
  alignas(64) int valid[kPacket];
  fill(rays, packet.ray, valid);
  for (int k = 0; k < kPacket; ++k) {
    packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, embree_->fixed, &context, &packet);
  if (on_fixed != nullptr) read(rays, packet, *on_fixed);
  if (target == RayTarget::kAll && !movers_.empty()) {
    // Only what is nearer than the fixed scene is found now.
    rtcIntersect16(valid, embree_->moving, &context, &packet);
  }
  read(rays, packet, hits);
}

void RayScene::occluded(const RayPacket& rays, const Flags& ask_movers, Flags& by_fixed,
                        Flags& by_mover) const {
  alignas(64) RTCRay16 packet;
  alignas(64) int valid[kPacket];
  fill(rays, packet, valid);
  RTCIntersectContext context;
  rtcInitIntersectContext(
      &context);  // as coherent rays, some packets never come back (Embree 3.13)
  rtcOccluded16(valid, embree_->fixed, &context, &packet);
  bool ask = false;
  for (int k = 0; k < kPacket; ++k) {
    by_fixed[k] = rays.active[k] && packet.tfar[k] < 0;
    by_mover[k] = false;
    valid[k] = rays.active[k] && ask_movers[k] && !by_fixed[k] ? -1 : 0;
    ask |= valid[k] != 0;
  }
  if (!ask || movers_.empty()) return;
  rtcOccluded16(valid, embree_->moving, &context, &packet);
  for (int k = 0; k < kPacket; ++k) by_mover[k] = valid[k] != 0 && packet.tfar[k] < 0;
}

SurfacePoint RayScene::surface(const RayHit& hit) const {
  SurfacePoint surface;
  const float w = 1 - hit.u - hit.v;
  const bool fixed = hit.object == 0;
  const Mover* mover = fixed ? nullptr : &scene_.movers[hit.object - 1];
  const bool body = mover != nullptr && mover->is_body();
  const Mesh& mesh = fixed ? scene_.fixed : (body ? mover->body->topology() : mover->mesh);
  const Triangle& triangle = mesh.triangles[hit.triangle];
  const auto& [a, b, c] = triangle.corner;
  surface.material = triangle.material;
  surface.uv = w * mesh.uv[a] + hit.u * mesh.uv[b] + hit.v * mesh.uv[c];
  const std::vector<Vec3f>& normals = body ? movers_[hit.object - 1].normals : mesh.normals;
  Vec3f normal = w * normals[a] + hit.u * normals[b] + hit.v * normals[c];
  if (!fixed && !body) normal = movers_[hit.object - 1].R * normal;
  surface.normal = normal.normalized();
  return surface;
}

Vec3f RayScene::point_before(const RayHit& hit, const Vec3f& p_world) const {
  if (hit.object == 0 || hit.object == RayHit::kNothing) return p_world;
  const MoverState& state = movers_[hit.object - 1];
  const Mover& mover = scene_.movers[hit.object - 1];
  if (!mover.is_body()) return state.R_before_now * p_world + state.t_before_now;
  const auto& [a, b, c] = mover.body->topology().triangles[hit.triangle].corner;
  return (1 - hit.u - hit.v) * state.points_before[a] + hit.u * state.points_before[b] +
         hit.v * state.points_before[c];
}

}  // namespace ygslam::sim
