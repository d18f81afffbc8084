#include "client/core/stream_textures.hpp"

#include <fmt/format.h>

#include <bit>
#include <string>
#include <vector>

namespace darm::client {
namespace {

void put(const gles::Texture& texture, std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
         GLenum format, GLenum type, const void* data) {
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glTexSubImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(x), static_cast<GLint>(y), static_cast<GLsizei>(width),
                  static_cast<GLsizei>(height), format, type, data);
}

// One slot's bytes at its place among `size` pixels.
void put_slot(const gles::Texture& texture, std::uint32_t size, std::uint16_t slot, GLenum format,
              const std::string& bytes) {
  const std::uint32_t per_row = size / kSlotSize;
  put(texture, slot % per_row * kSlotSize, slot / per_row * kSlotSize, kSlotSize, kSlotSize, format, GL_UNSIGNED_BYTE,
      bytes.data());
}

gles::Texture plane(std::uint32_t width, std::uint32_t height) {
  return gles::make_texture(GL_R8, width, height, GL_LINEAR);
}

// The patch table as texels: x, y, bits of scale, nothing.
Result<gles::Texture> make_places(const SceneModel& scene, std::uint32_t largest) {
  const auto& places = scene.places();
  const auto rows = static_cast<std::uint32_t>((places.size() + kTableWidth - 1) / kTableWidth);
  if (rows > largest) return fail("manifest: the patch table is larger than a texture of this GL");
  std::vector<std::uint32_t> texels(std::size_t{rows} * kTableWidth * 4, 0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    texels[i * 4] = places[i].x;
    texels[i * 4 + 1] = places[i].y;
    texels[i * 4 + 2] = std::bit_cast<std::uint32_t>(places[i].scale);
  }
  auto texture = gles::make_texture(GL_RGBA32UI, kTableWidth, rows, GL_NEAREST);
  put(texture, 0, 0, kTableWidth, rows, GL_RGBA_INTEGER, GL_UNSIGNED_INT, texels.data());
  return texture;
}

}  // namespace

Result<StreamTextures> StreamTextures::create(const SceneModel& scene, const StreamShape& shape) {
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  StreamTextures t;
  t.shape_ = shape;
  t.largest_ = static_cast<std::uint32_t>(largest);
  if (shape.phystex_size > t.largest_)
    return fail(fmt::format("PhysTex of {} pixels: this GL stops at {}; ask for less with --phystex",
                            shape.phystex_size, largest));
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  auto places = make_places(scene, t.largest_);
  if (!places) return std::unexpected(places.error());
  t.places_ = std::move(*places);
  const std::uint32_t page_rows = PageTable(scene.tile_count()).rows();
  if (page_rows > t.largest_) return fail("manifest: the page table is larger than a texture of this GL");
  t.shared_.make(page_rows, shape);
  if (scene.has_alpha()) {
    t.make_coverage();
    if (auto made = t.make_coarse_coverage(scene); !made) return std::unexpected(made.error());
  }
  t.coarse_y_ = plane(1, 1);
  t.coarse_cb_ = plane(1, 1);
  t.coarse_cr_ = plane(1, 1);
  if (glGetError() != GL_NO_ERROR) return fail("GL: no memory for the stream's textures");
  return t;
}

void StreamTextures::Slots::make(std::uint32_t page_rows, const StreamShape& shape) {
  pages = gles::make_texture(GL_R16UI, kTableWidth, page_rows, GL_NEAREST);
  const std::vector<std::uint16_t> none(std::size_t{page_rows} * kTableWidth, kAbsent);
  put(pages, 0, 0, kTableWidth, page_rows, GL_RED_INTEGER, GL_UNSIGNED_SHORT, none.data());
  size = shape.phystex_size;
  chroma_444 = shape.chroma_444;
  if (shape.lossless) {
    y = gles::make_texture(GL_RGB8, size, size, GL_LINEAR);
    return;
  }
  const std::uint32_t chroma = shape.chroma_444 ? size : size / 2;
  y = plane(size, size);
  cb = plane(chroma, chroma);
  cr = plane(chroma, chroma);
}

void StreamTextures::Slots::put_picture(const Picture& p) {
  if (p.chroma_444 != chroma_444) {  // what the stream really carries wins over what was announced
    chroma_444 = p.chroma_444;
    cb = plane(p.chroma_width(), p.chroma_height());
    cr = plane(p.chroma_width(), p.chroma_height());
  }
  put(y, 0, 0, p.width, p.height, GL_RED, GL_UNSIGNED_BYTE, p.y.data());
  put(cb, 0, 0, p.chroma_width(), p.chroma_height(), GL_RED, GL_UNSIGNED_BYTE, p.cb.data());
  put(cr, 0, 0, p.chroma_width(), p.chroma_height(), GL_RED, GL_UNSIGNED_BYTE, p.cr.data());
}

