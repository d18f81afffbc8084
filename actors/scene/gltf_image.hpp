// PNG and JPEG -> Image. Private to the loader; gltf_image.cpp is the only file that sees the decoder (stb).
#pragma once

#include <map>

#include "actors/scene/gltf_document.hpp"

namespace darm::scene::gltf {

/// Reads the header of every image of the document: a broken one is an error, one of a format that glTF's core does not
/// know is an error only for who uses it. Adds no pixels.
Result<void> check_images(Document& document);

/// Decodes the given images in parallel, into Scene::images order. Sizes are checked against the limits before
/// decoding.
Result<std::vector<Image>> decode_images(Document& document, const std::vector<std::size_t>& wanted);

}  // namespace darm::scene::gltf
