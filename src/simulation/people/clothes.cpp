#include "simulation/people/clothes.hpp"

#include <map>
#include <optional>
#include <string>

namespace ygslam::sim {

namespace {

/// Material of every part, nullopt for parts that do not show.
std::map<std::string, std::optional<MaterialId>> outfit(const PersonPlan& plan, bool long_hair,
                                                        MaterialLibrary& materials) {
  const MaterialId skin = materials.get("skin", plan.skin);
  const MaterialId hair = materials.get("hair", plan.hair);
  const MaterialId top = materials.get(plan.top, plan.top_variant);
  const MaterialId bottom = materials.get(plan.bottom, plan.bottom_variant);
  const MaterialId shoe = materials.plain({44, 38, 36}, 0.7F, 0.1F);
  const auto shown = [](bool yes, MaterialId id) { return yes ? std::optional(id) : std::nullopt; };
  return {{"skin", skin},
          {"scalp", hair},
          {"brow", hair},
          {"lips", materials.plain({176, 96, 88})},
          {"upper_arm_skin", shown(plan.short_sleeves, skin)},
          {"forearm_skin", shown(plan.short_sleeves, skin)},
          {"hand", skin},
          {"shin_skin", shown(plan.shorts, skin)},
          {"thigh_skin", shown(plan.shorts, skin)},
          {"shoe", shoe},
          {"shirt", top},
          {"sleeve", top},
          {"long_sleeve", shown(!plan.short_sleeves, top)},
          {"trousers_hip", bottom},
          {"trousers_thigh", bottom},
          {"trousers_shin", shown(!plan.shorts, bottom)},
          {"long_hair", shown(long_hair, hair)},
          {"eye_white", materials.plain({236, 232, 228})},
          {"iris", materials.plain({54, 40, 34})}};
}

}  // namespace

Mesh dressed(const BodyModel& model, const PersonPlan& plan, MaterialLibrary& materials) {
  const std::string& name = model.shapes[static_cast<std::size_t>(plan.body)].name;
  const auto materials_of = outfit(plan, name.starts_with("woman"), materials);
  std::vector<std::optional<MaterialId>> of_part;
  for (const std::string& part : model.parts) {
    const auto found = materials_of.find(part);
    of_part.push_back(found == materials_of.end() ? std::nullopt : found->second);
  }
  Mesh mesh;
  mesh.uv = model.uv;
  for (const Triangle& triangle : model.triangles) {
    if (const auto& material = of_part[triangle.material])
      mesh.triangles.push_back({triangle.corner, *material});
  }
  return mesh;
}

}  // namespace ygslam::sim
