// KHR_draco_mesh_compression. The only file that sees Draco is gltf_draco.cpp. Private to the loader.
#pragma once

#include "actors/scene/gltf_document.hpp"
#include "actors/scene/primitive_data.hpp"

namespace darm::scene::gltf {

/// Decodes the mesh of a primitive whose `extension` is KHR_draco_mesh_compression. The stream's own counts of faces
/// and points are checked before it is decoded.
Result<PrimitiveData> decode_draco(Document& document, const tinygltf::Primitive& primitive,
                                   const tinygltf::Value& extension);

}  // namespace darm::scene::gltf
