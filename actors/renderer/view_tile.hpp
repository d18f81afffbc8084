// One private tile: means of the light of its texels towards one eye, and the picture made of them.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "actors/renderer/tile_display.hpp"
#include "actors/renderer/view_surface.hpp"
#include "actors/types/slot_mask.hpp"

namespace darm::renderer {

struct ViewTileOptions {
  float exposure = 1;
  float max_samples = 4096;     ///< a texel
  float publish_growth = 2.0f;  ///< a picture again after this factor in samples
  /// A turn of the eye, as seen from the surface, by this share of the lobe's width makes samples worthless.
  float lobe_share = 0.25f;
  float least_turn = 2e-4f;  ///< radians under which the eye counts as at rest: a tenth of a pixel
};

/// 32 KB. One thread at a time.
class ViewTile {
 public:
  explicit ViewTile(float exposure) : texels_(kSlotTexels), exposure_(exposure) {}

  /// Texels that are read now. What was shaded before keeps its light.
  void want(const SlotMask& mask);
  /// The eye is here now. Samples for the eye before are forgotten as far as the narrowest lobe of the tile has turned
  /// (a mirror's at once, rough ones' little by little); what is shown stays until there is a sample to replace it.
  void see_from(const glm::vec3& eye, const ViewTileOptions& options);

  /// Samples of the wanted texel with fewest; and how many texels are wanted.
  [[nodiscard]] float least() const { return least_; }
  [[nodiscard]] int wanted() const { return live_; }
  /// Variance of one sample in display values, averaged over the wanted texels; as large as can be until it is known.
  [[nodiscard]] float display_variance() const { return display_variance_; }
  [[nodiscard]] bool finished(const ViewTileOptions& options, float target_error) const;

  /// Takes up to `passes` samples of each wanted texel that is not ahead of the others. Returns how many.
  std::uint32_t shade(ViewSurface& surface, std::uint32_t passes);

  /// All wanted texels have a sample for this eye, and the last picture is of another eye, of other texels or of half
  /// the samples.
  [[nodiscard]] bool picture_due(const ViewTileOptions& options) const;
  [[nodiscard]] TilePicture draw(ViewSurface& surface);
  /// The picture did not reach anybody.
  void forget_picture() { pictured_ = -1; }

 private:
  struct Texel {
    glm::vec3 mean{0.0f};
    float m2 = 0;       // of luminance
    float beneath = 0;  // what it is seen on top of, nits
    float count = 0;    // 0: the mean is that of an eye before, or nothing
    std::uint32_t drawn = 0;
    bool shown = false;  // the mean is something
  };
  void add(Texel& texel, const ViewDependentLight& light);
  void survey();
  [[nodiscard]] float variance_of(const Texel& texel) const;
  [[nodiscard]] glm::vec3 tamed(int at) const;
  [[nodiscard]] int filter_radius() const;
  [[nodiscard]] float error_of(const std::vector<glm::vec3>& light, const std::vector<glm::vec3>& shown) const;

  std::vector<Texel> texels_;
  SlotMask mask_;
  SlotMask dead_;  // wanted, but nothing is under them
  std::shared_ptr<const ThroughTile> through_;
  bool through_known_ = false;
  glm::vec3 eye_{0.0f};
  std::uint32_t sequence_ = 0;  // of samples: another one after each reset
  float alpha_ = 1;             // narrowest lobe seen
  float distance_ = 0;          // nearest point seen to the eye; 0: none
  float least_ = 0;
  float mean_ = 0;
  float display_variance_ = 1;
  int live_ = 0;
  float exposure_ = 1;
  float pictured_ = -1;  // mean samples of the last picture; -1: none
  float error_ = 1;
};

}  // namespace darm::renderer
