// The things of a scene, and what labels mean, as JSON.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "core/result.hpp"
#include "scene/scene.hpp"

namespace ygslam {

/// "candidate", "static", "moving", "settled", "absent" or "unobserved".
[[nodiscard]] std::string object_state_name(ObjectState state);
/// "chair 7".
[[nodiscard]] std::string object_name(const SceneObject& object);

/// One entry of objects.json. All numbers of the object must be finite.
[[nodiscard]] nlohmann::ordered_json object_json(const SceneObject& object, const Gravity& gravity);

/// objects.json: up and floor, the floor's frame, and every object. @return kOutput.
Status write_objects(const std::filesystem::path& path, std::span<const SceneObject> objects,
                     const Gravity& gravity);

/// labels.json: number, name and colour of every class. @return kOutput.
Status write_labels(const std::filesystem::path& path);

}  // namespace ygslam