void StreamTextures::Slots::upload(const StreamNews& news) {
  for (const auto& [row, slots] : news.pages)
    put(pages, 0, row, kTableWidth, 1, GL_RED_INTEGER, GL_UNSIGNED_SHORT, slots.data());
  for (const auto& [slot, bytes] : news.pixels) put_slot(y, size, slot, GL_RGB, bytes);
  if (news.picture) put_picture(*news.picture);
}

Result<void> StreamTextures::upload_coarse(const Picture& p) {
  if (p.width > largest_ || p.height > largest_) return fail("coarse texture: larger than a texture of this GL");
  coarse_y_ = plane(p.width, p.height);
  coarse_cb_ = plane(p.chroma_width(), p.chroma_height());
  coarse_cr_ = plane(p.chroma_width(), p.chroma_height());
  put(coarse_y_, 0, 0, p.width, p.height, GL_RED, GL_UNSIGNED_BYTE, p.y.data());
  put(coarse_cb_, 0, 0, p.chroma_width(), p.chroma_height(), GL_RED, GL_UNSIGNED_BYTE, p.cb.data());
  put(coarse_cr_, 0, 0, p.chroma_width(), p.chroma_height(), GL_RED, GL_UNSIGNED_BYTE, p.cr.data());
  coarse_width_ = p.width;
  coarse_height_ = p.height;
  return {};
}

void StreamTextures::make_coverage() {
  const std::uint32_t size = shape_.phystex_size;
  coverage_ = plane(size, size);
  const std::vector<std::uint8_t> full(std::size_t{size} * size, 255);
  put(coverage_, 0, 0, size, size, GL_RED, GL_UNSIGNED_BYTE, full.data());
}

Result<void> StreamTextures::make_coarse_coverage(const SceneModel& scene) {
  const auto& bytes = scene.coarse_coverage();
  const std::uint8_t opaque = 255;
  const auto& level = scene.levels().back();
  const std::uint32_t width = bytes.empty() ? 1 : level.width;
  const std::uint32_t height = bytes.empty() ? 1 : level.height;
  if (width > largest_ || height > largest_) return fail("coarse texture: larger than a texture of this GL");
  coarse_coverage_ = plane(width, height);
  put(coarse_coverage_, 0, 0, width, height, GL_RED, GL_UNSIGNED_BYTE,
      bytes.empty() ? static_cast<const void*>(&opaque) : bytes.data());
  return {};
}

void StreamTextures::make_through() {
  const std::uint32_t size = view_.size;
  through_ = gles::make_texture(GL_RGB8, size, size, GL_LINEAR);
  const std::vector<std::uint8_t> none(std::size_t{size} * size * 3, 0);
  put(through_, 0, 0, size, size, GL_RGB, GL_UNSIGNED_BYTE, none.data());
}

Result<void> StreamTextures::upload(const StreamNews& news) {
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glActiveTexture(GL_TEXTURE0);
  shared_.upload(news);
  if (coverage_) {
    if (news.fresh) make_coverage();
    for (const auto& [slot, bytes] : news.coverage) put_slot(coverage_, shape_.phystex_size, slot, GL_RED, bytes);
  }
  if (news.coarse) {
    if (auto ok = upload_coarse(*news.coarse); !ok) return ok;
  }
  if (glGetError() != GL_NO_ERROR) return fail("GL: an upload failed");
  return {};
}

Result<void> StreamTextures::upload_view(const StreamNews& news, const SceneModel& scene, const StreamShape& shape) {
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glActiveTexture(GL_TEXTURE0);
  const bool first = !has_view();
  if (first) view_.make(PageTable(scene.tile_count()).rows(), shape);
  if (scene.has_clear() && (first || news.fresh)) make_through();
  view_.upload(news);  // coverage is the shared layer's
  if (through_) {
    for (const auto& [slot, bytes] : news.through) put_slot(through_, view_.size, slot, GL_RGB, bytes);
  }
  if (glGetError() != GL_NO_ERROR) return fail("GL: an upload of the private layer failed");
  return {};
}

void StreamTextures::bind() const {
  const gles::Texture* textures[] = {&places_,   &shared_.pages, &shared_.y,  &shared_.cb, &shared_.cr,
                                     &coverage_, &coarse_y_,     &coarse_cb_, &coarse_cr_, &view_.pages,
                                     &view_.y,   &view_.cb,      &view_.cr,   &through_,   &coarse_coverage_};
  GLenum unit = GL_TEXTURE0;
  for (const auto* texture : textures) {
    glActiveTexture(unit++);
    glBindTexture(GL_TEXTURE_2D, texture->id());
  }
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace darm::client
