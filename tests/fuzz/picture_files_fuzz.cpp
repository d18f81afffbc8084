// links: darm_client_core
// PNG and PFM files by their readers: raw bytes, and bytes written over a sound file. What is read has the size that it
// says.
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "client/core/picture_files.hpp"
#include "tests/fuzz/file_of_bytes.hpp"

namespace {

using namespace darm::client;

template <class Image>
void check(const Result<Image>& image) {
  if (image ? image->rgb.size() != std::size_t{image->width} * image->height * 3 : image.error().message.empty())
    std::abort();
}

// What `write` makes of a picture of 5x3.
template <class Image, class Write>
std::string sound_file(const Write& write) {
  Image image;
  image.width = 5;
  image.height = 3;
  image.rgb.assign(45, 1);
  const auto path = std::filesystem::temp_directory_path() / ("darm_picture_fuzz_" + std::to_string(::getpid()));
  if (!write(path, image)) std::abort();
  std::ifstream in(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  std::filesystem::remove(path);
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string png = sound_file<Image8>(write_png);
  static const std::string pfm = sound_file<ImageF>(write_pfm);
  if (size > 1u << 16) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  check(read_png(darm::fuzz::FileOfBytes(bytes).path()));
  check(read_pfm(darm::fuzz::FileOfBytes(bytes).path()));
  check(read_png(darm::fuzz::FileOfBytes(darm::fuzz::written_over(png, bytes)).path()));
  check(read_pfm(darm::fuzz::FileOfBytes(darm::fuzz::written_over(pfm, bytes)).path()));
  return 0;
}
