#include "daemon/reference_file.hpp"

#include <cstdio>

namespace darm {

std::filesystem::path reference_file(const std::filesystem::path& folder, const renderer::LightTransport& transport,
                                     const renderer::ReferenceJob& job) {
  char name[40];
  std::snprintf(name, sizeof name, "reference-%016llx.bin",
                static_cast<unsigned long long>(renderer::reference_hash(transport, job)));
  return folder / name;
}

}  // namespace darm
