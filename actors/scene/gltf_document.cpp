#include "actors/scene/gltf_document.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "actors/scene/gltf_meshopt.hpp"
#include "actors/scene/gltf_ranges.hpp"

namespace darm::scene::gltf {
namespace {

using Json = nlohmann::json;

// tinygltf turns `extras` and `extensions` into values by recursion.
constexpr int kMaxNesting = 64;
// A parsed JSON value costs a few dozen bytes; scenes of a million nodes stay well below this.
constexpr std::size_t kMaxJsonBytes = 256u << 20;

constexpr std::array<std::string_view, 12> kSupported = {
    "KHR_lights_punctual",        "KHR_materials_emissive_strength",
    "KHR_materials_transmission", "KHR_materials_ior",
    "KHR_materials_volume",       "KHR_materials_unlit",
    "KHR_texture_transform",      "KHR_mesh_quantization",
    "KHR_draco_mesh_compression", "EXT_meshopt_compression",
    "EXT_mesh_gpu_instancing",    "MESHOPT_fallback_buffer"};

bool is_supported(const std::string& extension) { return std::ranges::find(kSupported, extension) != kSupported.end(); }

/// True if brackets nest deeper than kMaxNesting, counted without parsing.
bool nests_too_deep(std::string_view text) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > kMaxNesting) return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

/// At most `most` bytes, without half a character at the end: reports are JSON, which takes whole ones alone.
std::string shortened(std::string text, std::size_t most) {
  if (text.size() <= most) return text;
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xc0) == 0x80) --most;
  text.resize(most);
  return text;
}

std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  std::ranges::replace_if(text, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return shortened(std::move(text), 300);
}

std::string text_member(const Json& object, const char* key) {
  const auto it = object.find(key);
  return it != object.end() && it->is_string() ? it->get<std::string>() : std::string();
}

Result<void> check_version(const Json& root) {
  const auto asset = root.find("asset");
  if (asset == root.end() || !asset->is_object()) return fail("not a glTF 2.0 file: has no asset.version");
  const std::string version = text_member(*asset, "version");
  if (!version.starts_with("2.")) return fail("glTF version '" + one_line(version) + "' is not supported, only 2.0");
  const std::string minimum = text_member(*asset, "minVersion");
  if (!minimum.empty() && minimum != "2.0")
    return fail("needs glTF version '" + one_line(minimum) + "', only 2.0 is supported");
  return {};
}

Result<void> check_extensions(const Json& root, std::vector<std::string>& warnings) {
  std::string required;
  std::string unsupported;
  const auto append = [](std::string& list, const Json& name) {
    if (!name.is_string() || is_supported(name.get<std::string>())) return;
    list += (list.empty() ? "" : ", ") + one_line(name.get<std::string>());
  };
  if (const auto it = root.find("extensionsRequired"); it != root.end() && it->is_array())
    for (const auto& name : *it) append(required, name);
  if (!required.empty()) return fail("requires the extension " + required + ", which is not supported");
  if (const auto it = root.find("extensionsUsed"); it != root.end() && it->is_array())
    for (const auto& name : *it) append(unsupported, name);
  if (!unsupported.empty()) warnings.push_back("not supported and left out: " + unsupported);
  return {};
}

Result<void> fetch_buffers(const Json& root, Document& document) {
  const auto buffers = root.find("buffers");
  if (buffers == root.end()) return {};
  if (!buffers->is_array()) return fail("`buffers` is not an array");
  for (std::size_t i = 0; i < buffers->size(); ++i) {
    const Json& buffer = (*buffers)[i];
    const std::string name = "buffer " + std::to_string(i);
    if (!buffer.is_object() || !buffer.contains("byteLength") || !buffer["byteLength"].is_number_unsigned())
      return fail(name + " has no byteLength");
    const auto length = buffer["byteLength"].get<std::uint64_t>();
    const std::string uri = text_member(buffer, "uri");
    Bytes bytes;
    if (!uri.empty()) {
      const auto resolved = document.file.resolve(uri);
      if (!resolved) return std::unexpected(resolved.error().within(name));
      bytes = *resolved;
    } else if (i == 0 && document.file.binary_chunk()) {
      bytes = *document.file.binary_chunk();
    } else {
      document.buffers.emplace_back();  // a meshopt fallback: an error only for who reads it
      continue;
    }
    if (length > bytes.size())
      return fail(name + " declares " + std::to_string(length) + " bytes, has " + std::to_string(bytes.size()));
    document.buffers.push_back(bytes.first(length));
  }
  return {};
}

Result<void> list_images(const Json& root, Document& document) {
  const auto images = root.find("images");
  if (images == root.end()) return {};
  if (!images->is_array()) return fail("`images` is not an array");
  for (std::size_t i = 0; i < images->size(); ++i) {
    const Json& image = (*images)[i];
    if (!image.is_object()) return fail("image " + std::to_string(i) + " is not an object");
    ImageSource source;
    source.name = text_member(image, "name");
    source.uri = text_member(image, "uri");
    if (source.name.empty() && !source.uri.starts_with("data:")) source.name = source.uri;
    if (const auto view = image.find("bufferView"); view != image.end() && view->is_number_integer())
      source.buffer_view = view->get<int>();
    if (source.uri.empty() && source.buffer_view < 0)
      return fail(named("image", i, source.name) + " has neither a uri nor a bufferView");
    document.images.push_back(std::move(source));
  }
  return {};
}

