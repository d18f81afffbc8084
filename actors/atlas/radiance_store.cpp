#include "actors/atlas/radiance_store.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <system_error>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace darm::atlas {

namespace {

constexpr std::uint64_t kPage = 4096;
constexpr std::uint32_t kStoreVersion = 2;
constexpr std::uint32_t kClean = 0x434c4541;
constexpr std::uint32_t kBeingWritten = 0x44495254;
constexpr std::array<char, 8> kStoreMagic{'D', 'A', 'R', 'M', 'R', 'A', 'D', '\n'};
constexpr std::uint64_t kMaxTiles = std::uint64_t{1} << 28;
constexpr std::uint64_t kBlocksPerReserve = 32;  // 1.5 MiB: one system call a second even while everything is new
constexpr double kBrightest = 1e15;

struct FileHeader {
  std::array<char, 8> magic;
  std::uint32_t version;
  std::uint32_t block_bytes;
  std::uint64_t scene;
  std::uint64_t layout;
  std::uint64_t light;
  std::uint32_t level_count;
  std::uint32_t byte_order;  // 0x01020304 as this machine writes it
  std::array<std::uint32_t, kMaxLevels> tiles;
  std::uint64_t check_sum;  // of everything before it
};
static_assert(sizeof(FileHeader) <= kPage);

FileHeader make_header(const StoreKey& key, std::span<const std::uint32_t> tiles_per_level) {
  FileHeader h;
  std::memset(&h, 0, sizeof h);
  h.magic = kStoreMagic;
  h.version = kStoreVersion;
  h.block_bytes = RadianceStore::kBlockBytes;
  h.scene = key.scene;
  h.layout = key.layout;
  h.light = key.light;
  h.level_count = static_cast<std::uint32_t>(tiles_per_level.size());
  h.byte_order = 0x01020304;
  std::copy(tiles_per_level.begin(), tiles_per_level.end(), h.tiles.begin());
  h.check_sum = XXH3_64bits(&h, offsetof(FileHeader, check_sum));
  return h;
}

std::uint64_t round_up(std::uint64_t n, std::uint64_t to) { return (n + to - 1) / to * to; }

std::string reason_of(int error) { return std::generic_category().message(error); }

// Takes the disk space now: a store into a hole of a mapped file on a full disk would end the process with SIGBUS.
int reserve_on_disk(int file, std::uint64_t from, std::uint64_t to) {
  if (::fallocate(file, 0, static_cast<off_t>(from), static_cast<off_t>(to - from)) == 0) return 0;
  if (errno != EOPNOTSUPP && errno != ENOSYS) return errno;
  return ::ftruncate(file, static_cast<off_t>(to)) == 0 ? 0 : errno;  // a file system that cannot reserve
}

}  // namespace

bool TexelBatch::add(const glm::vec3& radiance) {
  const glm::dvec3 c(radiance);
  const bool sane = std::abs(c.x) <= kBrightest && std::abs(c.y) <= kBrightest && std::abs(c.z) <= kBrightest;
  if (!sane) return false;  // NaN compares false as well
  // Youngs & Cramer 1971: deviations, not squares, whose difference says nothing where the mean is large.
  if (count > 0) {
    const double n = count;
    const double delta = luminance(c) - luminance(sum) / n;
    luminance_m2 += delta * delta * n / (n + 1);
  }
  sum += c;
  ++count;
  return true;
}

struct RadianceStore::BlockHeader {
  std::uint64_t check_sum;
  std::uint32_t state;
  std::uint32_t tile;
  std::uint32_t version;
  std::uint32_t unused[11];
  struct Content {
    float planes[kPlanes * kTileTexels];
    TileAlbedo albedo;
  } content;
  static_assert(std::has_unique_object_representations_v<TileAlbedo> && std::is_trivially_copyable_v<Content>);

  struct Picture {
    std::uint64_t check_sum;
    std::uint64_t tag;  // 0: none
    StoredPicture content;

