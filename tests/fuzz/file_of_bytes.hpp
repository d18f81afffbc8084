// Bytes as a file that is never on a disk, for parsers that take a path.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

namespace darm::fuzz {

class FileOfBytes {
 public:
  explicit FileOfBytes(std::string_view bytes) : descriptor_(::memfd_create("fuzz", 0)) {
    if (descriptor_ < 0 || ::write(descriptor_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
      std::abort();
  }
  ~FileOfBytes() { ::close(descriptor_); }
  FileOfBytes(const FileOfBytes&) = delete;
  FileOfBytes& operator=(const FileOfBytes&) = delete;

  [[nodiscard]] std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

/// `bytes` with what is in `data` written over them: its first two bytes say where.
inline std::string written_over(std::string bytes, std::string_view data) {
  if (data.size() < 2 || bytes.empty()) return bytes;
  const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(data[i])); };
  std::size_t at = (byte(0) | byte(1) << 8) % bytes.size();
  for (const char c : data.substr(2)) {
    if (at == bytes.size()) break;
    bytes[at++] = c;
  }
  return bytes;
}

}  // namespace darm::fuzz
