#include "actors/scene/gltf_material.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

namespace darm::scene::gltf {
namespace {

constexpr double kMaxEmissiveStrength = 1e12;  // sums and squares of such light stay finite

float finite_clamped(double value, double low, double high, double fallback) {
  return static_cast<float>(std::isfinite(value) ? std::clamp(value, low, high) : fallback);
}

Wrap wrap_of(int mode) {
  if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::kClampToEdge;
  if (mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT) return Wrap::kMirroredRepeat;
  return Wrap::kRepeat;
}

double element_or(const tinygltf::Value& object, const char* key, int index, double fallback) {
  if (!object.Has(key) || !object.Get(key).IsArray() || static_cast<std::size_t>(index) >= object.Get(key).ArrayLen())
    return fallback;
  const tinygltf::Value& element = object.Get(key).Get(index);
  return element.IsNumber() && std::isfinite(element.GetNumberAsDouble()) ? element.GetNumberAsDouble() : fallback;
}

/// KHR_texture_transform: translation * rotation * scale, applied to (u, v, 1).
glm::mat3 uv_transform(const tinygltf::Value& t) {
  const auto sx = static_cast<float>(element_or(t, "scale", 0, 1.0));
  const auto sy = static_cast<float>(element_or(t, "scale", 1, 1.0));
  const double angle = number_or(t, "rotation", 0.0);
  const auto c = static_cast<float>(std::isfinite(angle) ? std::cos(angle) : 1.0);
  const auto s = static_cast<float>(std::isfinite(angle) ? std::sin(angle) : 0.0);
  const auto ox = static_cast<float>(element_or(t, "offset", 0, 0.0));
  const auto oy = static_cast<float>(element_or(t, "offset", 1, 0.0));
  return {glm::vec3(c * sx, -s * sx, 0), glm::vec3(s * sy, c * sy, 0), glm::vec3(ox, oy, 1)};
}

/// Reads texture references for one document, collecting what it cannot follow.
class TextureReader {
 public:
  explicit TextureReader(Document& document) : document_(document) {}

  Result<TextureRef> read(int index, int tex_coord, const tinygltf::ExtensionMap& extensions) {
    const auto* transform = find_extension(extensions, "KHR_texture_transform");
    return read(index, transform ? integer_or(*transform, "texCoord", tex_coord) : tex_coord, transform);
  }

  /// A textureInfo inside a material extension.
  Result<TextureRef> read(const tinygltf::Value& extension, const char* key) {
    if (!extension.Has(key) || !extension.Get(key).IsObject()) return TextureRef{};
    const tinygltf::Value& info = extension.Get(key);
    const tinygltf::Value* transform = nullptr;
    if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform")) {
      transform = &info.Get("extensions").Get("KHR_texture_transform");
      if (!transform->IsObject()) transform = nullptr;
    }
    const int tex_coord = integer_or(info, "texCoord", 0);
    return read(integer_or(info, "index", -1), transform ? integer_or(*transform, "texCoord", tex_coord) : tex_coord,
                transform);
  }

 private:
  Result<TextureRef> read(int index, int tex_coord, const tinygltf::Value* transform) {
    TextureRef ref;
    if (index < 0) return ref;
    const auto& model = document_.model;
    if (static_cast<std::size_t>(index) >= model.textures.size())
      return fail("names texture " + std::to_string(index) + ", which does not exist");
    const tinygltf::Texture& texture = model.textures[static_cast<std::size_t>(index)];
    if (texture.source < 0) {
      warn("textures without a PNG or JPEG source are left out");
      return ref;
    }
    if (static_cast<std::size_t>(texture.source) >= document_.images.size())
      return fail("names image " + std::to_string(texture.source) + ", which does not exist");
    if (tex_coord < 0 || tex_coord > 1) {
      warn("textures on a UV set beyond TEXCOORD_1 are left out");
      return ref;
    }
    ref.image = texture.source;
    ref.uv_set = static_cast<std::uint8_t>(tex_coord);
    if (transform) ref.uv_transform = uv_transform(*transform);
    if (texture.sampler >= 0 && static_cast<std::size_t>(texture.sampler) < model.samplers.size()) {
      const tinygltf::Sampler& sampler = model.samplers[static_cast<std::size_t>(texture.sampler)];
      ref.wrap_s = wrap_of(sampler.wrapS);
      ref.wrap_t = wrap_of(sampler.wrapT);
      ref.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    }
    return ref;
  }

  void warn(const char* text) {
    if (std::ranges::find(document_.warnings, text) == document_.warnings.end()) document_.warnings.emplace_back(text);
  }

