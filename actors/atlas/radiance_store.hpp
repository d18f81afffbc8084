// The light gathered so far, per texel, in a sparse memory-mapped file that survives restarts and crashes.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/types/error.hpp"
#include "actors/types/tile_id.hpp"

namespace darm::atlas {

/// The planes of a stored tile, 900 floats each, row-major. `sharp` is light with hard shadows (own emission, sun,
/// delta lights), `soft` everything else; they are counted apart because they converge at different speed. Mean*:
/// running mean radiance, nits. Count: samples (whole, < 2^24). M2: sum of squared deviations of the luminance.
enum class Plane : int {
  kSharpRed,
  kSharpGreen,
  kSharpBlue,
  kSharpCount,
  kSharpM2,
  kSoftRed,
  kSoftGreen,
  kSoftBlue,
  kSoftCount,
  kSoftM2,
};
inline constexpr int kPlanes = 10;
enum class Layer : int { kSharp = 0, kSoft = 5 };

/// Rec. 709 luminance of linear RGB.
[[nodiscard]] inline double luminance(const glm::dvec3& c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; }

/// Samples of one texel and layer, summed in double before they are merged into the store.
struct TexelBatch {
  glm::dvec3 sum{0.0};
  double luminance_m2 = 0;  ///< sum of squared deviations from the mean
  std::uint32_t count = 0;

  /// Adds a sample; false (and nothing changed) if it is NaN, infinite or beyond any light there is (1e15 nits).
  [[nodiscard]] bool add(const glm::vec3& radiance);
};

/// What reflected light is multiplied with, texel by texel, as far as it is known: stored beside the light, because the
/// filter divides by it, and computing it again costs more than reading the light.
struct TileAlbedo {
  std::array<std::array<std::uint16_t, 3>, kTileTexels> bits{};  ///< 65535 is 1
  std::array<std::uint8_t, kTileTexels> points{};                ///< of the surface, behind the mean; 0: not known
  bool operator==(const TileAlbedo&) const = default;
};

/// The newest picture of a tile (TileImage), kept so that a restart shows it without drawing it again.
struct StoredPicture {
  std::array<std::uint8_t, kSlotTexels * 3> rgb{};
  std::array<std::uint8_t, kSlotTexels> coverage{};
  std::uint32_t covered = 0;  ///< 1: `coverage` counts; 0: opaque
  float error = 0;            ///< as it was estimated, 0..1
  float samples = 0;          ///< mean per seen texel
  bool operator==(const StoredPicture&) const = default;
};

/// Read access to one tile. Valid while the store lives; contents are stable while nobody updates the tile.
class TileView {
 public:
  TileView() = default;
  TileView(const float* planes, const TileAlbedo* albedo) : planes_(planes), albedo_(albedo) {}
  [[nodiscard]] const TileAlbedo& albedo() const { return *albedo_; }
  [[nodiscard]] const float* plane(Plane p) const { return planes_ + static_cast<int>(p) * kTileTexels; }
  [[nodiscard]] glm::vec3 mean(Layer layer, int texel) const {
    const float* p = planes_ + static_cast<int>(layer) * kTileTexels + texel;
    return {p[0], p[kTileTexels], p[2 * kTileTexels]};
  }
  [[nodiscard]] float count(Layer layer, int texel) const {
    return planes_[(static_cast<int>(layer) + 3) * kTileTexels + texel];
  }
  /// No sample of many brought any light: the texel lies inside other geometry (a foot under its floor), or is closed
  /// off. Its black is right where it is, and wrong in a mean with the texels beside it.
  [[nodiscard]] bool lightless(int texel) const {
    return count(Layer::kSoft, texel) >= kLightlessSamples && mean(Layer::kSoft, texel) == glm::vec3(0.0f) &&
           mean(Layer::kSharp, texel) == glm::vec3(0.0f);
  }
  /// Variance of the mean's luminance (standard error squared). 0 samples: +inf is never returned, but `unknown`.
  [[nodiscard]] float variance_of_mean(Layer layer, int texel, float unknown) const {
    const float n = count(layer, texel);
    if (n < 2) return unknown;
    return planes_[(static_cast<int>(layer) + 4) * kTileTexels + texel] / (n * (n - 1));
  }

