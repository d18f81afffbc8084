#include "actors/tile_scheduler/image_store.hpp"

#include <algorithm>

namespace darm::tile_scheduler {

ImageStore::ImageStore(std::size_t max_bytes) : max_images_(std::max<std::size_t>(1, max_bytes / sizeof(TileImage))) {}

bool ImageStore::put(const ShadedTile& shaded) {
  if (shaded.image == nullptr) return false;
  auto [it, is_new] = images_.try_emplace(shaded.tile);
  auto& entry = it->second;
  if (!is_new && shaded.version <= entry.image.version) return false;
  entry.image.version = shaded.version;
  entry.image.error = shaded.error;
  entry.image.image = shaded.image;
  if (is_new) {
    by_age_.push_front(shaded.tile);
    entry.age = by_age_.begin();
    if (images_.size() > max_images_) {
      images_.erase(by_age_.back());
      by_age_.pop_back();
    }
  } else {
    by_age_.splice(by_age_.begin(), by_age_, entry.age);
  }
  return true;
}

const StoredImage* ImageStore::find(TileId tile) const {
  const auto it = images_.find(tile);
  return it == images_.end() ? nullptr : &it->second.image;
}

void ImageStore::touch(TileId tile) {
  const auto it = images_.find(tile);
  if (it != images_.end()) by_age_.splice(by_age_.begin(), by_age_, it->second.age);
}

}  // namespace darm::tile_scheduler
