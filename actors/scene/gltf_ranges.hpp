#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace darm::scene::gltf {

/// Names each number of a material or a light that is read otherwise than it is written: outside the range that glTF
/// gives it or that we can compute with (the nearer end is taken), or of another shape (the default stands for what is
/// missing). A few by name, of the rest their count: a dark room has many causes, and a file can have a million
/// materials.
void warn_of_ranges(const nlohmann::json& root, std::vector<std::string>& warnings);

}  // namespace darm::scene::gltf
