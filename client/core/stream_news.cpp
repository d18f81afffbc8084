#include "client/core/stream_news.hpp"

#include <utility>

namespace darm::client {
namespace {

template <class Map>
void add_to(Map& all, Map newer) {
  for (auto& [key, value] : newer) all.insert_or_assign(key, std::move(value));
}

}  // namespace

bool StreamNews::empty() const {
  return !fresh && pages.empty() && !picture && !coarse && pixels.empty() && coverage.empty() && through.empty();
}

void StreamNews::add(StreamNews newer) {
  if (newer.coarse) coarse = std::move(newer.coarse);
  if (newer.fresh) {
    newer.coarse = std::move(coarse);
    *this = std::move(newer);
    return;
  }
  if (newer.picture) picture = std::move(newer.picture);
  add_to(pages, std::move(newer.pages));
  add_to(pixels, std::move(newer.pixels));
  add_to(coverage, std::move(newer.coverage));
  add_to(through, std::move(newer.through));
}

}  // namespace darm::client
