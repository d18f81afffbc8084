// A fuzz target without libFuzzer: runs seeds, then about a second of mutations of them. Which mutations come is fixed;
// how many depends on the machine. Arguments: files or folders of seeds, which may be missing.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

void add_seed(const std::filesystem::path& file, std::vector<Bytes>& seeds) {
  std::ifstream in(file, std::ios::binary);
  seeds.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
}

void mutate(Bytes& bytes, std::mt19937& random) {
  const auto below = [&random](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const std::size_t edits = 1 + below(8);
  for (std::size_t i = 0; i < edits; ++i) {
    if (bytes.empty()) bytes.resize(1 + below(64));
    const std::size_t at = below(bytes.size());
    constexpr std::uint8_t kSpecial[] = {0x00, 0xff, 0x7f, 0x80, 0x01, '"', '[', '{'};
    switch (below(6)) {
      case 0:
        bytes[at] = static_cast<std::uint8_t>(random());
        break;
      case 1:
        bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1u << below(8)));
        break;
      case 2:
        bytes[at] = kSpecial[below(sizeof kSpecial)];
        break;
      case 3:
        bytes.resize(at);
        break;
      case 4:
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(at), kSpecial[below(sizeof kSpecial)]);
        break;
      default: {
        const std::size_t length = std::min(bytes.size() - at, 1 + below(32));
        if (bytes.size() > 1u << 20) break;
        const Bytes piece(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                          bytes.begin() + static_cast<std::ptrdiff_t>(at + length));
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size() + 1)), piece.begin(), piece.end());
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<Bytes> seeds;
  for (int i = 1; i < argc; ++i) {
    const std::filesystem::path path(argv[i]);
    if (std::filesystem::is_regular_file(path)) add_seed(path, seeds);
    if (!std::filesystem::is_directory(path)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path))
      if (entry.is_regular_file()) add_seed(entry.path(), seeds);
  }
  seeds.emplace_back();
  for (const auto& seed : seeds) LLVMFuzzerTestOneInput(seed.data(), seed.size());

  std::mt19937 random(1);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  std::size_t runs = 0;
  for (; std::chrono::steady_clock::now() < end; ++runs) {
    Bytes bytes = seeds[runs % seeds.size()];
    mutate(bytes, random);
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  std::printf("%zu seeds, %zu mutations\n", seeds.size(), runs);
}
