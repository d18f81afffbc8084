// Sizes, versions and times both ends of the wire agree on. Checked before memory is taken.
#pragma once

#include <cstddef>
#include <cstdint>

namespace darm::proto {

inline constexpr std::uint32_t kProtocolVersion = 1;

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

/// Largest tables a client takes memory for.
inline constexpr std::uint32_t kMaxPatches = 64u * 1024 * 1024;
inline constexpr std::uint32_t kMaxInstances = 4u * 1024 * 1024;
inline constexpr std::uint32_t kMaxChunkVertices = 256 * 1024;
inline constexpr std::uint32_t kMaxChunkIndices = 3 * 64 * 1024;

/// Private PhysTex: sizes a session may have, pixels a side. Lossless (evaluation) ones may be larger.
inline constexpr std::uint32_t kSmallestViewPhysTex = 512;
inline constexpr std::uint32_t kLargestViewPhysTex = 1024;
inline constexpr std::uint32_t kLargestLosslessViewPhysTex = 2048;

/// Bytes of a vertex of GeometryChunk.vertices and of an entry of SceneManifest.patch_table.
inline constexpr std::size_t kVertexBytes = 24;
inline constexpr std::size_t kPatchEntryBytes = 12;

/// A client sends something (a camera, feedback or a ping) at least this often, or it is taken for gone.
inline constexpr std::int64_t kPingEverySeconds = 5;

}  // namespace darm::proto