 private:
  static constexpr float kLightlessSamples = 16;  // paths; one that ends in stored light brings some nearly always
  const float* planes_ = nullptr;
  const TileAlbedo* albedo_ = nullptr;
};

/// What the light in a store depends on. A store with another key is another file.
struct StoreKey {
  std::uint64_t scene = 0;
  std::uint64_t layout = 0;
  std::uint64_t light = 0;
};

struct StoreOptions {
  std::uint64_t max_bytes = std::uint64_t{16}
                            << 30;  ///< of the file; a tile takes 48 KiB. New tiles are refused beyond it
  /// The last level always has room, on disk as well: what has none of its own is shown, and lit, from there.
  bool reserve_last_level = false;
};

struct StoreCounters {
  std::uint64_t tiles = 0;  ///< with a block of their own
  std::uint64_t bytes = 0;  ///< of blocks in use
  std::uint64_t torn = 0;   ///< tiles refused since opening: being written at a crash, or their check sum is wrong
  std::uint64_t bad_entries = 0;   ///< directory entries refused at opening
  std::uint64_t refused_full = 0;  ///< updates refused: size limit or disk full
};

/// Threads: different tiles may be updated at once from different threads; one tile has one writer at a time, and is
/// not read while it is written (the renderer's phases guarantee both). Everything else is thread-safe.
///
/// A `kill -9` at any instant leaves each tile valid or detectably torn: an update first marks the tile as being
/// written, then changes it, then writes check sum and state. Tiles are verified when they are first touched, so that
/// opening takes no time. Against power loss the check sum alone holds (the kernel writes pages back in any order).
class RadianceStore {
 public:
  /// Holds a tile open for writing; finishes the update when destroyed. Keep it short: a crash in between loses the
  /// tile.
  class Update {
   public:
    Update(Update&& other) noexcept : store_(other.store_), block_(other.block_) { other.store_ = nullptr; }
    Update(const Update&) = delete;
    Update& operator=(const Update&) = delete;
    Update& operator=(Update&&) = delete;
    ~Update();

    /// Merges a batch into a texel's running mean and second moment (Chan, Golub, LeVeque 1979, eq. 2.1; pairs of any
    /// order give the same up to rounding). Refuses nothing: batches hold only finite samples.
    void merge(int texel, Layer layer, const TexelBatch& batch);
    /// As if the texel had never had a sample of that layer.
    void forget(int texel, Layer layer);
    void put_albedo(const TileAlbedo& albedo);
    [[nodiscard]] TileView view() const;

   private:
    friend class RadianceStore;
    Update(RadianceStore* store, std::uint32_t block) : store_(store), block_(block) {}
    RadianceStore* store_;
    std::uint32_t block_;
  };

  /// Opens `directory`/radiance-<key>.store, or makes it. `tiles_per_level`: 1..16 levels, 2^28 tiles in all at most.
  /// A file that is not this store (or whose header is damaged) is renamed to *.refused, a fresh one made, and the
  /// reason kept in refused_reason(). Fails if the folder cannot be written, another process has the store open, or
  /// there is no room for what is to be reserved.
  static Result<std::unique_ptr<RadianceStore>> open(const std::filesystem::path& directory, const StoreKey& key,
                                                     std::span<const std::uint32_t> tiles_per_level,
                                                     const StoreOptions& options = {});
  static Result<std::unique_ptr<RadianceStore>> open(const std::filesystem::path& directory, const StoreKey& key,
                                                     const Layout& layout, const StoreOptions& options = {});
  /// Name of the store's file within its directory.
  [[nodiscard]] static std::string file_name(const StoreKey& key);

