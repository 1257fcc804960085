#include "simulation/random/random_body.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "geometry/random_vector.hpp"
#include "simulation/people/clothes.hpp"

namespace ygslam::sim {

namespace {

/// Two baked bodies mixed, and a little beyond either; then stretched.
BodyShape mixed_shape(const BodyModel& baked, Rng& rng) {
  const auto pick = [&]() -> const BodyShape& {
    return baked.shapes[rng.below(static_cast<std::uint32_t>(baked.shapes.size()))];
  };
  const BodyShape& a = pick();
  const BodyShape& b = pick();
  const double share = rng.uniform(-0.4, 1.4);
  const bool child = rng.uniform() < 0.2;
  const double tall = child ? rng.uniform(0.5, 0.85) : rng.uniform(0.9, 1.1);
  const double wide = std::clamp(rng.normal(1, 0.12), 0.75, 1.5);
  const double deep = wide * std::clamp(rng.normal(1, 0.08), 0.8, 1.3);
  const Vec3 stretch = tall * Vec3(deep, wide, 1);
  BodyShape shape;
  shape.name = rng.uniform() < 0.5 ? "woman" : "man";
  for (std::size_t i = 0; i < kBones; ++i)
    shape.joints[i] = ((1 - share) * a.joints[i] + share * b.joints[i]).cwiseProduct(stretch);
  shape.points.resize(a.points.size());
  const auto k = static_cast<float>(share);
  const Vec3f by = stretch.cast<float>();
  for (std::size_t i = 0; i < shape.points.size(); ++i)
    shape.points[i] = ((1 - k) * a.points[i] + k * b.points[i]).cwiseProduct(by);
  // Children have large heads; others' differ a little.
  const double head = std::pow(tall, child ? -0.6 : -0.3) * rng.uniform(0.95, 1.08) / wide;
  const Vec3f neck = shape.joints[index(Bone::kNeck1)].cast<float>();
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const BodyModel::Weights& w = baked.weights[i];
    float of_head = 0;
    for (int n = 0; n < 4; ++n)
      of_head += w.bone[n] == index(Bone::kHead) ? static_cast<float>(w.share[n]) / 255 : 0;
    const Vec3f larger(static_cast<float>(head * wide / deep), static_cast<float>(head),
                       static_cast<float>(head * wide));
    const Vec3f grown = neck + (shape.points[i] - neck).cwiseProduct(larger);
    shape.points[i] += of_head * (grown - shape.points[i]);
  }
  return shape;
}

std::vector<Vec3f> normals_of(const std::vector<Triangle>& triangles,
                              const std::vector<std::uint32_t>& twin,
                              const std::vector<Vec3f>& points) {
  std::vector<Vec3f> normals;
  smooth_normals(triangles, twin, points, normals);
  return normals;
}

/// Lets clothes and hair stand off the body, unevenly.
void loosen(const BodyModel& baked, BodyShape& shape, Rng& rng) {
  std::vector<float> off_m(shape.points.size(), 0);
  const auto set = [&](const std::string& part, double most_m) {
    const auto amount = static_cast<float>(rng.uniform(0, most_m));
    for (const Triangle& t : baked.triangles) {
      if (baked.parts[t.material] != part) continue;
      for (const std::uint32_t corner : t.corner) off_m[corner] = std::max(off_m[corner], amount);
    }
  };
  const bool thick = rng.uniform() < 0.35;  // coats and wide trousers
  const double top_m = thick ? 0.05 : 0.02;
  for (const char* part : {"shirt", "sleeve", "long_sleeve"}) set(part, top_m);
  const double bottom_m = rng.uniform() < 0.35 ? 0.045 : 0.015;
  for (const char* part : {"trousers_hip", "trousers_thigh", "trousers_shin"}) set(part, bottom_m);
  set("scalp", rng.uniform() < 0.3 ? 0.07 : 0.025);
  set("long_hair", 0.03);
  set("shoe", 0.012);
  const std::vector<Vec3f> normals = normals_of(baked.triangles, baked.twin, shape.points);
  const Vec3f wave = random_in_box<3>(rng, {10, 10, 6}, {30, 30, 25}).cast<float>();
  const auto phase = static_cast<float>(rng.uniform(0, 6.3));
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    if (off_m[i] == 0) continue;
    const float fold = 0.7F + 0.45F * std::sin(wave.dot(shape.points[baked.twin[i]]) + phase);
    shape.points[i] += off_m[i] * fold * normals[i];
  }
}

