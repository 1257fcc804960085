// The parts of a dense map, put together by hand, over the test room.
#pragma once

#include "dense/scene_naming/object_test_world.hpp"
#include "dense/view_intake.hpp"

namespace ygslam::object_test {

struct Parts {
  Camera camera = room_camera();
  World world = two_boxes();
  DenseMapConfig config;
  std::shared_ptr<ViewUnpacker> unpacker = std::make_shared<ViewUnpacker>();
  ViewStore store;
  FusedVolume fused;
  PixelJudge judge;
  ViewPolicy policy;
  std::map<KeyframeId, SE3> poses;

  explicit Parts(const DenseMapConfig& its_config = {})
      : config(its_config),
        fused(config, unpacker),
        judge(config, camera, unpacker),
        policy(config, unpacker) {}

  static Timestamp at_s(double t_s) { return {static_cast<std::int64_t>(1e9 * t_s)}; }

  /// A keyframe, or a frame tied to `anchor`; of the world as it is now, in the store alone.
  DenseViewId give(std::uint32_t keyframe, const SE3& T_world_camera, double t_s,
                   std::optional<KeyframeId> anchor = {}) {
    DenseFrame frame = keyframe_of(world, camera, keyframe, T_world_camera,
                                   {{kChair, 0.8F}, {kScreen, 0.6F}}, at_s(t_s));
    IncomingView incoming = incoming_view(frame, config, camera);
    DenseView view{std::make_shared<const StoredView>(incoming.images),
                   std::move(incoming.observations), frame.frame->stamp};
    if (anchor)
      view.anchor = DenseAnchor{*anchor, {}, T_world_camera.inverse() * poses.at(*anchor)};
    else
      poses[KeyframeId{keyframe}] = T_world_camera;
    const DenseViewId id = store.add(KeyframeId{keyframe}, std::move(view));
    store.set_poses(poses);
    return id;
  }
  /// Judged, if it was not, and put in.
  void fuse(DenseViewId id) {
    if (judge.state(id) == nullptr) judge.judge_objects(id, store, fused);
    const DenseView& view = store.at(id);
    fused.sync(id, {view.images, view.stamp, *view.T_world_camera, *judge.state(id)});
  }
  DenseViewId look(std::uint32_t keyframe, const SE3& T_world_camera, double t_s) {
    const DenseViewId id = give(keyframe, T_world_camera, t_s);
    fuse(id);
    return id;
  }
  /// Keyframes 0 to 6, one each second, from one side of the room to the other.
  void look_around() {
    for (std::uint32_t i = 0; i < 7; ++i) look(i, view_pose(i), i);
  }
};

}  // namespace ygslam::object_test