  RadianceStore(const RadianceStore&) = delete;
  RadianceStore& operator=(const RadianceStore&) = delete;
  ~RadianceStore();  ///< writes everything to disk

  /// The tile's light; nullopt if it was never shaded, or is torn (counted once).
  [[nodiscard]] std::optional<TileView> read(TileId tile) const;
  /// True if the tile has a block, whole or torn: a look into the directory, no more.
  [[nodiscard]] bool has(TileId tile) const;
  /// Number of updates the tile has seen; 0: nothing stored. Grows over restarts.
  [[nodiscard]] std::uint32_t version(TileId tile) const;

  /// Keeps a picture beside the tile's light; does nothing if the tile has none. `tag` (not 0) names all that a picture
  /// depends on beside light: one written under another tag is not found. Has a check sum of its own, so that writing
  /// it puts no light at risk. One thread per tile, but the light may be read meanwhile.
  void put_picture(TileId tile, std::uint64_t tag, const StoredPicture& picture);
  /// nullopt: none, or torn, or of another tag, or of a tile that is refused.
  [[nodiscard]] std::optional<StoredPicture> picture(TileId tile, std::uint64_t tag) const;

  /// Opens a tile for writing; a new or torn one starts empty. Fails (counted) when the size limit or the disk is full.
  [[nodiscard]] Result<Update> begin_update(TileId tile);

  [[nodiscard]] StoreCounters counters() const;
  [[nodiscard]] const std::string& refused_reason() const { return refused_reason_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Bytes of one block: header, planes, albedo and picture, whole pages.
  static constexpr std::size_t kBlockBytes = 12 * 4096;

 private:
  struct BlockHeader;
  enum class Trust : std::uint8_t { kUnknown, kGood, kTorn };

  RadianceStore() = default;
  [[nodiscard]] Result<void> map(const StoreKey& key, std::span<const std::uint32_t> tiles_per_level,
                                 const StoreOptions& options);
  [[nodiscard]] std::string refusal(const StoreKey& key, std::span<const std::uint32_t> tiles_per_level) const;
  [[nodiscard]] Result<void> create(const StoreKey& key, std::span<const std::uint32_t> tiles_per_level);
  void adopt_directory(std::uint64_t file_bytes);
  [[nodiscard]] std::optional<std::uint64_t> slot_of(TileId tile) const;
  [[nodiscard]] std::atomic_ref<std::uint32_t> entry(std::uint64_t slot) const;
  [[nodiscard]] BlockHeader* block(std::uint32_t index) const;
  /// Null if the tile has no light that can be trusted.
  [[nodiscard]] BlockHeader* trusted_block(TileId tile) const;
  [[nodiscard]] Trust trust_of(std::uint32_t block_index, TileId tile) const;
  [[nodiscard]] Result<void> reserve_last_level();
  [[nodiscard]] Result<void> grow_for(std::uint64_t blocks);
  [[nodiscard]] Result<std::uint32_t> allocate_block(bool reserved);

  std::filesystem::path path_;
  std::string refused_reason_;
  int file_ = -1;
  std::byte* base_ = nullptr;
  std::uint64_t mapped_bytes_ = 0;
  std::uint64_t blocks_offset_ = 0;
  std::vector<std::uint64_t> level_start_;  ///< first directory slot of each level, and the end
  std::uint32_t max_blocks_ = 0;
  mutable std::vector<std::atomic<Trust>> trust_;

  std::mutex allocation_;              // guards the five below
  std::uint64_t reserved_left_ = 0;    ///< tiles of the last level without a block, if they are reserved
  std::uint64_t allocated_bytes_ = 0;  ///< of the file, reserved on disk
  std::uint32_t next_block_ = 0;
  std::vector<std::uint32_t> free_blocks_;
  std::atomic<std::uint64_t> tiles_{0};
  mutable std::atomic<std::uint64_t> torn_{0};
  std::atomic<std::uint64_t> bad_entries_{0};
  std::atomic<std::uint64_t> refused_full_{0};
};

}  // namespace darm::atlas
