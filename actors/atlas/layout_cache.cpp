#define XXH_INLINE_ALL
#include "actors/atlas/layout_cache.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>
#include <system_error>
#include <type_traits>

#include "actors/atlas/build_layout.hpp"

namespace darm::atlas {
namespace {

constexpr std::uint64_t kLayoutMagic = 0x31'59'4c'4d'52'41'44'00ull;  // "\0DARMLY1" read as little endian
constexpr std::uint32_t kLayoutVersion = 1;
constexpr std::uint64_t kMaxFile = std::uint64_t{4} << 30;

struct Header {
  std::uint64_t magic = kLayoutMagic;
  std::uint32_t version = kLayoutVersion;
  std::uint32_t reserved = 0;
  std::uint64_t payload = 0;
  std::uint64_t checksum = 0;
};

class Writer {
 public:
  explicit Writer(std::vector<std::byte>& out) : out_(out) {}
  template <class T>
  void value(const T& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(&v, sizeof v);
  }
  template <class T>
  void list(const std::vector<T>& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    value(static_cast<std::uint64_t>(v.size()));
    append(v.data(), v.size() * sizeof(T));
  }

 private:
  void append(const void* data, std::size_t bytes) {
    if (bytes == 0) return;
    const auto at = out_.size();
    out_.resize(at + bytes);
    std::memcpy(out_.data() + at, data, bytes);
  }
  std::vector<std::byte>& out_;
};

/// Takes values off the front; once something is missing, everything after fails too.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> in) : in_(in) {}
  template <class T>
  bool value(T& v) {
    if (in_.size() < sizeof v) return ok_ = false;
    std::memcpy(&v, in_.data(), sizeof v);
    in_ = in_.subspan(sizeof v);
    return ok_;
  }
  /// A count of things that take at least `least` bytes each.
  bool count(std::uint64_t& n, std::size_t least) { return value(n) && (ok_ = n <= in_.size() / least); }
  template <class T>
  bool list(std::vector<T>& v) {
    std::uint64_t n = 0;
    if (!count(n, sizeof(T))) return false;
    v.resize(n);
    if (n > 0) std::memcpy(v.data(), in_.data(), n * sizeof(T));
    in_ = in_.subspan(n * sizeof(T));
    return true;
  }
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] bool empty() const { return in_.empty(); }

 private:
  std::span<const std::byte> in_;
  bool ok_ = true;
};

void write_tables(Writer& w, const Layout& l) {
  w.value(l.hash);
  w.value(l.q);
  w.value(l.patch_count);
  w.value(l.surface_area);
  w.value(static_cast<std::uint64_t>(l.charts.size()));
  for (const auto& c : l.charts) {
    w.value(c.mesh);
    w.value(c.patch_count);
    w.list(c.local_patch);
    w.list(c.uv);
    w.list(c.patch_size);
    w.list(c.patch_area);
  }
  w.list(l.instances);
  w.value(static_cast<std::uint64_t>(l.levels.size()));
  for (const auto& v : l.levels) {
    w.value(v.density);
    w.value(v.width);
    w.value(v.height);
    w.value(v.occupancy);
    w.list(v.placements);
  }
  w.value(static_cast<std::uint64_t>(l.dropped.size()));
  for (const auto& d : l.dropped) {
    w.list(std::vector<char>(d.reason.begin(), d.reason.end()));
    w.value(d.count);
  }
}

bool read_tables(Reader& r, Layout& l) {
  std::uint64_t n = 0;
  r.value(l.hash), r.value(l.q), r.value(l.patch_count), r.value(l.surface_area);
  if (!r.count(n, 40)) return false;
  l.charts.resize(n);
  for (auto& c : l.charts) {
    r.value(c.mesh), r.value(c.patch_count);
    if (!r.list(c.local_patch) || !r.list(c.uv) || !r.list(c.patch_size) || !r.list(c.patch_area)) return false;
  }
  if (!r.list(l.instances) || !r.count(n, 24) || n > kMaxLevels) return false;
  l.levels.resize(n);
  for (auto& v : l.levels) {
    r.value(v.density), r.value(v.width), r.value(v.height), r.value(v.occupancy);
    if (!r.list(v.placements)) return false;
    v.tiles_x = v.width / kTileSize;
    v.tiles_y = v.height / kTileSize;
  }
  if (!r.count(n, 16)) return false;
  l.dropped.resize(n);
  for (auto& d : l.dropped) {
    std::vector<char> text;
    if (!r.list(text) || !r.value(d.count)) return false;
    d.reason.assign(text.begin(), text.end());
  }
  return r.ok() && r.empty();
}

