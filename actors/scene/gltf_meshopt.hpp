// EXT_meshopt_compression. Private to the loader.
#pragma once

#include "actors/scene/gltf_document.hpp"

namespace darm::scene::gltf {

/// Decodes buffer view `index` if it is compressed, else returns the plain bytes of its buffer.
Result<Bytes> decode_buffer_view(Document& document, std::size_t index);

}  // namespace darm::scene::gltf
