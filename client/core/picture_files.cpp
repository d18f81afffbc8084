#include "client/core/picture_files.hpp"

#include <png.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string>

namespace darm::client {
namespace {

std::unexpected<Error> file_fail(const std::filesystem::path& path, const std::string& what) {
  return fail(path.string() + ": " + what);
}

}  // namespace

Result<void> write_png(const std::filesystem::path& path, const Image8& image) {
  if (image.rgb.size() != std::size_t{image.width} * image.height * 3 || image.rgb.empty())
    return file_fail(path, "picture is empty");
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  png.width = image.width;
  png.height = image.height;
  png.format = PNG_FORMAT_RGB;
  if (png_image_write_to_file(&png, path.c_str(), 0, image.rgb.data(), 0, nullptr) == 0)
    return file_fail(path, std::string("not written: ") + png.message);
  return {};
}

Result<Image8> read_png(const std::filesystem::path& path) {
  png_image png = {};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0)
    return file_fail(path, std::string("not read: ") + png.message);
  if (std::uint64_t{png.width} * png.height > kMaxFilePixels) {
    png_image_free(&png);
    return file_fail(path, "picture is too large");
  }
  png.format = PNG_FORMAT_RGB;
  Image8 image{png.width, png.height, std::vector<std::uint8_t>(PNG_IMAGE_SIZE(png))};
  if (png_image_finish_read(&png, nullptr, image.rgb.data(), 0, nullptr) == 0)
    return file_fail(path, std::string("not read: ") + png.message);
  return image;
}

Result<ImageF> read_pfm(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return file_fail(path, "cannot be opened");
  std::string magic;
  std::uint64_t width = 0, height = 0;
  double scale = 0;
  char newline = 0;
  in >> std::ws;
  for (char c = 0; magic.size() < 2 && in.get(c);) magic.push_back(c);
  in >> width >> height >> scale;
  in.get(newline);
  if (!in || magic != "PF" || scale == 0 || !std::isfinite(scale)) return file_fail(path, "is not a colour PFM file");
  if (width == 0 || height == 0 || width > kMaxFilePixels || height > kMaxFilePixels / width)
    return file_fail(path, "picture is too large");
  const auto start = in.tellg();
  in.seekg(0, std::ios::end);
  const std::uint64_t bytes = width * height * 3 * sizeof(float);
  if (start < 0 || static_cast<std::uint64_t>(in.tellg() - start) < bytes) return file_fail(path, "is cut short");
  in.seekg(start);
  ImageF image{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height),
               std::vector<float>(width * height * 3)};
  for (std::uint64_t row = height; row-- > 0;) {
    in.read(reinterpret_cast<char*>(image.rgb.data() + row * width * 3),
            static_cast<std::streamsize>(width * 3 * sizeof(float)));
  }
  if (!in) return file_fail(path, "cannot be read");
  const bool file_little = scale < 0;
  if (file_little != (std::endian::native == std::endian::little)) {
    for (float& v : image.rgb) v = std::bit_cast<float>(__builtin_bswap32(std::bit_cast<std::uint32_t>(v)));
  }
  for (const float v : image.rgb) {
    if (!std::isfinite(v)) return file_fail(path, "holds a value that is not finite");
  }
  return image;
}

Result<void> write_pfm(const std::filesystem::path& path, const ImageF& image) {
  if (image.rgb.size() != std::size_t{image.width} * image.height * 3)
    return file_fail(path, "picture has a wrong size");
  std::ofstream out(path, std::ios::binary);
  out << "PF\n"
      << image.width << ' ' << image.height << '\n'
      << (std::endian::native == std::endian::little ? "-1.0\n" : "1.0\n");
  for (std::size_t row = image.height; row-- > 0;) {
    out.write(reinterpret_cast<const char*>(image.rgb.data() + row * image.width * 3),
              static_cast<std::streamsize>(std::size_t{image.width} * 3 * sizeof(float)));
  }
  out.flush();
  if (!out) return file_fail(path, "cannot be written");
  return {};
}

}  // namespace darm::client
