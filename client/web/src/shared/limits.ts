// Sizes both ends of the wire agree on (proto/limits.hpp, client/core/scene_model.hpp). Checked before memory is taken.

export const kProtocolVersion = 2;
export const kSubprotocol = 'darm.2';
export const kStreamPath = '/stream';

export const kTileSize = 30;
export const kSlotSize = 32;
export const kSlotTexels = kSlotSize * kSlotSize;
/** Width of every table texture. */
export const kTableWidth = 2048;
/** Tiles of all levels together, and patches times levels. */
export const kMaxTableEntries = kTableWidth * 2048;
export const kMaxCoarseTexels = 2048 * 2048;
export const kMaxPageEditsPerSlot = 4;
export const kMaxLevels = 16;
export const kAbsent = 65535;
export const kNoBase = 0xffffffff;

export const kMaxInstances = 1 << 20;
export const kMaxChunks = 1 << 20;
export const kMaxChunkVertices = 256 * 1024;
export const kMaxChunkIndices = 3 * 64 * 1024;
/** Vertices and indices of all chunks together, bytes. */
export const kMaxGeometryBytes = 2 ** 31;
export const kVertexBytes = 24;
export const kPatchEntryBytes = 12;

/** Largest PhysTex a browser asks for: hardware decoders stop at H.264 level 5.2. */
export const kMaxPhysTex = 2048;
export const kMaxViewPhysTex = 1024;
