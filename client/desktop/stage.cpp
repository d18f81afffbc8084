#include "client/desktop/stage.hpp"

#include <GLES3/gl3.h>

#include <utility>

namespace darm::client::desktop {
namespace {

bool same(const StreamShape& a, const StreamShape& b) {
  return a.phystex_size == b.phystex_size && a.chroma_444 == b.chroma_444;
}

bool same(const std::optional<StreamShape>& a, const std::optional<StreamShape>& b) {
  return a.has_value() == b.has_value() && (!a || same(*a, *b));
}

}  // namespace

Result<void> Stage::make_renderer() {
  auto made = GlesRenderer::create(*scene_, shape_);
  if (!made) return std::unexpected(made.error());
  renderer_ = std::move(*made);
  drawn_ = false;
  if (!coarse_) return {};
  StreamNews news;
  news.coarse = coarse_;
  return renderer_->synchronise(*scene_, news);
}

Result<bool> Stage::take(Arrivals&& arrivals) {
  if (const auto& joined = arrivals.joined) {
    // Slots of another size: the renderer is made anew, the geometry is here.
    if (!same(joined->shape, shape_) || !same(joined->view_shape, view_shape_)) renderer_.reset();
    shape_ = joined->shape;
    view_shape_ = joined->view_shape;
  }
  if (arrivals.scene) {
    renderer_.reset();
    coarse_.reset();
    scene_ = std::move(arrivals.scene);
  }
  if (!scene_) return false;
  for (Chunk& chunk : arrivals.chunks) scene_->keep_chunk(std::move(chunk));
  const bool something = !renderer_ || !arrivals.chunks.empty() || !arrivals.shared.empty() || !arrivals.view.empty();
  if (!something) return false;
  if (!renderer_) {
    if (auto ok = make_renderer(); !ok) return std::unexpected(ok.error());
  }
  if (arrivals.shared.coarse) coarse_ = arrivals.shared.coarse;
  if (auto ok = renderer_->synchronise(*scene_, arrivals.shared); !ok) return std::unexpected(ok.error());
  if (view_shape_) {
    if (auto ok = renderer_->synchronise_view(*scene_, *view_shape_, arrivals.view); !ok)
      return std::unexpected(ok.error());
  }
  renderer_->finish();
  return true;
}

Result<void> Stage::draw(const View& view) {
  if (!renderer_) return {};
  if (auto ok = renderer_->draw(*scene_, view); !ok) return ok;
  // A frame that is queued is a frame of lag.
  renderer_->finish();
  drawn_ = true;
  return {};
}

void Stage::present(const PixelSize& size) {
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, static_cast<GLsizei>(size.width), static_cast<GLsizei>(size.height));
  glClearColor(0, 0, 0, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  if (renderer_ && drawn_) renderer_->present(0, size.width, size.height);
}

}  // namespace darm::client::desktop
