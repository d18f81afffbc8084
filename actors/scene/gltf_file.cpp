#include "actors/scene/gltf_file.hpp"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>

namespace darm::scene::gltf {
namespace {

constexpr std::uint32_t kGlbMagic = 0x46546c67;     // "glTF"
constexpr std::uint32_t kChunkJson = 0x4e4f534a;    // "JSON"
constexpr std::uint32_t kChunkBinary = 0x004e4942;  // "BIN\0"
constexpr std::size_t kMaxUriInMessage = 80;

std::uint32_t read_u32(Bytes bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) | (static_cast<std::uint32_t>(bytes[at + 1]) << 8) |
         (static_cast<std::uint32_t>(bytes[at + 2]) << 16) | (static_cast<std::uint32_t>(bytes[at + 3]) << 24);
}

std::string shown(std::string_view uri) {
  std::string text(uri.substr(0, kMaxUriInMessage));
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = '?';
  return "'" + text + (uri.size() > kMaxUriInMessage ? "...'" : "'");
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string percent_decoded(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 && hex_digit(text[i + 2]) >= 0) {
      out.push_back(static_cast<char>(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2])));
      i += 2;
    } else {
      out.push_back(text[i]);
    }
  }
  return out;
}

std::optional<std::vector<std::uint8_t>> base64_decoded(std::string_view text) {
  static const auto table = [] {
    std::array<std::int16_t, 256> t{};
    t.fill(-1);
    constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < alphabet.size(); ++i)
      t[static_cast<unsigned char>(alphabet[i])] = static_cast<std::int16_t>(i);
    return t;
  }();
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::vector<std::uint8_t> out;
  out.reserve(text.size() * 3 / 4);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int value = table[static_cast<unsigned char>(c)];
    if (value < 0) return std::nullopt;
    bits = (bits << 6) | static_cast<std::uint32_t>(value);
    count += 6;
    if (count >= 8) {
      count -= 8;
      out.push_back(static_cast<std::uint8_t>(bits >> count));
    }
  }
  return out;
}

/// A URI with a scheme ("http:", "file:", "c:"), as opposed to a relative path.
bool has_scheme(std::string_view uri) {
  const auto colon = uri.find(':');
  return colon != std::string_view::npos && uri.substr(0, colon).find('/') == std::string_view::npos;
}

}  // namespace

Result<GltfFile> GltfFile::open(const std::filesystem::path& path, const LoadLimits& limits) {
  GltfFile file;
  file.max_bytes_ = limits.max_file_bytes;
  std::error_code ignored;
  const auto canonical = std::filesystem::weakly_canonical(path, ignored);
  const auto bytes = file.read(path);
  if (!bytes) return std::unexpected(bytes.error());
  file.folder_ = canonical.parent_path();
  if (const auto split = file.split(*bytes); !split) return std::unexpected(split.error());
  return file;
}

Result<GltfFile> GltfFile::view(Bytes bytes, const LoadLimits& limits) {
  GltfFile file;
  file.max_bytes_ = limits.max_file_bytes;
  file.used_bytes_ = bytes.size();
  if (bytes.size() > limits.max_file_bytes)
    return fail("larger than the limit of " + std::to_string(limits.max_file_bytes) + " bytes");
  file.hash_ = XXH3_64bits(bytes.data(), bytes.size());
  if (const auto split = file.split(bytes); !split) return std::unexpected(split.error());
  return file;
}

Result<Bytes> GltfFile::read(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return fail("no such file");
  if (!std::filesystem::is_regular_file(status)) return fail("not a regular file");
  const auto size = std::filesystem::file_size(path, error);
  if (error) return fail("cannot be read: " + error.message());
  if (size > max_bytes_ - used_bytes_)
    return fail("with what it refers to larger than the limit of " + std::to_string(max_bytes_) + " bytes");
  std::ifstream stream(path, std::ios::binary);
  std::vector<std::uint8_t> bytes(size);
  if (!stream || !stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) {
    return fail("cannot be read (permission, or it changed while being read)");
  }
  hash_ = XXH3_64bits_withSeed(bytes.data(), bytes.size(), hash_);
  return keep(std::move(bytes));
}

Bytes GltfFile::keep(std::vector<std::uint8_t> bytes) {
  used_bytes_ += bytes.size();
  storage_.push_back(std::move(bytes));
  return storage_.back();
}

