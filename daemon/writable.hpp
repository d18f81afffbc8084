// Can results be written? Asked before the work, not found after it.
#pragma once

#include <filesystem>

#include "actors/types/error.hpp"

namespace darm {

/// A file that will be written, in a folder that is there. Nothing is left and nothing that is there is changed. The
/// error names the file, the reason and the way out.
[[nodiscard]] Result<void> check_writable_file(const std::filesystem::path& file);

/// A folder that files will be written into; it is made if it is not there. The same errors.
[[nodiscard]] Result<void> make_writable_folder(const std::filesystem::path& folder);

}  // namespace darm