bool positive(float v) { return std::isfinite(v) && v > 0; }

bool is_sound(const Chart& c) {
  if (c.local_patch.size() != c.uv.size() || c.patch_size.size() != c.patch_count ||
      c.patch_area.size() != c.patch_count)
    return false;
  for (const auto& s : c.patch_size)
    if (!(s.x >= 0 && s.y >= 0 && std::isfinite(s.x) && std::isfinite(s.y))) return false;
  for (std::size_t t = 0; t < c.uv.size(); ++t) {
    const auto p = c.local_patch[t];
    if (p == kDroppedTriangle) continue;
    if (p >= c.patch_count) return false;
    // A hair of rounding is allowed: sizes and corners were rounded apart.
    const glm::vec2 limit = c.patch_size[p] * 1.0001f;
    for (const auto& q : c.uv[t])
      if (!(q.x >= 0 && q.y >= 0 && q.x <= limit.x && q.y <= limit.y)) return false;
  }
  return true;
}

bool is_sound(const Level& v, const Layout& l) {
  if (!positive(v.density) || v.width == 0 || v.height == 0 || v.width % kTileSize != 0 || v.height % kTileSize != 0 ||
      std::uint64_t{v.tiles_x} * v.tiles_y > kMaxTilesPerLevel || v.placements.size() != l.patch_count)
    return false;
  for (const auto& use : l.instances) {
    const auto& chart = l.charts[use.chart];
    for (const auto base : {use.front_base, use.back_base}) {
      if (base == 0xffffffffu) continue;
      for (std::uint32_t p = 0; p < chart.patch_count; ++p) {
        const auto& place = v.placements[base + p];
        if (!(place.scale >= 0) || !std::isfinite(place.scale)) return false;
        const glm::vec2 extent = chart.patch_size[p] * (place.scale * v.density);
        // The last own texel of the box, with the rounding of large positions.
        if (!(static_cast<double>(place.x) + extent.x < v.width && static_cast<double>(place.y) + extent.y < v.height))
          return false;
      }
    }
  }
  return true;
}

bool is_sound(const Layout& l) {
  if (!positive(l.q) || !std::isfinite(l.surface_area) || l.levels.empty()) return false;
  for (const auto& c : l.charts)
    if (!is_sound(c)) return false;
  for (const auto& use : l.instances) {
    if (use.chart >= l.charts.size()) return false;
    const std::uint64_t n = l.charts[use.chart].patch_count;
    if (use.front_base + n > l.patch_count || (use.has_back() && use.back_base + n > l.patch_count)) return false;
  }
  for (const auto& v : l.levels)
    if (!is_sound(v, l)) return false;
  return true;
}

std::string last_error() { return std::error_code(errno, std::generic_category()).message(); }

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

}  // namespace

std::vector<std::byte> encode_layout(const Layout& layout) {
  std::vector<std::byte> out(sizeof(Header));
  Writer writer(out);
  write_tables(writer, layout);
  Header header;
  header.payload = out.size() - sizeof(Header);
  header.checksum = XXH3_64bits(out.data() + sizeof(Header), header.payload);
  std::memcpy(out.data(), &header, sizeof header);
  return out;
}

