#include "actors/renderer/picture_io.hpp"

#include <bit>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>

#include "actors/renderer/display_curve.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

namespace darm::renderer {
namespace {

static_assert(std::endian::native == std::endian::little, "PFM is written as it lies in memory");
constexpr std::uint32_t kLongestSide = 16384;

Result<void> write_bytes(const std::filesystem::path& path, const char* data, std::size_t size) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(data, static_cast<std::streamsize>(size));
  file.close();
  if (!file) return fail(path.string() + ": cannot be written; check the folder and the free space");
  return {};
}

void append_bytes(void* context, void* data, int size) {
  static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
}

}  // namespace

Result<void> write_png(const std::filesystem::path& path, const Picture& picture) {
  std::vector<std::uint8_t> codes;
  codes.reserve(picture.pixels.size() * 3);
  for (const auto& p : picture.pixels)
    for (int c = 0; c < 3; ++c) codes.push_back(srgb_code(p[c]));
  std::string bytes;
  const auto width = static_cast<int>(picture.width);
  if (stbi_write_png_to_func(append_bytes, &bytes, width, static_cast<int>(picture.height), 3, codes.data(),
                             width * 3) == 0)
    return fail(path.string() + ": the picture cannot be encoded as PNG");
  return write_bytes(path, bytes.data(), bytes.size());
}

Result<void> write_pfm(const std::filesystem::path& path, const Picture& picture) {
  std::string bytes = "PF\n" + std::to_string(picture.width) + " " + std::to_string(picture.height) + "\n-1.0\n";
  const std::size_t row = std::size_t{picture.width} * sizeof(glm::vec3);
  for (std::uint32_t y = picture.height; y-- > 0;)
    bytes.append(reinterpret_cast<const char*>(picture.pixels.data() + std::size_t{y} * picture.width), row);
  return write_bytes(path, bytes.data(), bytes.size());
}

Result<Picture> read_pfm(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(path.string() + ": cannot be read");
  std::string head(64, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  file.clear();
  std::istringstream words(head);
  std::string kind;
  std::uint32_t width = 0, height = 0;
  double scale = 0;
  words >> kind >> width >> height >> scale;
  const auto position = words.tellg();
  if (!words || position < 0 || (kind != "PF" && kind != "Pf") || scale == 0)
    return fail(path.string() + ": is no PFM picture");
  if (width == 0 || height == 0 || width > kLongestSide || height > kLongestSide)
    return fail(path.string() + ": its size is outside 1.." + std::to_string(kLongestSide) + " pixels a side");
  const std::size_t channels = kind == "PF" ? 3 : 1;
  const std::size_t start = static_cast<std::size_t>(position) + 1;
  const std::size_t bytes = std::size_t{width} * height * channels * sizeof(float);
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error || size != start + bytes) return fail(path.string() + ": is truncated or has bytes to spare");

  std::vector<float> values(bytes / sizeof(float));
  file.seekg(static_cast<std::streamoff>(start));
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(bytes));
  if (!file) return fail(path.string() + ": cannot be read to its end");
  if (scale > 0)
    for (auto& v : values) v = std::bit_cast<float>(__builtin_bswap32(std::bit_cast<std::uint32_t>(v)));
  Picture picture{width, height, std::vector<glm::vec3>(std::size_t{width} * height)};
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x) {
      const float* v = &values[((height - 1 - y) * width + x) * channels];
      picture.pixels[y * width + x] = channels == 3 ? glm::vec3(v[0], v[1], v[2]) : glm::vec3(v[0]);
    }
  return picture;
}

}  // namespace darm::renderer