    [[nodiscard]] std::uint64_t sum_now() const { return XXH3_64bits_withSeed(&content, sizeof content, tag); }
  } picture;
  static_assert(std::is_trivially_copyable_v<StoredPicture>);

  [[nodiscard]] std::uint64_t sum_now() const {
    const std::uint64_t seed = (std::uint64_t{tile} << 32 | version) ^ 0x6461726d;
    return XXH3_64bits_withSeed(&content, sizeof content, seed);
  }
  [[nodiscard]] TileView view() const { return {content.planes, &content.albedo}; }
};

std::string RadianceStore::file_name(const StoreKey& key) {
  std::array<char, 80> name{};
  std::snprintf(name.data(), name.size(), "radiance-%016llx-%016llx-%016llx.store",
                static_cast<unsigned long long>(key.scene), static_cast<unsigned long long>(key.layout),
                static_cast<unsigned long long>(key.light));
  return name.data();
}

Result<std::unique_ptr<RadianceStore>> RadianceStore::open(const std::filesystem::path& directory, const StoreKey& key,
                                                           const Layout& layout, const StoreOptions& options) {
  std::vector<std::uint32_t> tiles;
  for (const auto& level : layout.levels) tiles.push_back(level.tiles_x * level.tiles_y);
  return open(directory, key, tiles, options);
}