MaterialId random_cloth(MaterialLibrary& materials, Rng& rng) {
  if (rng.uniform() < 0.4) {
    const auto code = [&] { return static_cast<float>(rng.uniform(15, 245)); };
    const float grey = code();
    auto rgb = drawn_vector<Vec3f>(code);
    rgb += static_cast<float>(rng.uniform()) * (Vec3f::Constant(grey) - rgb);
    return materials.plain(rgb, static_cast<float>(rng.uniform(0.4, 1)));
  }
  static const std::array<std::string, 5> kinds = {"plaid", "stripes", "jeans", "cloth", "print"};
  const auto variant = static_cast<int>(rng.below(64));
  return materials.get(kinds[rng.below(5)], variant);
}

PersonPlan random_outfit(Rng& rng) {
  static const std::array<std::string, 4> tops = {"plaid", "stripes", "cloth", "print"};
  PersonPlan plan;
  plan.body = 0;
  plan.top = tops[rng.below(4)];
  plan.top_variant = static_cast<int>(rng.below(64));
  plan.bottom = rng.uniform() < 0.5 ? "jeans" : "cloth";
  plan.bottom_variant = static_cast<int>(rng.below(64));
  plan.skin = static_cast<int>(rng.below(5));
  plan.hair = static_cast<int>(rng.below(5));
  plan.short_sleeves = rng.uniform() < 0.4;
  plan.shorts = rng.uniform() < 0.2;
  return plan;
}

/// Adds vertices to a figure.
class Tailor {
 public:
  Tailor(RandomFigure& figure, MaterialLibrary& materials, Rng& rng)
      : figure_(figure), shape_(figure.model.shapes[0]), materials_(materials), rng_(rng) {}

  /// A skirt, or from higher up a coat or a dress: a tube around the legs.
  void add_skirt() {
    const Vec3 hips = joint(Bone::kHips);
    const Vec3 thigh = joint(Bone::kLeftThigh);
    const bool coat = rng_.uniform() < 0.4;
    const double top_m = coat ? joint(Bone::kSpine).z() : hips.z() + 0.03 * hips.z();
    const double hem_m = rng_.uniform(0.12, 0.62) * hips.z();
    const double flare = rng_.uniform(0, 0.7);
    const auto [half_x, half_y] = girth_at(hips.z());
    const MaterialId cloth = random_cloth(materials_, rng_);
    constexpr int kRings = 7;
    constexpr int kSides = 28;
    const auto first = static_cast<std::uint32_t>(shape_.points.size());
    const double folds = rng_.uniform(0, 0.08);
    const auto waves = static_cast<double>(4 + rng_.below(7));
    for (int ring = 0; ring < kRings; ++ring) {
      const double s = static_cast<double>(ring) / (kRings - 1);
      const double z = top_m + s * (hem_m - top_m);
      const double below = std::clamp((thigh.z() - z) / (thigh.z() - hem_m + 1e-6), 0.0, 1.0);
      for (int k = 0; k < kSides; ++k) {
        const double a = 2 * std::numbers::pi * k / kSides;
        const double out = 1.06 + flare * s + folds * s * std::sin(waves * a);
        const Vec3 p(hips.x() + half_x * out * std::cos(a), half_y * out * std::sin(a), z);
        const double left = std::clamp(0.5 + 0.9 * std::sin(a), 0.0, 1.0);
        const double legs = 0.85 * std::min(1.0, 2.5 * below);
        add_vertex(p, {a * half_y, z},
                   {{{Bone::kHips, 1 - legs},
                     {Bone::kLeftThigh, legs * left},
                     {Bone::kRightThigh, legs * (1 - left)}}});
      }
    }
    for (std::uint32_t ring = 0; ring + 1 < kRings; ++ring) {
      for (std::uint32_t k = 0; k < kSides; ++k) {
        const std::uint32_t a = first + ring * kSides + k;
        const std::uint32_t b = first + ring * kSides + (k + 1) % kSides;
        figure_.topology.triangles.push_back({{a, a + kSides, b}, cloth});
        figure_.topology.triangles.push_back({{b, a + kSides, b + kSides}, cloth});
      }
    }
  }

