// Sizes, versions and times both ends of the wire agree on. Checked before memory is taken.
#pragma once

#include <cstddef>
#include <cstdint>

namespace darm::proto {

inline constexpr std::uint32_t kProtocolVersion = 2;

/// Bytes of length prefix before every Envelope on TCP, big-endian.
inline constexpr std::size_t kLengthBytes = 4;
/// Largest Envelope a client may send (poses and feedback are under 200 bytes).
inline constexpr std::size_t kMaxClientEnvelope = 16 * 1024;
/// Largest Envelope a server may send. Lossless key frames of big scenes are the largest.
inline constexpr std::size_t kMaxServerEnvelope = std::size_t{512} * 1024 * 1024;
/// Largest UDP datagram in either direction: fits every path's MTU.
inline constexpr std::size_t kMaxDatagram = 1200;

/// Longest strings, bytes; longer ones are cut (names) or refused (in Hello).
inline constexpr std::size_t kMaxClientName = 128;
inline constexpr std::size_t kMaxGoodbyeText = 512;

/// Welcome.key; the first kDatagramKeyBytes authenticate datagrams.
inline constexpr std::size_t kSessionKeyBytes = 32;
inline constexpr std::size_t kDatagramKeyBytes = 16;
inline constexpr std::size_t kDatagramTagBytes = 16;

/// Largest tables a client takes memory for; a server refuses a scene that would need more. Entries: tiles of all
/// levels together, and patches times levels.
inline constexpr std::uint32_t kMaxTableEntries = 2048u * 2048;
inline constexpr std::uint32_t kMaxInstances = 1u << 20;
inline constexpr std::uint32_t kMaxGeometryChunks = 1u << 20;
inline constexpr std::uint32_t kMaxCoarseTexels = 2048u * 2048;
inline constexpr std::uint32_t kMaxChunkVertices = 256 * 1024;
inline constexpr std::uint32_t kMaxChunkIndices = 3 * 64 * 1024;

/// Page edits of one frame, for each slot of its PhysTex: a tile that goes and one that comes, and room for more.
inline constexpr std::uint64_t kMaxPageEditsPerSlot = 4;

/// Private PhysTex: sizes a session may have, pixels a side. Lossless (evaluation) ones may be larger.
inline constexpr std::uint32_t kSmallestViewPhysTex = 512;
inline constexpr std::uint32_t kLargestViewPhysTex = 1024;
inline constexpr std::uint32_t kLargestLosslessViewPhysTex = 2048;

/// Bytes of a vertex of GeometryChunk.vertices and of an entry of SceneManifest.patch_table.
inline constexpr std::size_t kVertexBytes = 24;
inline constexpr std::size_t kPatchEntryBytes = 12;

/// What the codecs of geometry can make of so many bytes. meshopt spends at least 4 bytes on each byte of the stride
/// for a block of at most 256 records, and at most 4 more than the block itself has (filled up to groups of 16); on a
/// triangle 1 to 17 bytes. DEFLATE packs at most 1032 times. What claims more is refused before memory is taken.
[[nodiscard]] constexpr std::uint64_t most_records(std::uint64_t bytes, std::uint32_t stride) {
  return (bytes / (stride * 4ull) + 1) * 256;
}
[[nodiscard]] constexpr std::uint64_t most_packed_records(std::uint64_t count, std::uint32_t stride) {
  return (count + 32) * stride + (count / 256 + 1) * stride * 4 + 64;
}
[[nodiscard]] constexpr std::uint64_t most_packed_indices(std::uint64_t count) { return count / 3 * 17 + 64; }
[[nodiscard]] constexpr std::uint64_t most_inflated(std::uint64_t bytes) { return bytes * 1032; }

/// A client sends something (a camera, feedback or a ping) at least this often, or it is taken for gone.
inline constexpr std::int64_t kPingEverySeconds = 5;

}  // namespace darm::proto
