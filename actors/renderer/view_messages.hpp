// The view renderer's inbox. Plain values only: peers may include this file and nothing else of the room.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <variant>
#include <vector>

#include "actors/runtime/overflow.hpp"
#include "actors/types/ids.hpp"
#include "actors/types/slot_mask.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::renderer {

/// A private tile of a session. `share`: of the session's picture that it serves, 0..1.
struct ViewTileRequest {
  TileId tile;
  float share = 0;
  SlotMask mask;  ///< texels that are read
};

/// All private tiles of a session and the eye they are for, replacing what was before. None: the session is forgotten.
struct ShadeView {
  static constexpr auto kOverflow = runtime::Overflow::kLatestByKey;
  SessionId session{};
  glm::vec3 eye{0.0f};     ///< recentred world space, finite
  float target_error = 0;  ///< RMS display error under which a tile costs no more time; 0: never
  std::shared_ptr<const std::vector<ViewTileRequest>> work;

  ShadeView(SessionId id, const glm::vec3& position, float target,
            std::shared_ptr<const std::vector<ViewTileRequest>> tiles)
      : session(id), eye(position), target_error(target), work(std::move(tiles)) {}
  [[nodiscard]] std::uint64_t key() const { return static_cast<std::uint64_t>(session); }
};

/// A slice of view shading is done on the pool. The view renderer sends it to itself.
struct ViewSliceFinished {
  static constexpr auto kOverflow = runtime::Overflow::kReject;
  std::uint64_t batch = 0;
  explicit ViewSliceFinished(std::uint64_t number) : batch(number) {}
};

class StoredLight;

/// The renderer knows the coarse level better: from the next batch on, paths behind a reflection end in this.
struct LightStored {
  static constexpr auto kOverflow = runtime::Overflow::kLatestOnly;
  std::shared_ptr<const StoredLight> light;
  explicit LightStored(std::shared_ptr<const StoredLight> snapshot) : light(std::move(snapshot)) {}
};

using ViewInbox = std::variant<ShadeView, LightStored, ViewSliceFinished>;

}  // namespace darm::renderer
