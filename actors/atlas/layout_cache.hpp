// A layout as a file in the state directory, so that a second start does not build it again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/scene/scene.hpp"
#include "actors/types/error.hpp"

namespace darm::atlas {

/// Bytes of a layout file: magic, version, size and XXH3 of what follows, then the tables in host byte order.
[[nodiscard]] std::vector<std::byte> encode_layout(const Layout& layout);

/// Foreign input: magic, version, length and checksum are tested first, every count before memory is taken for it, and
/// every index and number before the layout is given out. Never throws for bad bytes.
[[nodiscard]] Result<std::shared_ptr<const Layout>> decode_layout(std::span<const std::byte> bytes);

/// Reads a whole file (at most 4 GiB) and decodes it.
[[nodiscard]] Result<std::shared_ptr<const Layout>> read_layout(const std::filesystem::path& file);

/// True if the layout's tables have the sizes of this scene's instances and meshes.
[[nodiscard]] bool belongs_to(const Layout& layout, const scene::Scene& scene);

/// Writes beside `file`, flushes to disk, then renames: a reader sees the old file or the new one, never half of one.
[[nodiscard]] Result<void> write_layout(const std::filesystem::path& file, const Layout& layout);

}  // namespace darm::atlas
