// The newest picture of each tile, bounded: what nobody wants goes first, least recently wanted first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <unordered_map>

#include "actors/tile_scheduler/stream_state.hpp"
#include "actors/tile_scheduler/tile_scheduler_messages.hpp"

namespace darm::tile_scheduler {

class ImageStore {
 public:
  /// `max_bytes`: of images; at least one image is kept.
  explicit ImageStore(std::size_t max_bytes);

  /// Takes a picture that is newer than what is there. False: it is not, or has no image.
  bool put(const ShadedTile& shaded);
  /// Null if there is none.
  [[nodiscard]] const StoredImage* find(TileId tile) const;
  /// The tile is wanted now: it becomes the last to go.
  void touch(TileId tile);
  [[nodiscard]] std::size_t size() const { return images_.size(); }

 private:
  struct Entry {
    StoredImage image;
    std::list<TileId>::iterator age;
  };
  std::size_t max_images_;
  std::unordered_map<TileId, Entry> images_;
  std::list<TileId> by_age_;  // newest first
};

}  // namespace darm::tile_scheduler
