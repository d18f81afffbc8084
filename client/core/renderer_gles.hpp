// Draws the scene from PhysTex, the page table and CoarseTex with OpenGL ES 3 (paper 3.5, levels as DESIGN section 4).
#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <memory>
#include <string>

#include "client/core/picture_files.hpp"
#include "client/core/result.hpp"
#include "client/core/scene_model.hpp"
#include "client/core/stream_player.hpp"
#include "client/core/view.hpp"

namespace darm::client {

/// Where the samples of a picture took their light from.
struct ResidencyCounts {
  std::uint64_t samples = 0;
  std::uint64_t undefined = 0;   ///< no light yet
  std::uint64_t sharp = 0;       ///< the level the sample asked for
  std::uint64_t coarser = 0;     ///< one to three levels coarser
  std::uint64_t coarse_tex = 0;  ///< CoarseTex, though a finer level was asked for
  std::uint64_t background = 0;
};

/// One scene and one stream in one GL context (OpenGL ES 3, or desktop OpenGL 3.3 with texture storage), which must be
/// current at every call, destruction included.
/// Unlit triangles, 2x2 samples a pixel, resolved in linear light. Where half-float targets exist, blending is in
/// linear light too, else on sRGB values.
class GlesRenderer {
 public:
  [[nodiscard]] static Result<std::unique_ptr<GlesRenderer>> create(const SceneModel& scene, const StreamShape& shape);
  ~GlesRenderer();

  /// Uploads what came since the last call: chunks, slots, pages, CoarseTex. The scene is that of create(), or one of
  /// the same manifest.
  [[nodiscard]] Result<void> synchronise(const SceneModel& scene, const StreamNews& news);
  [[nodiscard]] Result<void> synchronise(const SceneModel& scene, StreamPlayer& player) {
    return synchronise(scene, player.take_news());
  }
  /// The same for the private layer, of `shape`. Once called, pictures show it: linear(shared) + linear(view), and
  /// clear surfaces pass what is behind by their private tiles.
  [[nodiscard]] Result<void> synchronise_view(const SceneModel& scene, const StreamShape& shape,
                                              const StreamNews& news);
  [[nodiscard]] Result<void> synchronise_view(const SceneModel& scene, StreamPlayer& player) {
    return synchronise_view(scene, player.shape(), player.take_news());
  }
  /// Draws into a picture of view.width x view.height for read_picture() and present().
  [[nodiscard]] Result<void> draw(const SceneModel& scene, const View& view);
  /// Copies the last picture to the lower left `width` x `height` pixels of a framebuffer (0: the window's), enlarged
  /// if it has fewer.
  void present(std::uint32_t framebuffer, std::uint32_t width, std::uint32_t height);
  [[nodiscard]] Result<Image8> read_picture();
  /// Draws the view once more to count classes. `coarseness` 0: every sample (4 a pixel), expensive, for reports;
  /// n: one sample for n x n pixels. The picture stays.
  [[nodiscard]] Result<ResidencyCounts> count_residency(const SceneModel& scene, const View& view,
                                                        std::uint32_t coarseness = 0);
  /// Waits until the GL has drawn everything (for timing).
  void finish();
  /// The GL's own name, for reports.
  [[nodiscard]] std::string device() const;

 private:
  struct State;
  explicit GlesRenderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace darm::client
