#include "actors/scene/gltf_accessor.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace darm::scene::gltf {
namespace {

/// A run of elements inside a buffer view, checked to lie in it.
struct Elements {
  const std::uint8_t* data = nullptr;  ///< null: all zero
  std::size_t count = 0;
  std::size_t stride = 0;
};

std::string accessor_name(int index) { return "accessor " + std::to_string(index); }

Result<const tinygltf::Accessor*> find_accessor(const Document& document, int index) {
  if (index < 0 || static_cast<std::size_t>(index) >= document.model.accessors.size())
    return fail(accessor_name(index) + " does not exist");
  return &document.model.accessors[static_cast<std::size_t>(index)];
}

std::size_t component_size(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;  // glTF has no other
  }
}

template <class T>
T load(const std::uint8_t* p) {
  T value;
  std::memcpy(&value, p, sizeof value);
  return value;
}

double load_component(const std::uint8_t* p, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return load<std::int8_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *p;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return load<std::int16_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return load<std::uint16_t>(p);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return load<std::uint32_t>(p);
    default:
      return static_cast<double>(load<float>(p));
  }
}

/// Checks that `count` elements of `size` bytes, `stride` apart (0: packed), fit in the view, before anything is
/// allocated.
Result<Elements> elements_in_view(const Document& document, int view, std::uint64_t offset, std::uint64_t count,
                                  std::uint64_t size, std::uint64_t stride) {
  const auto bytes = document.view(view);
  if (!bytes) return std::unexpected(bytes.error());
  if (stride == 0) stride = size;
  if (stride < size) return fail("has a stride below its element size");
  const bool fits = offset <= bytes->size() && size <= bytes->size() - offset &&
                    (count - 1) <= (bytes->size() - offset - size) / stride;
  if (!fits) {
    return fail("needs " + std::to_string(count) + " elements of " + std::to_string(size) + " bytes at offset " +
                std::to_string(offset) + ", but bufferView " + std::to_string(view) + " has " +
                std::to_string(bytes->size()) + " bytes");
  }
  return Elements{bytes->data() + offset, count, stride};
}

Result<Elements> base_elements(const Document& document, const tinygltf::Accessor& a, std::size_t size) {
  if (a.count == 0) return fail("has no elements");
  if (a.bufferView < 0) return Elements{nullptr, a.count, 0};
  const auto index = static_cast<std::size_t>(a.bufferView);
  std::size_t stride = 0;
  if (index < document.model.bufferViews.size()) {
    const auto& view = document.model.bufferViews[index];
    const auto* meshopt = find_extension(view.extensions, "EXT_meshopt_compression");
    stride = meshopt ? static_cast<std::size_t>(std::max(0, integer_or(*meshopt, "byteStride", 0))) : view.byteStride;
    // For indices the stride of a meshopt view is the element size itself; a plain view of indices has none.
  }
  return elements_in_view(document, a.bufferView, a.byteOffset, a.count, size, stride);
}

/// Calls write(element, bytes) for every sparse element.
template <class Write>
Result<void> apply_sparse(const Document& document, const tinygltf::Accessor& a, std::size_t size, Write&& write) {
  if (!a.sparse.isSparse) return {};
  const auto& s = a.sparse;
  const std::size_t index_size = component_size(s.indices.componentType);
  const bool unsigned_index = s.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                              s.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                              s.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  if (s.count < 1 || static_cast<std::size_t>(s.count) > a.count || !unsigned_index || s.indices.byteOffset < 0 ||
      s.values.byteOffset < 0)
    return fail("has bad sparse data");
  const auto count = static_cast<std::uint64_t>(s.count);
  const auto indices = elements_in_view(document, s.indices.bufferView,
                                        static_cast<std::uint64_t>(s.indices.byteOffset), count, index_size, 0);
  if (!indices) return std::unexpected(indices.error().within("sparse indices"));
  const auto values =
      elements_in_view(document, s.values.bufferView, static_cast<std::uint64_t>(s.values.byteOffset), count, size, 0);
  if (!values) return std::unexpected(values.error().within("sparse values"));
  for (std::size_t i = 0; i < count; ++i) {
    const auto target =
        static_cast<std::size_t>(load_component(indices->data + i * indices->stride, s.indices.componentType));
    if (target >= a.count)
      return fail("sparse index " + std::to_string(target) + " is past its " + std::to_string(a.count) + " elements");
    write(target, values->data + i * values->stride);
  }
  return {};
}