Result<void> GltfFile::split(Bytes bytes) {
  if (bytes.size() < 4) return fail("too short for a glTF file (" + std::to_string(bytes.size()) + " bytes)");
  const auto first = std::find_if(bytes.begin(), bytes.end(),
                                  [](std::uint8_t c) { return c != ' ' && c != '\n' && c != '\r' && c != '\t'; });
  const bool bom = bytes[0] == 0xef && bytes[1] == 0xbb && bytes[2] == 0xbf;
  if (bom || (first != bytes.end() && *first == '{')) {
    const Bytes text = bom ? bytes.subspan(3) : bytes;
    json_ = {reinterpret_cast<const char*>(text.data()), text.size()};
    return {};
  }
  if (read_u32(bytes, 0) != kGlbMagic) return fail("neither a glTF JSON file nor a GLB (wrong magic)");
  if (bytes.size() < 20) return fail("GLB header is cut off");
  if (read_u32(bytes, 4) != 2)
    return fail("GLB container version " + std::to_string(read_u32(bytes, 4)) + ", only 2 is supported");
  const std::uint64_t length = read_u32(bytes, 8);
  if (length > bytes.size())
    return fail("GLB is cut off: declares " + std::to_string(length) + " bytes, has " + std::to_string(bytes.size()));
  std::uint64_t at = 12;
  for (int chunk = 0; at + 8 <= length; ++chunk) {
    const std::uint64_t size = read_u32(bytes, at);
    const std::uint32_t type = read_u32(bytes, at + 4);
    if (size > length - at - 8)
      return fail("GLB chunk " + std::to_string(chunk) + " is cut off: declares " + std::to_string(size) +
                  " bytes, has " + std::to_string(length - at - 8));
    const Bytes content = bytes.subspan(at + 8, size);
    if (chunk == 0 && type != kChunkJson) return fail("GLB does not start with its JSON chunk");
    if (chunk == 0) json_ = {reinterpret_cast<const char*>(content.data()), content.size()};
    if (chunk > 0 && type == kChunkBinary && !binary_chunk_) binary_chunk_ = content;
    at += 8 + ((size + 3) & ~std::uint64_t{3});
  }
  return {};
}

Result<Bytes> GltfFile::decode_data_uri(std::string_view uri) {
  const auto comma = uri.find(',');
  if (comma == std::string_view::npos) return fail("data URI without data");
  const std::string_view head = uri.substr(0, comma);
  const std::string_view body = uri.substr(comma + 1);
  if (body.size() > max_bytes_ - used_bytes_)
    return fail("data URI takes the file over the limit of " + std::to_string(max_bytes_) + " bytes");
  if (head.ends_with(";base64")) {
    auto bytes = base64_decoded(body);
    if (!bytes) return fail("data URI is not valid base64");
    return keep(std::move(*bytes));
  }
  const std::string text = percent_decoded(body);
  return keep({text.begin(), text.end()});
}

Result<Bytes> GltfFile::resolve(const std::string& uri) {
  if (uri.starts_with("data:")) return decode_data_uri(uri);
  if (has_scheme(uri)) return fail("URI " + shown(uri) + ": only data URIs and files in the scene's folder are read");
  if (!folder_) return fail("URI " + shown(uri) + ": a scene in memory may not refer to files");
  const std::string name = percent_decoded(uri);
  if (name.empty() || name.find('\0') != std::string::npos || name.find('\\') != std::string::npos)
    return fail("URI " + shown(uri) + " is not a file name");
  const std::filesystem::path relative(name);
  const bool climbs = std::ranges::any_of(relative, [](const auto& part) { return part == ".."; });
  if (relative.is_absolute() || climbs) return fail("URI " + shown(uri) + " leads out of the scene's folder");
  std::error_code error;
  const auto target = std::filesystem::weakly_canonical(*folder_ / relative, error);
  const auto [end, rest] = std::mismatch(folder_->begin(), folder_->end(), target.begin(), target.end());
  if (error || end != folder_->end()) return fail("URI " + shown(uri) + " leads out of the scene's folder");
  auto bytes = read(target);
  if (!bytes) return fail("file " + shown(uri) + ": " + bytes.error().message);
  return bytes;
}

}  // namespace darm::scene::gltf
