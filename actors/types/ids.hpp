// Names of things that travel in messages. Strong types, so that a slot is never taken for a tile.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace darm {

/// A client connection; unique for the life of the daemon, never reused. 0 is nobody.
enum class SessionId : std::uint64_t {};
/// A video stream (one encoder, one PhysTex); unique for the life of the daemon. 0 is none.
enum class StreamId : std::uint32_t {};
/// Index of a patch over the whole scene: instance base + local id (DESIGN "Instances and bodies").
enum class PatchId : std::uint32_t {};

/// Which of a session's two pictures: light for everybody, or light for its eye alone (DESIGN "Two layers").
enum class StreamLayer : std::uint8_t { kShared, kView };

inline constexpr PatchId kNoPatch{0xffffffffu};

/// Number of a frame within its stream, starting at 1. Ties an H.264 picture to its page-table delta.
using FrameNumber = std::uint64_t;

/// Sequence number of a camera update within its session, starting at 1. 0: no camera yet.
using CameraSequence = std::uint64_t;

/// Index of a 32x32 slot of a PhysTex: slot = row * slots_per_row + column.
using SlotIndex = std::uint16_t;
inline constexpr SlotIndex kNoSlot = 0xffff;

[[nodiscard]] constexpr std::uint32_t index_of(PatchId id) { return static_cast<std::uint32_t>(id); }

}  // namespace darm
