#include "simulation/surface/paint_material.hpp"

#include "simulation/surface/painters.hpp"

namespace ygslam::sim {

PaintedMaterial paint_material(const std::string& kind, int variant, int size) {
  for (const PainterTable* table : {&building_painters(), &office_painters(), &people_painters()}) {
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
    for (const PainterTable* table :
         {&building_painters(), &office_painters(), &people_painters()}) {
      for (const auto& [name, painter] : *table) names.push_back(name);
    }
    return names;
  }();
  return kinds;
}

}  // namespace ygslam::sim
