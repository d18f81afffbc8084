// From stored light to the picture of a tile.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "actors/atlas/radiance_store.hpp"
#include "actors/renderer/filter_irradiance.hpp"
#include "actors/renderer/lost_light.hpp"
#include "actors/renderer/outliers.hpp"
#include "actors/renderer/stored_light.hpp"
#include "actors/renderer/tile_facts.hpp"
#include "actors/types/tile_image.hpp"

namespace darm::renderer {

struct DisplayOptions {
  float exposure = 1;          ///< display = sRGB(clamp(exposure * L)); > 0
  float filter_samples = 384;  ///< effective samples the filter gathers; 0 turns it off
};

/// A pixel reads about five texels of its level, of equal weight: the level is chosen so that the pixel is 1 to 2
/// texels wide along its lesser axis and often more along the other, and each of its 2x2 samples is bilinear.
inline constexpr float kPixelTexels = 5;

struct TilePicture {
  std::shared_ptr<const TileImage> image;
  /// RMS over the mask's texels of the display-space error expected, 0..1, of a pixel that reads about five of them:
  /// noise, and what the filter smears and holds down.
  float error = 0;
  float samples = 0;  ///< mean samples per texel of the mask
  /// Of soft light, mean over its texels: what outliers lost, in this tile and those beside it, of that and of what is
  /// shown. 0..1.
  float lost_share = 0;
};

/// What patches of a slot show of which nothing is known.
enum class Unlit : std::uint8_t {
  kAsBeside,  ///< the colours beside them: nobody sees them, and an even picture is few bits
  kGrey,      ///< as bright as the rest, but grey: whoever comes to see them sees no colour of something else
};

/// Makes pictures; keeps scratch memory, so one per thread. Reads the store and the facts: nobody may write them then.
class TileDisplay {
 public:
  /// `coarse`, if not null, is what texels without samples show.
  TileDisplay(const atlas::RadianceStore& store, const TileFactsCache& facts, DisplayOptions options,
              const StoredLight* coarse = nullptr)
      : store_(store), facts_(facts), options_(options), coarse_(coarse) {}

  /// The slot's 32x32 texels: payload and border (from the neighbour tiles where they are shaded), soft light filtered,
  /// texels without samples lit as the coarse level has their place, else filled from their patch, then as `unlit`
  /// says. Lightless texels give the filter nothing, and show the mean of the lit ones beside them, if there are any: a
  /// client's bilinear tap at a contact reads them.
  /// nullopt if nothing is known of any texel of the slot.
  std::optional<TilePicture> draw(TileId id, const LevelTiles& level, const TexelMask& mask,
                                  Unlit unlit = Unlit::kAsBeside);

  /// The soft light of the slot drawn last as it was filtered; not known where it was not.
  [[nodiscard]] std::span<const FilteredTexel> filtered() const { return filtered_; }

 private:
  struct Neighbour {
    std::optional<atlas::TileView> light;
    std::shared_ptr<const TileFacts> facts;
  };
  void look_around(TileId id, const LevelTiles& level);
  [[nodiscard]] bool wants_filter(const TexelMask& mask) const;
  // Slot or window coordinate (payload starts at 0) -> which of the three tiles along an axis, and the texel in it.
  struct Step {
    int tile;
    int texel;
  };
  [[nodiscard]] static Step step_of(int coordinate);
  [[nodiscard]] std::uint8_t walls_at(const Step& row, const Step& column) const;
  // Of the nine tiles, and the texel in it.
  struct Place {
    std::size_t tile;
    int texel;
  };
  [[nodiscard]] Place place_of_nine(std::size_t at) const;
  [[nodiscard]] bool sure_of(std::size_t at) const;
  void gather_nine();
  void find_lost();
  [[nodiscard]] int margin_of_window() const;
  void gather();
  void tame();
  void share_out();
  struct Lit {
    bool lightless = false;
    bool has_sharp = false;
    bool has_soft = false;
    LayerLight sharp;
    LayerLight soft;
    float smear = 0;  // of the soft light, as FilteredTexel has it
  };
  [[nodiscard]] static Lit light_of(const Neighbour& from, int texel, const FilteredTexel& filtered);
  void add_guess(Lit& lit, TileId id, std::uint32_t patch, const glm::vec2& at) const;
  void shade_slot(TileId id, const LevelTiles& level, struct SlotColours& colours);
  // Square error of the display values of texels that nothing is known of.
  [[nodiscard]] double fill_square(const TexelMask& mask, const struct SlotColours& colours,
                                   const std::array<bool, kSlotTexels>& known) const;
  [[nodiscard]] float error_of(const TexelMask& mask, const struct SlotColours& colours,
                               const std::array<bool, kSlotTexels>& known, float& samples) const;

  const atlas::RadianceStore& store_;
  const TileFactsCache& facts_;
  DisplayOptions options_;
  const StoredLight* coarse_;
  std::array<Neighbour, 9> around_;
  LightSquare square_;
  std::vector<Outlier> outliers_;
  LostLight lost_;
  float lost_share_ = 0;
  FilterWindow window_;
  IrradianceFilter filter_;
  std::vector<FilteredTexel> filtered_;
};

}  // namespace darm::renderer