/// tinygltf would read and copy buffers and images itself, and refuses index accessors without a buffer view, which
/// Draco files have by design: it gets the document without them.
void strip_for_tinygltf(Json& root) {
  root.erase("buffers");
  root.erase("images");
  root.erase("animations");
  const auto meshes = root.find("meshes");
  if (meshes == root.end() || !meshes->is_array()) return;
  for (Json& mesh : *meshes) {
    if (!mesh.is_object() || !mesh.contains("primitives") || !mesh["primitives"].is_array()) continue;
    for (Json& primitive : mesh["primitives"]) {
      if (!primitive.is_object()) continue;
      const auto extensions = primitive.find("extensions");
      if (extensions != primitive.end() && extensions->is_object() &&
          extensions->contains("KHR_draco_mesh_compression"))
        primitive.erase("indices");
    }
  }
}

Result<void> check_counts(const Json& root, const LoadLimits& limits) {
  for (const char* key :
       {"nodes", "meshes", "accessors", "bufferViews", "materials", "textures", "images", "samplers", "scenes"}) {
    const auto it = root.find(key);
    if (it != root.end() && it->is_array() && it->size() > limits.max_nodes)
      return fail("has " + std::to_string(it->size()) + " " + key + ", over the limit of " +
                  std::to_string(limits.max_nodes));
  }
  return {};
}

void warn_of_motion(const Json& root, std::vector<std::string>& warnings) {
  const auto filled = [&](const char* key) {
    const auto it = root.find(key);
    return it != root.end() && it->is_array() && !it->empty();
  };
  if (filled("animations")) warnings.emplace_back("animations are not played: shown in the pose of the file");
  if (filled("skins")) warnings.emplace_back("skins are not supported: shown in the bind pose");
}

Result<void> decode_views(Document& document) {
  const std::size_t count = document.model.bufferViews.size();
  document.decoded_views.resize(count);
  document.buffer_views.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    auto bytes = decode_buffer_view(document, i);
    if (!bytes)
      return std::unexpected(bytes.error().within(named("bufferView", i, document.model.bufferViews[i].name)));
    document.buffer_views[i] = *bytes;
  }
  return {};
}

Result<Json> parse_json(std::string_view text) {
  if (text.size() > kMaxJsonBytes)
    return fail("JSON part over the limit of " + std::to_string(kMaxJsonBytes) + " bytes");
  if (nests_too_deep(text)) return fail("JSON nests deeper than " + std::to_string(kMaxNesting) + " levels");
  try {
    Json root = Json::parse(text);
    if (!root.is_object()) return fail("JSON is not an object");
    return root;
  } catch (const std::exception& e) {
    return fail("JSON is not valid: " + one_line(e.what()));
  }
}

Result<void> parse_model(Json& root, tinygltf::Model& model) {
  strip_for_tinygltf(root);
  const std::string text = root.dump(-1, ' ', false, Json::error_handler_t::replace);
  tinygltf::TinyGLTF parser;
  std::string error;
  std::string warning;
  try {
    if (parser.LoadASCIIFromString(&model, &error, &warning, text.data(), static_cast<unsigned>(text.size()), ""))
      return {};
  } catch (const std::exception& e) {
    error = e.what();
  }
  return fail("not a valid glTF document: " + one_line(error));
}

}  // namespace

Result<void> Document::reserve(std::uint64_t bytes, const std::string& what) {
  if (bytes > limits.max_decoded_bytes - decoded_bytes)
    return fail(what + " takes the scene over the limit of " + std::to_string(limits.max_decoded_bytes) +
                " decoded bytes");
  decoded_bytes += bytes;
  return {};
}

Result<Bytes> Document::view(int index) const {
  if (index < 0 || static_cast<std::size_t>(index) >= buffer_views.size())
    return fail("names bufferView " + std::to_string(index) + ", which does not exist");
  return buffer_views[static_cast<std::size_t>(index)];
}

std::string named(const char* kind, std::size_t index, const std::string& name) {
  std::string text = std::string(kind) + " " + std::to_string(index);
  if (!name.empty()) text += " '" + one_line(shortened(name, 80)) + "'";
  return text;
}

double number_or(const tinygltf::Value& object, const char* key, double fallback) {
  if (!object.Has(key) || !object.Get(key).IsNumber()) return fallback;
  return object.Get(key).GetNumberAsDouble();
}

int integer_or(const tinygltf::Value& object, const char* key, int fallback) {
  const double value = number_or(object, key, fallback);
  return value >= -2147483648.0 && value <= 2147483647.0 ? static_cast<int>(value) : fallback;
}

const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const char* name) {
  const auto it = extensions.find(name);
  return it != extensions.end() && it->second.IsObject() ? &it->second : nullptr;
}

Result<Document> parse_document(GltfFile file, const LoadLimits& limits) {
  Document document;
  document.file = std::move(file);
  document.limits = limits;
  auto root = parse_json(document.file.json());
  if (!root) return std::unexpected(root.error());
  if (const auto ok = check_version(*root); !ok) return std::unexpected(ok.error());
  if (const auto ok = check_extensions(*root, document.warnings); !ok) return std::unexpected(ok.error());
  if (const auto ok = check_counts(*root, limits); !ok) return std::unexpected(ok.error());
  warn_of_motion(*root, document.warnings);
  warn_of_ranges(*root, document.warnings);
  if (const auto ok = list_images(*root, document); !ok) return std::unexpected(ok.error());
  if (const auto ok = fetch_buffers(*root, document); !ok) return std::unexpected(ok.error());
  if (const auto ok = parse_model(*root, document.model); !ok) return std::unexpected(ok.error());
  if (const auto ok = decode_views(document); !ok) return std::unexpected(ok.error());
  return document;
}

}  // namespace darm::scene::gltf
