#include "simulation/texture_recipes.hpp"

#include "simulation/recipe_kit.hpp"

namespace ygslam::sim {

PaintedMaterial paint_material(const std::string& kind, int variant, int size) {
  for (const RecipeTable* table : {&building_recipes(), &office_recipes(), &people_recipes()}) {
    if (const auto found = table->find(kind); found != table->end()) {
      return found->second(variant, size);
    }
  }
  CHECK(false, kind.c_str());
  return {};
}

const std::vector<std::string>& material_kinds() {
  static const std::vector<std::string> kinds = [] {
    std::vector<std::string> names;
    for (const RecipeTable* table : {&building_recipes(), &office_recipes(), &people_recipes()}) {
      for (const auto& [name, recipe] : *table) names.push_back(name);
    }
    return names;
  }();
  return kinds;
}

}  // namespace ygslam::sim
