// From stored light to the picture of a tile.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "actors/atlas/radiance_store.hpp"
#include "actors/renderer/filter_irradiance.hpp"
#include "actors/renderer/tile_facts.hpp"
#include "actors/types/tile_image.hpp"

namespace darm::renderer {

struct DisplayOptions {
  float exposure = 1;          ///< display = sRGB(clamp(exposure * L)); > 0
  float filter_samples = 384;  ///< effective samples the filter gathers; 0 turns it off
};

struct TilePicture {
  std::shared_ptr<const TileImage> image;
  float error = 0;    ///< RMS over the mask's texels of the display-space standard error, 0..1. Noise only: what the
                      ///< filter smears is not in it
  float samples = 0;  ///< mean samples per texel of the mask
};

/// Makes pictures; keeps scratch memory, so one per thread. Reads the store and the facts: nobody may write them then.
class TileDisplay {
 public:
  TileDisplay(const atlas::RadianceStore& store, const TileFactsCache& facts, DisplayOptions options)
      : store_(store), facts_(facts), options_(options) {}

  /// The slot's 32x32 texels: payload and border (from the neighbour tiles where they are shaded), soft light filtered,
  /// unshaded texels filled from their patch, then from anything. nullopt if no texel of the slot was ever shaded.
  std::optional<TilePicture> draw(TileId id, const LevelTiles& level, const TexelMask& mask);

  /// The soft light of the slot drawn last as it was filtered; not known where it was not.
  [[nodiscard]] std::span<const FilteredTexel> filtered() const { return filtered_; }

 private:
  struct Neighbour {
    std::optional<atlas::TileView> light;
    std::shared_ptr<const TileFacts> facts;
  };
  void look_around(TileId id, const LevelTiles& level);
  [[nodiscard]] int radius_of(const TexelMask& mask) const;
  void gather(int radius);
  void shade_slot(std::vector<float>& variance, struct SlotColours& colours);
  [[nodiscard]] float error_of(const TileImage& image, const TexelMask& mask, const std::vector<float>& variance,
                               float& samples) const;

  const atlas::RadianceStore& store_;
  const TileFactsCache& facts_;
  DisplayOptions options_;
  std::array<Neighbour, 9> around_;
  FilterWindow window_;
  IrradianceFilter filter_;
  std::vector<FilteredTexel> filtered_;
};

}  // namespace darm::renderer
