#include "actors/scene/gltf_image.hpp"

#include <stb_image.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <thread>

namespace darm::scene::gltf {
namespace {

enum class Format { kPng, kJpeg, kOther };

Format format_of(Bytes bytes) {
  constexpr std::uint8_t kPngMagic[] = {0x89, 'P', 'N', 'G', 0x0d, 0x0a, 0x1a, 0x0a};
  if (bytes.size() >= sizeof kPngMagic && std::memcmp(bytes.data(), kPngMagic, sizeof kPngMagic) == 0)
    return Format::kPng;
  if (bytes.size() >= 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff) return Format::kJpeg;
  return Format::kOther;
}

/// Formats of optional extensions (WebP, KTX 2, DDS) that may stand beside a core image.
bool is_optional_format(Bytes bytes) {
  const auto starts = [&](const char* magic, std::size_t length) {
    return bytes.size() >= length && std::memcmp(bytes.data(), magic, length) == 0;
  };
  return starts("RIFF", 4) || starts("\xabKTX 20", 7) || starts("DDS ", 4);
}

Result<Bytes> fetch(Document& document, ImageSource& source) {
  if (source.fetched) return source.bytes;
  const auto bytes = source.uri.empty() ? document.view(source.buffer_view) : document.file.resolve(source.uri);
  if (!bytes) return std::unexpected(bytes.error());
  source.bytes = *bytes;
  source.fetched = true;
  return source.bytes;
}

struct Size {
  int width = 0;
  int height = 0;
};

Result<Size> header_of(Bytes bytes, const LoadLimits& limits) {
  if (format_of(bytes) == Format::kOther) return fail("is neither PNG nor JPEG");
  Size size;
  int channels = 0;
  if (bytes.size() > 0x7fffffff ||
      !stbi_info_from_memory(bytes.data(), static_cast<int>(bytes.size()), &size.width, &size.height, &channels))
    return fail("is damaged: its header cannot be read");
  const std::uint64_t pixels = static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height);
  if (size.width < 1 || size.height < 1 || pixels > limits.max_image_pixels)
    return fail("is " + std::to_string(size.width) + " x " + std::to_string(size.height) +
                " pixels, over the limit of " + std::to_string(limits.max_image_pixels));
  return size;
}

/// Decodes to RGBA; 16-bit PNGs lose their low byte.
Result<Image> decode(const ImageSource& source) {
  int width = 0;
  int height = 0;
  int channels = 0;
  stbi_uc* pixels =
      stbi_load_from_memory(source.bytes.data(), static_cast<int>(source.bytes.size()), &width, &height, &channels, 4);
  if (!pixels) return fail(std::string("is damaged: ") + stbi_failure_reason());
  Image image;
  image.name = source.name;
  image.width = static_cast<std::uint32_t>(width);
  image.height = static_cast<std::uint32_t>(height);
  image.pixels.assign(pixels, pixels + static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
  stbi_image_free(pixels);
  return image;
}

}  // namespace

Result<void> check_images(Document& document) {
  for (std::size_t i = 0; i < document.images.size(); ++i) {
    const auto bytes = fetch(document, document.images[i]);
    const std::string name = named("image", i, document.images[i].name);
    if (!bytes) return std::unexpected(bytes.error().within(name));
    if (is_optional_format(*bytes)) continue;
    if (const auto size = header_of(*bytes, document.limits); !size) return fail(name + " " + size.error().message);
  }
  return {};
}

Result<std::vector<Image>> decode_images(Document& document, const std::vector<std::size_t>& wanted) {
  std::uint64_t total = 0;
  for (const std::size_t i : wanted) {
    const std::string name = named("image", i, document.images[i].name);
    const auto bytes = fetch(document, document.images[i]);
    if (!bytes) return std::unexpected(bytes.error().within(name));
    const auto size = header_of(*bytes, document.limits);
    if (!size) return fail(name + " " + size.error().message);
    total += static_cast<std::uint64_t>(size->width) * static_cast<std::uint64_t>(size->height);
  }
  if (total > document.limits.max_total_pixels)
    return fail("has textures of " + std::to_string(total) + " pixels, over the limit of " +
                std::to_string(document.limits.max_total_pixels));

  std::vector<Result<Image>> decoded(wanted.size(), fail("was not decoded"));
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < wanted.size(); i = next++) decoded[i] = decode(document.images[wanted[i]]);
  };
  const unsigned machine = std::max(1u, std::thread::hardware_concurrency());
  const std::size_t threads =
      std::min<std::size_t>(document.limits.threads ? document.limits.threads : machine, wanted.size());
  {
    std::vector<std::jthread> crew;
    for (std::size_t t = 1; t < threads; ++t) crew.emplace_back(work);
    work();
  }
  std::vector<Image> images;
  for (std::size_t i = 0; i < decoded.size(); ++i) {
    if (!decoded[i])
      return fail(named("image", wanted[i], document.images[wanted[i]].name) + " " + decoded[i].error().message);
    images.push_back(std::move(*decoded[i]));
  }
  return images;
}

}  // namespace darm::scene::gltf
