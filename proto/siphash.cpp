#include "proto/siphash.hpp"

#include <bit>

namespace darm::proto {
namespace {

struct State {
  std::uint64_t v0, v1, v2, v3;

  void round() {
    v0 += v1;
    v2 += v3;
    v1 = std::rotl(v1, 13) ^ v0;
    v3 = std::rotl(v3, 16) ^ v2;
    v0 = std::rotl(v0, 32);
    v2 += v1;
    v0 += v3;
    v1 = std::rotl(v1, 17) ^ v2;
    v3 = std::rotl(v3, 21) ^ v0;
    v2 = std::rotl(v2, 32);
  }
  void absorb(std::uint64_t word) {
    v3 ^= word;
    round();
    round();
    v0 ^= word;
  }
  std::uint64_t squeeze() {
    for (int i = 0; i < 4; ++i) round();
    return v0 ^ v1 ^ v2 ^ v3;
  }
};

std::uint64_t load_le(const std::uint8_t* bytes, std::size_t count) {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < count; ++i) word |= std::uint64_t{bytes[i]} << (8 * i);
  return word;
}

}  // namespace

SipTag siphash_2_4_128(const SipKey& key, std::span<const std::uint8_t> message) {
  const auto k0 = load_le(key.data(), 8);
  const auto k1 = load_le(key.data() + 8, 8);
  // The constants spell "somepseudorandomlygeneratedbytes" (paper, section 2.1); 0xee asks for the wide output.
  State s{k0 ^ 0x736f6d6570736575ull, k1 ^ 0x646f72616e646f6dull ^ 0xee, k0 ^ 0x6c7967656e657261ull,
          k1 ^ 0x7465646279746573ull};
  const std::size_t whole = message.size() / 8 * 8;
  for (std::size_t i = 0; i < whole; i += 8) s.absorb(load_le(message.data() + i, 8));
  s.absorb(load_le(message.data() + whole, message.size() - whole) |
           (static_cast<std::uint64_t>(message.size()) << 56));
  s.v2 ^= 0xee;
  const auto low = s.squeeze();
  s.v1 ^= 0xdd;
  const auto high = s.squeeze();
  SipTag tag;
  for (std::size_t i = 0; i < 8; ++i) {
    tag[i] = static_cast<std::uint8_t>(low >> (8 * i));
    tag[i + 8] = static_cast<std::uint8_t>(high >> (8 * i));
  }
  return tag;
}

}  // namespace darm::proto
