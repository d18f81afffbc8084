// Accessors -> plain arrays: any component type, normalized or not, strided, sparse. Private to the loader.
#pragma once

#include <vector>

#include "actors/scene/gltf_document.hpp"

namespace darm::scene::gltf {

/// `count` elements of `components` floats each, tightly packed. Normalized integers are mapped to [-1, 1] or [0, 1] as
/// glTF says; others keep their value.
struct FloatArray {
  std::size_t count = 0;
  int components = 0;
  std::vector<float> values;
  [[nodiscard]] const float* at(std::size_t i) const {
    return values.data() + i * static_cast<std::size_t>(components);
  }
};

/// Reads accessor `index`, which must have between min_components and max_components per element.
Result<FloatArray> read_floats(Document& document, int index, int min_components, int max_components);

/// Reads a scalar accessor of unsigned integers.
Result<std::vector<std::uint32_t>> read_indices(Document& document, int index);

/// Largest value of an unsigned component type, or of a signed one: what a normalized 1.0 is stored as. 1 for floats.
float normalized_one(int component_type);

}  // namespace darm::scene::gltf