Result<std::unique_ptr<RadianceStore>> RadianceStore::open(const std::filesystem::path& directory, const StoreKey& key,
                                                           std::span<const std::uint32_t> tiles_per_level,
                                                           const StoreOptions& options) {
  static_assert(sizeof(BlockHeader) <= kBlockBytes && kBlockBytes % kPage == 0);
  if (tiles_per_level.empty() || tiles_per_level.size() > kMaxLevels)
    return fail("radiance store: a layout of 1 to 16 levels is needed");
  std::uint64_t total = 0;
  for (const auto n : tiles_per_level) total += n;
  if (total == 0 || total > kMaxTiles)
    return fail("radiance store: " + std::to_string(total) + " tiles are outside 1..2^28; choose a smaller q");

  std::error_code made;
  std::filesystem::create_directories(directory, made);
  std::unique_ptr<RadianceStore> store(new RadianceStore);
  store->path_ = directory / file_name(key);
  for (int attempt = 0; attempt < 2; ++attempt) {
    store->file_ = ::open(store->path_.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
    if (store->file_ < 0 && (errno == ENOENT) && attempt == 0) {
      if (auto ok = store->create(key, tiles_per_level); !ok) return std::unexpected(ok.error());
    } else if (store->file_ < 0) {
      return fail(store->path_.string() + ": cannot be opened: " + reason_of(errno));
    }
    if (::flock(store->file_, LOCK_EX | LOCK_NB) != 0)
      return fail(store->path_.string() + ": in use by another process; give this one its own --state-dir");
    auto why = store->refusal(key, tiles_per_level);
    if (why.empty()) break;
    if (attempt == 1) return fail(store->path_.string() + ": " + why);
    store->refused_reason_ = why;
    std::error_code renamed;
    std::filesystem::rename(store->path_, store->path_.string() + ".refused", renamed);
    if (renamed) return fail(store->path_.string() + ": " + why + ", and it cannot be renamed: " + renamed.message());
    ::close(store->file_);
    store->file_ = -1;
    if (auto ok = store->create(key, tiles_per_level); !ok) return std::unexpected(ok.error());
    ::close(store->file_);
    store->file_ = -1;
  }
  if (auto ok = store->map(key, tiles_per_level, options); !ok) return std::unexpected(ok.error());
  if (options.reserve_last_level) {
    if (auto ok = store->reserve_last_level(); !ok) return std::unexpected(ok.error());
  }
  return store;
}

// A store appears under its name only when it is whole: a crash while making it leaves nothing behind.
Result<void> RadianceStore::create(const StoreKey& key, std::span<const std::uint32_t> tiles_per_level) {
  const auto fresh = path_.string() + ".new";
  file_ = ::open(fresh.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (file_ < 0) return fail(fresh + ": cannot be made: " + reason_of(errno));
  std::uint64_t total = 0;
  for (const auto n : tiles_per_level) total += n;
  const std::uint64_t bytes = kPage + round_up(total * sizeof(std::uint32_t), kPage);
  if (const int error = reserve_on_disk(file_, 0, bytes); error != 0)
    return fail(fresh + ": no room for " + std::to_string(bytes) + " bytes: " + reason_of(error));
  const FileHeader header = make_header(key, tiles_per_level);
  if (::pwrite(file_, &header, sizeof header, 0) != static_cast<ssize_t>(sizeof header) || ::fsync(file_) != 0)
    return fail(fresh + ": cannot be written: " + reason_of(errno));
  std::error_code renamed;
  std::filesystem::rename(fresh, path_, renamed);
  if (renamed) return fail(fresh + ": cannot be renamed: " + renamed.message());
  return {};
}

std::string RadianceStore::refusal(const StoreKey& key, std::span<const std::uint32_t> tiles_per_level) const {
  struct stat info{};
  if (::fstat(file_, &info) != 0 || !S_ISREG(info.st_mode)) return "not a regular file";
  FileHeader found;
  if (::pread(file_, &found, sizeof found, 0) != static_cast<ssize_t>(sizeof found)) return "too short for a header";
  const FileHeader wanted = make_header(key, tiles_per_level);
  if (found.magic != kStoreMagic) return "not a radiance store";
  if (found.version != kStoreVersion)
    return "store version " + std::to_string(found.version) + ", this program writes " + std::to_string(kStoreVersion);
  if (found.check_sum != XXH3_64bits(&found, offsetof(FileHeader, check_sum))) return "header is damaged";
  if (found.byte_order != wanted.byte_order) return "written by a machine of other byte order";
  if (found.scene != key.scene) return "of another scene";
  if (found.layout != key.layout || found.tiles != wanted.tiles || found.level_count != wanted.level_count)
    return "of another atlas layout";
  if (found.light != key.light) return "of another state of the lights";
  if (found.block_bytes != kBlockBytes) return "of another tile size";
  std::uint64_t total = 0;
  for (const auto n : tiles_per_level) total += n;
  if (static_cast<std::uint64_t>(info.st_size) < kPage + round_up(total * sizeof(std::uint32_t), kPage))
    return "directory is cut off";
  return {};
}

Result<void> RadianceStore::map(const StoreKey&, std::span<const std::uint32_t> tiles_per_level,
                                const StoreOptions& options) {
  level_start_.push_back(0);
  for (const auto n : tiles_per_level) level_start_.push_back(level_start_.back() + n);
  blocks_offset_ = kPage + round_up(level_start_.back() * sizeof(std::uint32_t), kPage);
  struct stat info{};
  if (::fstat(file_, &info) != 0) return fail(path_.string() + ": " + reason_of(errno));
  const auto file_bytes = static_cast<std::uint64_t>(info.st_size);

  // The file may already be larger than today's limit: what is there stays readable.
  const std::uint64_t wanted = std::max({options.max_bytes, file_bytes, blocks_offset_ + kBlockBytes});
  const std::uint64_t blocks =
      std::min({(wanted - blocks_offset_) / kBlockBytes, level_start_.back(), std::uint64_t{0xfffffffe}});
  max_blocks_ = static_cast<std::uint32_t>(blocks);
  mapped_bytes_ = blocks_offset_ + blocks * kBlockBytes;
  // Mapped to its full size once, so that addresses never move; the file grows under the mapping.
  void* at = ::mmap(nullptr, mapped_bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_NORESERVE, file_, 0);
  if (at == MAP_FAILED)
    return fail(path_.string() + ": cannot be mapped (" + reason_of(errno) + "); lower the store's size limit");
  base_ = static_cast<std::byte*>(at);
  ::madvise(at, mapped_bytes_, MADV_RANDOM);
  trust_ = std::vector<std::atomic<Trust>>(max_blocks_);
  adopt_directory(file_bytes);
  return {};
}

// Whatever the directory says is checked before it is believed: each block inside the file, and owned by one tile.
void RadianceStore::adopt_directory(std::uint64_t file_bytes) {
  const std::uint64_t whole_blocks =
      file_bytes > blocks_offset_ ? std::min<std::uint64_t>((file_bytes - blocks_offset_) / kBlockBytes, max_blocks_)
                                  : 0;
  std::vector<bool> used(whole_blocks);
  for (std::uint64_t slot = 0; slot < level_start_.back(); ++slot) {
    const std::uint32_t e = entry(slot).load(std::memory_order_relaxed);
    if (e == 0) continue;
    if (e - 1 >= whole_blocks || used[e - 1]) {
      entry(slot).store(0, std::memory_order_relaxed);
      ++bad_entries_;
      continue;
    }
    used[e - 1] = true;
    ++tiles_;
    next_block_ = std::max(next_block_, e);
  }
  for (std::uint32_t b = next_block_; b-- > 0;)
    if (!used[b]) free_blocks_.push_back(b);
  allocated_bytes_ = blocks_offset_ + whole_blocks * kBlockBytes;
}

RadianceStore::~RadianceStore() {
  if (base_ != nullptr) ::munmap(base_, mapped_bytes_);
  if (file_ >= 0) {
    ::fdatasync(file_);  // covers pages dirtied through the mapping
    ::close(file_);
  }
}

std::optional<std::uint64_t> RadianceStore::slot_of(TileId tile) const {
  const auto level = static_cast<std::size_t>(tile.level());
  if (level + 1 >= level_start_.size()) return std::nullopt;
  const std::uint64_t slot = level_start_[level] + tile.index();
  if (slot >= level_start_[level + 1]) return std::nullopt;
  return slot;
}

std::atomic_ref<std::uint32_t> RadianceStore::entry(std::uint64_t slot) const {
  return std::atomic_ref(reinterpret_cast<std::uint32_t*>(base_ + kPage)[slot]);
}

RadianceStore::BlockHeader* RadianceStore::block(std::uint32_t index) const {
  return reinterpret_cast<BlockHeader*>(base_ + blocks_offset_ + std::uint64_t{index} * kBlockBytes);
}

RadianceStore::Trust RadianceStore::trust_of(std::uint32_t block_index, TileId tile) const {
  auto& trust = trust_[block_index];
  const Trust known = trust.load(std::memory_order_acquire);
  if (known != Trust::kUnknown) return known;
  const BlockHeader* b = block(block_index);
  bool good = b->state == kClean && b->tile == tile.packed && b->check_sum == b->sum_now();
  for (int i = 0; good && i < kPlanes * kTileTexels; ++i) good = std::isfinite(b->content.planes[i]);
  Trust expected = Trust::kUnknown;
  const Trust verdict = good ? Trust::kGood : Trust::kTorn;
  if (trust.compare_exchange_strong(expected, verdict, std::memory_order_acq_rel) && !good) ++torn_;
  return good ? Trust::kGood : Trust::kTorn;
}

RadianceStore::BlockHeader* RadianceStore::trusted_block(TileId tile) const {
  const auto slot = slot_of(tile);
  if (!slot) return nullptr;
  const std::uint32_t e = entry(*slot).load(std::memory_order_acquire);
  return e != 0 && trust_of(e - 1, tile) == Trust::kGood ? block(e - 1) : nullptr;
}

std::optional<TileView> RadianceStore::read(TileId tile) const {
  const BlockHeader* b = trusted_block(tile);
  return b != nullptr ? std::optional(b->view()) : std::nullopt;
}

void RadianceStore::put_picture(TileId tile, std::uint64_t tag, const StoredPicture& picture) {
  BlockHeader* b = trusted_block(tile);
  if (b == nullptr || tag == 0) return;
  std::atomic_ref(b->picture.tag).store(0, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_seq_cst);  // as in begin_update
  b->picture.content = picture;
  b->picture.check_sum = XXH3_64bits_withSeed(&picture, sizeof picture, tag);
  std::atomic_thread_fence(std::memory_order_seq_cst);
  std::atomic_ref(b->picture.tag).store(tag, std::memory_order_release);
}

std::optional<StoredPicture> RadianceStore::picture(TileId tile, std::uint64_t tag) const {
  const BlockHeader* b = trusted_block(tile);
  if (b == nullptr || tag == 0 || b->picture.tag != tag || b->picture.check_sum != b->picture.sum_now())
    return std::nullopt;
  const auto& p = b->picture.content;
  if (!std::isfinite(p.error) || !std::isfinite(p.samples)) return std::nullopt;
  return p;
}

bool RadianceStore::has(TileId tile) const {
  const auto slot = slot_of(tile);
  return slot && entry(*slot).load(std::memory_order_acquire) != 0;
}

std::uint32_t RadianceStore::version(TileId tile) const {
  const BlockHeader* b = trusted_block(tile);
  return b != nullptr ? b->version : 0;
}

Result<void> RadianceStore::reserve_last_level() {
  const std::scoped_lock lock(allocation_);
  for (std::uint64_t slot = level_start_[level_start_.size() - 2]; slot < level_start_.back(); ++slot)
    reserved_left_ += entry(slot).load(std::memory_order_relaxed) == 0 ? 1 : 0;
  const std::uint64_t more = reserved_left_ > free_blocks_.size() ? reserved_left_ - free_blocks_.size() : 0;
  const std::uint64_t bytes = blocks_offset_ + (next_block_ + more) * kBlockBytes;
  if (next_block_ + more > max_blocks_)
    return fail(path_.string() + ": the coarse level alone takes " + std::to_string(bytes) +
                " bytes; raise state.max_store_bytes to that or more");
  if (auto ok = grow_for(next_block_ + more); !ok)
    return fail(ok.error().message + " (" + std::to_string(bytes) +
                " bytes for the coarse level); make room on the disk or give another --state-dir");
  return {};
}

// The file then has room for so many blocks.
Result<void> RadianceStore::grow_for(std::uint64_t blocks) {
  const std::uint64_t needed = blocks_offset_ + blocks * kBlockBytes;
  if (needed <= allocated_bytes_) return {};
  const std::uint64_t ahead = std::max(needed, allocated_bytes_ + kBlocksPerReserve * kBlockBytes);
  for (const std::uint64_t to :
       {std::min(ahead, mapped_bytes_), needed}) {  // the last of a disk is taken piece by piece
    if (const int error = reserve_on_disk(file_, allocated_bytes_, to); error != 0) {
      if (to == needed) return fail(path_.string() + ": cannot grow: " + reason_of(error));
      continue;
    }
    allocated_bytes_ = to;
    break;
  }
  return {};
}

// `reserved`: for one of the tiles that reserved_left_ counts.
Result<std::uint32_t> RadianceStore::allocate_block(bool reserved) {
  const std::scoped_lock lock(allocation_);
  const bool counted = reserved && reserved_left_ > 0;
  const std::uint64_t kept = reserved_left_ - (counted ? 1 : 0);  // for others
  const std::uint64_t free = free_blocks_.size();
  const std::uint64_t more = kept + 1 > free ? kept + 1 - free : 0;  // blocks that are not there yet
  if (next_block_ + more > max_blocks_) return fail(path_.string() + ": full; raise the store's size limit");
  if (auto ok = grow_for(next_block_ + more); !ok) return std::unexpected(ok.error());
  reserved_left_ = kept;
  if (free == 0) return next_block_++;
  const auto b = free_blocks_.back();
  free_blocks_.pop_back();
  return b;
}

Result<RadianceStore::Update> RadianceStore::begin_update(TileId tile) {
  const auto slot = slot_of(tile);
  if (!slot) return fail("radiance store: tile " + std::to_string(tile.packed) + " is outside the atlas");
  std::uint32_t e = entry(*slot).load(std::memory_order_acquire);
  bool empty = false;
  if (e == 0) {
    auto fresh = allocate_block(*slot >= level_start_[level_start_.size() - 2]);
    if (!fresh) {
      ++refused_full_;
      return std::unexpected(fresh.error());
    }
    e = *fresh + 1;
    empty = true;
    ++tiles_;
  } else {
    empty = trust_of(e - 1, tile) == Trust::kTorn;
  }
  BlockHeader* b = block(e - 1);
  std::atomic_ref(b->state).store(kBeingWritten, std::memory_order_relaxed);
  // A killed process loses no store it has made, so order within this thread is all that counts; the fence keeps the
  // compiler (and other processors) from moving the writes of the light above the mark.
  std::atomic_thread_fence(std::memory_order_seq_cst);
  if (empty) {
    std::memset(static_cast<void*>(&b->content), 0, sizeof b->content);
    b->picture.tag = 0;
    b->tile = tile.packed;
    b->version = 0;
    trust_[e - 1].store(Trust::kGood, std::memory_order_release);
    entry(*slot).store(e, std::memory_order_release);
  }
  return Update(this, e - 1);
}

TileView RadianceStore::Update::view() const { return store_->block(block_)->view(); }

void RadianceStore::Update::put_albedo(const TileAlbedo& albedo) { store_->block(block_)->content.albedo = albedo; }

void RadianceStore::Update::merge(int texel, Layer layer, const TexelBatch& batch) {
  if (batch.count == 0 || texel < 0 || texel >= kTileTexels) return;
  float* p = store_->block(block_)->content.planes + static_cast<int>(layer) * kTileTexels + texel;
  const double before = p[3 * kTileTexels];
  const double added = batch.count;
  const double all = before + added;  // > 0
  const glm::dvec3 old_mean(p[0], p[kTileTexels], p[2 * kTileTexels]);
  const glm::dvec3 batch_mean = batch.sum / added;
  const glm::dvec3 step = (batch_mean - old_mean) * (added / all);
  const double delta = luminance(batch_mean) - luminance(old_mean);
  p[0] = static_cast<float>(old_mean.x + step.x);
  p[kTileTexels] = static_cast<float>(old_mean.y + step.y);
  p[2 * kTileTexels] = static_cast<float>(old_mean.z + step.z);
  p[3 * kTileTexels] = static_cast<float>(std::min(all, 16777216.0));
  p[4 * kTileTexels] = static_cast<float>(
      std::min(1e38, p[4 * kTileTexels] + batch.luminance_m2 + delta * delta * before * added / all));
}

void RadianceStore::Update::forget(int texel, Layer layer) {
  if (texel < 0 || texel >= kTileTexels) return;
  float* p = store_->block(block_)->content.planes + static_cast<int>(layer) * kTileTexels + texel;
  for (int plane = 0; plane < kPlanes / 2; ++plane) p[plane * kTileTexels] = 0;
}

RadianceStore::Update::~Update() {
  if (store_ == nullptr) return;
  BlockHeader* b = store_->block(block_);
  ++b->version;
  b->check_sum = b->sum_now();
  std::atomic_thread_fence(std::memory_order_seq_cst);
  std::atomic_ref(b->state).store(kClean, std::memory_order_release);
}

StoreCounters RadianceStore::counters() const {
  StoreCounters c;
  c.tiles = tiles_;
  c.bytes = c.tiles * kBlockBytes;
  c.torn = torn_;
  c.bad_entries = bad_entries_;
  c.refused_full = refused_full_;
  return c;
}

}  // namespace darm::atlas