  void add_hat() {
    const Vec3f head = top_of_head();
    const auto r = static_cast<float>(rng_.uniform(0.095, 0.13));
    const MaterialId m = random_cloth(materials_, rng_);
    Mesh hat;
    const Vec3f under(0, 0, static_cast<float>(rng_.uniform(0.07, 0.11)));
    add_cylinder(hat, head - under, head + Vec3f(0, 0, 0.02F), r,
                 r * static_cast<float>(rng_.uniform(0.4, 1)), 16, m);
    if (rng_.uniform() < 0.4) {
      add_cylinder(hat, head - under, head - under + Vec3f(0, 0, 0.012F), 1.7F * r, 1.7F * r, 16,
                   m);
    }
    attach(hat, Bone::kHead);
  }

  /// A rucksack on the back, or something in a hand.
  void add_luggage() {
    const MaterialId m = random_cloth(materials_, rng_);
    Mesh box;
    if (rng_.uniform() < 0.6) {
      const Vec3f back = joint(Bone::kChest).cast<float>() - Vec3f(0.1F, 0, 0.02F);
      const Vec3f half =
          random_in_box<3>(rng_, {0.06, 0.12, 0.16}, {0.13, 0.19, 0.28}).cast<float>();
      add_box(box, back - half - Vec3f(half.x(), 0, 0.1F), back + half - Vec3f(half.x(), 0, 0.1F),
              m);
      attach(box, Bone::kChest);
    } else {
      const Bone hand = rng_.uniform() < 0.5 ? Bone::kLeftHand : Bone::kRightHand;
      const Vec3f at = joint(static_cast<Bone>(index(hand) + 1)).cast<float>();
      const Vec3f half =
          random_in_box<3>(rng_, {0.01, 0.01, 0.01}, {0.1, 0.08, 0.12}).cast<float>();
      add_box(box, at - half, at + half, m);
      attach(box, hand);
    }
  }

 private:
  using Shares = std::array<std::pair<Bone, double>, 3>;
  [[nodiscard]] const Vec3& joint(Bone bone) const { return shape_.joints[index(bone)]; }

  [[nodiscard]] std::pair<double, double> girth_at(double z) const {
    double x = 0.08;
    double y = 0.1;
    for (std::size_t i = 0; i < shape_.points.size(); ++i) {
      const Vec3 p = shape_.points[i].cast<double>();
      const std::uint8_t main = figure_.model.weights[i].bone[0];
      const bool arm = main >= index(Bone::kLeftShoulder) && main <= index(Bone::kRightThumb);
      if (arm || std::abs(p.z() - z) > 0.06) continue;
      x = std::max(x, std::abs(p.x() - joint(Bone::kHips).x()));
      y = std::max(y, std::abs(p.y()));
    }
    return {x, y};
  }
  [[nodiscard]] Vec3f top_of_head() const {
    Vec3f top = joint(Bone::kHead).cast<float>();
    for (const Vec3f& p : shape_.points) top.z() = std::max(top.z(), p.z());
    return top;
  }
  void add_vertex(const Vec3& p, const Vec2& uv, const Shares& shares) {
    BodyModel::Weights w{};
    int left = 255;
    for (std::size_t k = shares.size(); k-- > 0;) {
      const int share = k == 0 ? left : std::min(left, static_cast<int>(255 * shares[k].second));
      w.bone[k] = static_cast<std::uint8_t>(index(shares[k].first));
      w.share[k] = static_cast<std::uint8_t>(share);
      left -= share;
    }
    // skin() stops at the first bone without a share.
    for (std::size_t k = 1; k < shares.size(); ++k) {
      if (w.share[k] > 0 && w.share[k - 1] == 0) {
        std::swap(w.share[k], w.share[k - 1]);
        std::swap(w.bone[k], w.bone[k - 1]);
      }
    }
    shape_.points.push_back(p.cast<float>());
    figure_.model.weights.push_back(w);
    figure_.model.twin.push_back(static_cast<std::uint32_t>(shape_.points.size() - 1));
    figure_.topology.uv.push_back(uv.cast<float>());
  }
  void attach(const Mesh& mesh, Bone bone) {
    const auto first = static_cast<std::uint32_t>(shape_.points.size());
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      add_vertex(mesh.points[i].cast<double>(), mesh.uv[i].cast<double>(),
                 {{{bone, 1}, {bone, 0}, {bone, 0}}});
    }
    for (Triangle t : mesh.triangles) {
      for (std::uint32_t& corner : t.corner) corner += first;
      figure_.topology.triangles.push_back(t);
    }
  }

  RandomFigure& figure_;
  BodyShape& shape_;
  MaterialLibrary& materials_;
  Rng& rng_;
};

