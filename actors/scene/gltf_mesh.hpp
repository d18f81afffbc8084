// glTF primitives -> Mesh. Private to the loader.
#pragma once

#include "actors/scene/gltf_document.hpp"
#include "actors/scene/primitive_data.hpp"

namespace darm::scene::gltf {

/// Reads primitive `index` of a mesh as triangles. Points and lines give an empty result. Attribute counts and indices
/// are checked; an index past the vertices is an error. Errors do not name the primitive: the caller does.
Result<PrimitiveData> read_primitive(Document& document, const tinygltf::Primitive& primitive);

}  // namespace darm::scene::gltf