Result<std::shared_ptr<const Layout>> decode_layout(std::span<const std::byte> bytes) {
  Header header;
  if (bytes.size() < sizeof header) return fail("layout: shorter than its header");
  std::memcpy(&header, bytes.data(), sizeof header);
  const auto payload = bytes.subspan(sizeof header);
  if (header.magic != kLayoutMagic) return fail("layout: not a layout file");
  if (header.version != kLayoutVersion)
    return fail(fmt::format("layout: version {}, wanted {}", header.version, kLayoutVersion));
  if (header.payload != payload.size()) return fail("layout: torn, the length is wrong");
  if (header.checksum != XXH3_64bits(payload.data(), payload.size()))
    return fail("layout: torn, the checksum is wrong");
  auto layout = std::make_shared<Layout>();
  Reader reader(payload);
  if (!read_tables(reader, *layout)) return fail("layout: a table does not fit the file");
  if (!is_sound(*layout)) return fail("layout: a table holds an impossible value");
  return std::shared_ptr<const Layout>(std::move(layout));
}

Result<std::shared_ptr<const Layout>> read_layout(const std::filesystem::path& file) {
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat info{};
  if (fd.get() < 0 || ::fstat(fd.get(), &info) != 0) return fail(file.string() + ": " + last_error());
  if (!S_ISREG(info.st_mode) || info.st_size < 0 || static_cast<std::uint64_t>(info.st_size) > kMaxFile)
    return fail(file.string() + ": not a file of a sensible size");
  std::vector<std::byte> bytes(static_cast<std::size_t>(info.st_size));
  for (std::size_t have = 0; have < bytes.size();) {
    const auto n = ::read(fd.get(), bytes.data() + have, bytes.size() - have);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return fail(file.string() + ": " + last_error());
    if (n == 0) return fail(file.string() + ": became shorter while it was read");
    have += static_cast<std::size_t>(n);
  }
  auto layout = decode_layout(bytes);
  if (!layout) return std::unexpected(layout.error().within(file.string()));
  return layout;
}

Result<void> write_layout(const std::filesystem::path& file, const Layout& layout) {
  const auto bytes = encode_layout(layout);
  auto temporary = file.string() + ".XXXXXX";
  const Descriptor fd(::mkostemp(temporary.data(), O_CLOEXEC));
  if (fd.get() < 0) return fail(file.string() + ": " + last_error());
  const auto give_up = [&] {
    const auto why = last_error();
    ::unlink(temporary.c_str());
    return fail(file.string() + ": " + why);
  };
  for (std::size_t done = 0; done < bytes.size();) {
    const auto n = ::write(fd.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return give_up();
    done += static_cast<std::size_t>(n);
  }
  if (::fsync(fd.get()) != 0 || ::rename(temporary.c_str(), file.c_str()) != 0) return give_up();
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() >= 0) ::fsync(directory.get());  // a lost rename costs one more build, no more
  return {};
}

Result<std::shared_ptr<const Layout>> cached_layout(const scene::Scene& scene, const LayoutOptions& options,
                                                    const std::filesystem::path& state_dir, LayoutTimes* times) {
  const auto hash = layout_hash(scene, options);
  const auto file = state_dir / fmt::format("layout-{:016x}.bin", hash);
  if (times) *times = {};
  const auto fits = [&](const Layout& l) {
    return l.hash == hash && belongs_to(l, scene) &&
           std::uint64_t{l.levels[0].width} * l.levels[0].height <= options.max_texels;
  };
  if (auto kept = read_layout(file); kept && fits(**kept)) return kept;
  auto made = build_layout(scene, options, times);
  if (!made) return made;
  std::error_code ignored;
  std::filesystem::create_directories(state_dir, ignored);
  if (const auto written = write_layout(file, **made); !written && options.progress)
    options.progress("cache: " + written.error().message, 1.0f);
  return made;
}

bool belongs_to(const Layout& layout, const scene::Scene& scene) {
  if (layout.instances.size() != scene.instances.size()) return false;
  for (std::size_t i = 0; i < layout.instances.size(); ++i) {
    const auto& chart = layout.charts[layout.instances[i].chart];
    if (chart.mesh != scene.instances[i].mesh || chart.mesh >= scene.meshes.size() ||
        chart.uv.size() != scene.meshes[chart.mesh].triangles.size())
      return false;
  }
  return true;
}

}  // namespace darm::atlas