BodyModel with_one_shape(const BodyModel& baked, Rng& rng) {
  BodyModel model;
  model.parts = baked.parts;
  model.triangles = baked.triangles;
  model.uv = baked.uv;
  model.weights = baked.weights;
  model.twin = baked.twin;
  model.parent = baked.parent;
  BodyShape shape = mixed_shape(baked, rng);
  loosen(baked, shape, rng);
  model.shapes.push_back(std::move(shape));
  return model;
}

}  // namespace

RandomFigure random_figure(const BodyModel& baked, MaterialLibrary& materials, Rng& rng) {
  RandomFigure figure;
  figure.model = with_one_shape(baked, rng);
  figure.topology = dressed(figure.model, random_outfit(rng), materials);
  for (const Vec3f& p : figure.model.shapes[0].points)
    figure.height_m = std::max(figure.height_m, static_cast<double>(p.z()));
  Tailor tailor(figure, materials, rng);
  if (rng.uniform() < 0.3) tailor.add_skirt();
  if (rng.uniform() < 0.15) tailor.add_hat();
  if (rng.uniform() < 0.2) tailor.add_luggage();
  return figure;
}

Mesh hung_coat(const BodyModel& baked, MaterialLibrary& materials, Rng& rng) {
  const BodyModel model = with_one_shape(baked, rng);
  const BodyShape& shape = model.shapes[0];
  PoseBuilder builder(model, shape);
  const double arm_m = builder.length(Bone::kLeftArm, Bone::kLeftForeArm) * 2;
  for (const int side : {1, -1}) {
    const Bone arm = side > 0 ? Bone::kLeftArm : Bone::kRightArm;
    builder.reach(arm, builder.joint(arm) + arm_m * Vec3(0, side * rng.uniform(-0.05, 0.1), -1),
                  Vec3(-1, 0, 0));
  }
  std::vector<Vec3f> points;
  skin(model, shape, builder.finish(SE3()), points);
  const MaterialId cloth = random_cloth(materials, rng);
  Mesh coat;
  coat.points = points;
  coat.uv = model.uv;
  for (const Triangle& t : model.triangles) {
    const std::string& part = model.parts[t.material];
    if (part == "shirt" || part == "sleeve" || part == "long_sleeve" || part == "trousers_hip")
      coat.triangles.push_back({t.corner, cloth});
  }
  // Flat, shoulders slumped, its back to the wall.
  const Vec3f shoulder = shape.joints[index(Bone::kNeck)].cast<float>();
  const auto flat = static_cast<float>(rng.uniform(0.25, 0.7));
  const auto narrow = static_cast<float>(rng.uniform(0.5, 0.9));
  for (Vec3f& p : coat.points) {
    const Vec3f q = p - shoulder;
    p = {q.y() * narrow, -(q.x() + 0.12F) * flat - 0.02F, q.z()};
  }
  coat.normals = normals_of(coat.triangles, model.twin, coat.points);
  return coat;
}

const BodyPose& RandomBody::pose_at(double t_s) const {
  const auto last = static_cast<std::ptrdiff_t>(poses_.size()) - 1;
  const auto shot = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(t_s), 0, last);
  return poses_[static_cast<std::size_t>(shot)];
}

SE3 RandomBody::T_world_root(double t_s) const {
  const BodyPose& pose = pose_at(t_s);
  return pose.T_world_body * SE3(pose.R[0], pose.joints[0]);
}

void RandomBody::shape_at(double t_s, std::vector<Vec3f>& p_world,
                          std::vector<Vec3f>& normals) const {
  skin(figure_->model, figure_->model.shapes[0], pose_at(t_s), p_world);
  smooth_normals(figure_->topology.triangles, figure_->model.twin, p_world, normals);
}

}  // namespace ygslam::sim
