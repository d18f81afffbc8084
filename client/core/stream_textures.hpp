// The GL textures behind one session: slots and pages of its streams, patch places, coverage, CoarseTex.
#pragma once

#include "client/core/gles_resources.hpp"
#include "client/core/scene_model.hpp"
#include "client/core/stream_news.hpp"
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
  kCoarseCrUnit,
  kViewPagesUnit,
  kViewYUnit,
  kViewCbUnit,
  kViewCrUnit,
  kThroughUnit,
  kCoarseCoverageUnit
};

/// Needs the GL context current at every call.
class StreamTextures {
 public:
  [[nodiscard]] static Result<StreamTextures> create(const SceneModel& scene, const StreamShape& shape);
  [[nodiscard]] Result<void> upload(const StreamNews& news);
  /// The same of the private layer; makes its textures, of `shape`, at the first call.
  [[nodiscard]] Result<void> upload_view(const StreamNews& news, const SceneModel& scene, const StreamShape& shape);
  [[nodiscard]] bool has_view() const { return static_cast<bool>(view_.pages); }
  [[nodiscard]] std::uint32_t view_size() const { return view_.size; }
  [[nodiscard]] bool view_444() const { return view_.chroma_444; }
  void bind() const;
  [[nodiscard]] std::uint32_t coarse_width() const { return coarse_width_; }  ///< 0: none yet
  [[nodiscard]] std::uint32_t coarse_height() const { return coarse_height_; }
  [[nodiscard]] bool chroma_444() const { return shared_.chroma_444; }

 private:
  // Slots and pages of one stream.
  struct Slots {
    std::uint32_t size = 0;
    bool chroma_444 = false;
    gles::Texture pages, y, cb, cr;
    void make(std::uint32_t page_rows, const StreamShape& shape);
    void upload(const StreamNews& news);
    void put_picture(const Picture& picture);
  };
  void make_coverage();
  [[nodiscard]] Result<void> make_coarse_coverage(const SceneModel& scene);
  void make_through();
  [[nodiscard]] Result<void> upload_coarse(const Picture& picture);

  StreamShape shape_;
  std::uint32_t coarse_width_ = 0, coarse_height_ = 0, largest_ = 0;
  Slots shared_, view_;
  gles::Texture places_, coverage_, coarse_y_, coarse_cb_, coarse_cr_, through_, coarse_coverage_;
};

}  // namespace darm::client
