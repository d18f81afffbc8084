#include "client/core/inflate.hpp"

#include <zlib.h>

namespace darm::client {

std::optional<std::string> inflate(const std::string& packed, std::size_t at_most) {
  std::string out(at_most, '\0');
  uLongf size = out.size();
  const int code = uncompress(reinterpret_cast<Bytef*>(out.data()), &size,
                              reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (code != Z_OK) return std::nullopt;
  out.resize(size);
  return out;
}

}  // namespace darm::client
