// Pictures to decode into, used again once nobody shows them: their planes are megabytes.
#pragma once

#include <memory>

#include "client/core/video_decoder.hpp"

namespace darm::client {

class PicturePool {
 public:
  PicturePool();
  /// A picture with old content, or none. It comes back when its last holder lets it go, on whatever thread that is,
  /// and be the pool gone by then.
  [[nodiscard]] std::shared_ptr<Picture> take();

 private:
  struct Shelf;
  std::shared_ptr<Shelf> shelf_;
};

}  // namespace darm::client
