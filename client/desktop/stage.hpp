// What is on show: the scene that has come, drawn in the window's GL context.
#pragma once

#include <memory>
#include <optional>

#include "client/core/renderer_gles.hpp"
#include "client/desktop/live_stream.hpp"
#include "client/desktop/window.hpp"

namespace darm::client::desktop {

/// Needs the window's GL context current at every call, destruction included.
class Stage {
 public:
  /// Uploads what came. True: there was something to upload.
  [[nodiscard]] Result<bool> take(Arrivals&& arrivals);
  /// Draws the picture and waits until the GL is done with it. Nothing to draw yet is no error: see ready().
  [[nodiscard]] Result<void> draw(const View& view);

  /// Copies the last picture, enlarged to `size` if it was drawn smaller, or black before there is one, to the window's
  /// framebuffer of that size.
  void present(const PixelSize& size);

  [[nodiscard]] bool ready() const { return renderer_ != nullptr; }
  /// All geometry and CoarseTex are here: no hole in the picture.
  [[nodiscard]] bool whole() const { return ready() && scene_->complete() && coarse_ != nullptr; }
  [[nodiscard]] GlesRenderer& renderer() { return *renderer_; }
  /// Null until there is one.
  [[nodiscard]] const SceneModel* scene() const { return scene_.get(); }

 private:
  [[nodiscard]] Result<void> make_renderer();

  std::unique_ptr<SceneModel> scene_;
  std::unique_ptr<GlesRenderer> renderer_;
  std::shared_ptr<const Picture> coarse_;
  bool drawn_ = false;
  StreamShape shape_;
  std::optional<StreamShape> view_shape_;
};

}  // namespace darm::client::desktop
