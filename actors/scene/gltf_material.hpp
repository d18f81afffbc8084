// glTF materials -> Material. Private to the loader.
#pragma once

#include "actors/scene/gltf_document.hpp"

namespace darm::scene::gltf {

/// All materials of the file, in order, with a default one at the end. Texture references hold indices of the file's
/// images. Factors are clamped to their legal range; nonsense references are errors.
Result<std::vector<Material>> read_materials(Document& document);

}  // namespace darm::scene::gltf
