// The GL textures behind one stream: slots, pages, patch places, coverage, CoarseTex.
#pragma once

#include "client/core/gles_resources.hpp"
#include "client/core/scene_model.hpp"
#include "client/core/stream_player.hpp"

namespace darm::client {

/// Texture units the surface programs read from.
enum TextureUnit : int {
  kPlacesUnit,
  kPagesUnit,
  kYUnit,
  kCbUnit,
  kCrUnit,
  kCoverageUnit,
  kCoarseYUnit,
  kCoarseCbUnit,
  kCoarseCrUnit
};

/// Needs the GL context current at every call.
class StreamTextures {
 public:
  [[nodiscard]] static Result<StreamTextures> create(const SceneModel& scene, const StreamShape& shape);
  /// Uploads what the player has new.
  [[nodiscard]] Result<void> upload(StreamPlayer& player);
  void bind() const;
  [[nodiscard]] std::uint32_t coarse_width() const { return coarse_width_; }  ///< 0: none yet
  [[nodiscard]] std::uint32_t coarse_height() const { return coarse_height_; }
  [[nodiscard]] bool chroma_444() const { return chroma_444_; }

 private:
  void upload_slots(StreamPlayer& player);
  [[nodiscard]] Result<void> upload_picture(const Picture& picture);
  [[nodiscard]] Result<void> upload_coarse(const Picture& picture);

  StreamShape shape_;
  bool chroma_444_ = false;
  std::uint32_t coarse_width_ = 0, coarse_height_ = 0, largest_ = 0;
  gles::Texture places_, pages_, y_, cb_, cr_, coverage_, coarse_y_, coarse_cb_, coarse_cr_;
};

}  // namespace darm::client