  Document& document_;
};

Result<void> read_core(TextureReader& textures, const tinygltf::Material& in, Material& out) {
  const auto& pbr = in.pbrMetallicRoughness;
  for (int c = 0; c < 4; ++c)
    if (static_cast<std::size_t>(c) < pbr.baseColorFactor.size())
      out.base_color[c] = finite_clamped(pbr.baseColorFactor[static_cast<std::size_t>(c)], 0.0, 1.0, 1.0);
  out.metallic = finite_clamped(pbr.metallicFactor, 0.0, 1.0, 1.0);
  out.roughness = finite_clamped(pbr.roughnessFactor, 0.0, 1.0, 1.0);
  out.normal_scale = finite_clamped(in.normalTexture.scale, -1e3, 1e3, 1.0);
  for (int c = 0; c < 3; ++c)
    if (static_cast<std::size_t>(c) < in.emissiveFactor.size())
      out.emissive[c] = finite_clamped(in.emissiveFactor[static_cast<std::size_t>(c)], 0.0, 1.0, 0.0);
  const auto base =
      textures.read(pbr.baseColorTexture.index, pbr.baseColorTexture.texCoord, pbr.baseColorTexture.extensions);
  const auto rough = textures.read(pbr.metallicRoughnessTexture.index, pbr.metallicRoughnessTexture.texCoord,
                                   pbr.metallicRoughnessTexture.extensions);
  const auto normal = textures.read(in.normalTexture.index, in.normalTexture.texCoord, in.normalTexture.extensions);
  const auto emissive =
      textures.read(in.emissiveTexture.index, in.emissiveTexture.texCoord, in.emissiveTexture.extensions);
  for (const auto* result : {&base, &rough, &normal, &emissive})
    if (!*result) return std::unexpected(result->error());
  out.base_color_texture = *base;
  out.metallic_roughness_texture = *rough;
  out.normal_texture = *normal;
  out.emissive_texture = *emissive;
  if (in.alphaMode == "MASK") out.alpha_mode = AlphaMode::kMask;
  if (in.alphaMode == "BLEND") out.alpha_mode = AlphaMode::kBlend;
  out.alpha_cutoff = finite_clamped(in.alphaCutoff, 0.0, 1e6, 0.5);
  out.double_sided = in.doubleSided;
  return {};
}

double emissive_strength(const tinygltf::Material& in) {
  const auto* e = find_extension(in.extensions, "KHR_materials_emissive_strength");
  return e ? number_or(*e, "emissiveStrength", 1.0) : 1.0;
}

Result<void> read_extensions(TextureReader& textures, const tinygltf::Material& in, Material& out) {
  out.emissive *= finite_clamped(emissive_strength(in), 0.0, kMaxEmissiveStrength, 1.0);
  if (const auto* e = find_extension(in.extensions, "KHR_materials_ior")) {
    const double ior = number_or(*e, "ior", 1.5);
    // 0 is glTF's way to say "reflect everything"; otherwise light cannot be faster than in vacuum.
    out.ior = ior == 0.0 ? 0.0f : finite_clamped(ior, 1.0, 100.0, 1.5);
  }
  if (const auto* e = find_extension(in.extensions, "KHR_materials_transmission")) {
    out.transmission = finite_clamped(number_or(*e, "transmissionFactor", 0.0), 0.0, 1.0, 0.0);
    const auto texture = textures.read(*e, "transmissionTexture");
    if (!texture) return std::unexpected(texture.error());
    out.transmission_texture = *texture;
  }
  if (out.ior == 0.0f) out.transmission = 0;  // all is reflected: nothing is left to pass
  if (const auto* e = find_extension(in.extensions, "KHR_materials_volume")) {
    out.thickness = finite_clamped(number_or(*e, "thicknessFactor", 0.0), 0.0, 1e6, 0.0);
    out.attenuation_distance = finite_clamped(number_or(*e, "attenuationDistance", 0.0), 0.0, 1e12, 0.0);
    for (int c = 0; c < 3; ++c)
      out.attenuation_color[c] = finite_clamped(element_or(*e, "attenuationColor", c, 1.0), 0.0, 1.0, 1.0);
  }
  out.unlit = in.extensions.contains("KHR_materials_unlit");
  return {};
}

}  // namespace

Result<std::vector<Material>> read_materials(Document& document) {
  TextureReader textures(document);
  std::vector<Material> materials;
  materials.reserve(document.model.materials.size() + 1);
  for (std::size_t i = 0; i < document.model.materials.size(); ++i) {
    const tinygltf::Material& in = document.model.materials[i];
    Material out;
    out.name = in.name;
    auto ok = read_core(textures, in, out);
    if (ok) ok = read_extensions(textures, in, out);
    if (!ok) return fail(named("material", i, in.name) + " " + ok.error().message);
    materials.push_back(std::move(out));
  }
  Material fallback;
  fallback.name = "default";
  materials.push_back(std::move(fallback));
  return materials;
}

}  // namespace darm::scene::gltf
