#include "client/core/picture_pool.hpp"

#include <mutex>
#include <utility>
#include <vector>

namespace darm::client {

namespace {

constexpr std::size_t kMostKept = 3;  // one is decoded into, one waits, one is uploaded

}  // namespace

struct PicturePool::Shelf {
  std::mutex mutex;
  std::vector<std::unique_ptr<Picture>> pictures;
};

PicturePool::PicturePool() : shelf_(std::make_shared<Shelf>()) {}

std::shared_ptr<Picture> PicturePool::take() {
  std::unique_ptr<Picture> picture;
  {
    const std::lock_guard lock(shelf_->mutex);
    if (!shelf_->pictures.empty()) {
      picture = std::move(shelf_->pictures.back());
      shelf_->pictures.pop_back();
    }
  }
  if (!picture) picture = std::make_unique<Picture>();
  return {picture.release(), [shelf = shelf_](Picture* done) {
            std::unique_ptr<Picture> owned(done);
            const std::lock_guard lock(shelf->mutex);
            if (shelf->pictures.size() < kMostKept) shelf->pictures.push_back(std::move(owned));
          }};
}

}  // namespace darm::client