Result<FloatArray> read_floats_of(Document& document, const tinygltf::Accessor& a, int min_components,
                                  int max_components) {
  const int components = a.type == TINYGLTF_TYPE_SCALAR ? 1 : a.type;  // VEC2..VEC4 are 2..4
  if (components < min_components || components > max_components) return fail("has the wrong number of components");
  const std::size_t one = component_size(a.componentType);
  if (one == 0) return fail("has a component type that glTF does not know");
  const std::size_t size = one * static_cast<std::size_t>(components);
  const auto base = base_elements(document, a, size);
  if (!base) return std::unexpected(base.error());
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max() / 64;
  if (a.count > most) return fail("has too many elements");
  if (auto ok = document.reserve(a.count * static_cast<std::uint64_t>(components) * sizeof(float), "its data"); !ok)
    return std::unexpected(ok.error());
  FloatArray out{a.count, components, {}};
  out.values.assign(a.count * static_cast<std::size_t>(components), 0.0f);
  const bool is_float = a.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT;
  const bool is_signed =
      a.componentType == TINYGLTF_COMPONENT_TYPE_BYTE || a.componentType == TINYGLTF_COMPONENT_TYPE_SHORT;
  const float scale = a.normalized && !is_float ? 1.0f / normalized_one(a.componentType) : 1.0f;
  const auto write = [&](std::size_t element, const std::uint8_t* p) {
    float* to = out.values.data() + element * static_cast<std::size_t>(components);
    if (is_float) {
      std::memcpy(to, p, size);
      return;
    }
    for (int c = 0; c < components; ++c) {
      const float value =
          static_cast<float>(load_component(p + static_cast<std::size_t>(c) * one, a.componentType)) * scale;
      to[c] = a.normalized && is_signed ? std::max(value, -1.0f) : value;
    }
  };
  if (base->data)
    for (std::size_t i = 0; i < a.count; ++i) write(i, base->data + i * base->stride);
  if (auto ok = apply_sparse(document, a, size, write); !ok) return std::unexpected(ok.error());
  return out;
}

Result<std::vector<std::uint32_t>> read_indices_of(Document& document, const tinygltf::Accessor& a) {
  const bool valid = a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                     a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                     a.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  if (a.type != TINYGLTF_TYPE_SCALAR || !valid) return fail("is not a list of unsigned integers");
  const std::size_t size = component_size(a.componentType);
  const auto base = base_elements(document, a, size);
  if (!base) return std::unexpected(base.error());
  if (!base->data) return fail("holds indices but has no bufferView");
  if (auto ok = document.reserve(a.count * sizeof(std::uint32_t), "its data"); !ok) return std::unexpected(ok.error());
  std::vector<std::uint32_t> out(a.count);
  const auto write = [&](std::size_t element, const std::uint8_t* p) {
    out[element] = static_cast<std::uint32_t>(load_component(p, a.componentType));
  };
  for (std::size_t i = 0; i < a.count; ++i) write(i, base->data + i * base->stride);
  if (auto ok = apply_sparse(document, a, size, write); !ok) return std::unexpected(ok.error());
  return out;
}

}  // namespace

float normalized_one(int component_type) {
  switch (component_type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return 127.0f;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 255.0f;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return 32767.0f;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 65535.0f;
    default:
      return 1.0f;
  }
}

Result<FloatArray> read_floats(Document& document, int index, int min_components, int max_components) {
  const auto accessor = find_accessor(document, index);
  if (!accessor) return std::unexpected(accessor.error());
  auto out = read_floats_of(document, **accessor, min_components, max_components);
  if (!out) return std::unexpected(out.error().within(accessor_name(index)));
  return out;
}

Result<std::vector<std::uint32_t>> read_indices(Document& document, int index) {
  const auto accessor = find_accessor(document, index);
  if (!accessor) return std::unexpected(accessor.error());
  auto out = read_indices_of(document, **accessor);
  if (!out) return std::unexpected(out.error().within(accessor_name(index)));
  return out;
}

}  // namespace darm::scene::gltf
