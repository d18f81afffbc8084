// Where the sums of a reference picture are kept between runs.
#pragma once

#include <filesystem>

#include "actors/renderer/reference_renderer.hpp"

namespace darm {

/// The file of a job's sums in `folder`: beside the other caches, so that the same picture goes on where it stopped,
/// whichever command asks for it. Named by what the sums depend on, not by the words of a command: a named camera may
/// be moved.
[[nodiscard]] std::filesystem::path reference_file(const std::filesystem::path& folder,
                                                   const renderer::LightTransport& transport,
                                                   const renderer::ReferenceJob& job);

}  // namespace darm
