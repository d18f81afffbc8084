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
  t.pages_ = gles::make_texture(GL_R16UI, kTableWidth, page_rows, GL_NEAREST);
  const std::uint32_t size = shape.phystex_size;
  t.chroma_444_ = shape.chroma_444;
  if (shape.lossless) {
    t.y_ = gles::make_texture(GL_RGB8, size, size, GL_LINEAR);
  } else {
    const std::uint32_t chroma = shape.chroma_444 ? size : size / 2;
    t.y_ = plane(size, size);
    t.cb_ = plane(chroma, chroma);
    t.cr_ = plane(chroma, chroma);
  }
  if (scene.has_alpha()) {
    t.coverage_ = plane(size, size);
    const std::vector<std::uint8_t> full(std::size_t{size} * size, 255);
    put(t.coverage_, 0, 0, size, size, GL_RED, GL_UNSIGNED_BYTE, full.data());
  }
  t.coarse_y_ = plane(1, 1);
  t.coarse_cb_ = plane(1, 1);
  t.coarse_cr_ = plane(1, 1);
  if (glGetError() != GL_NO_ERROR) return fail("GL: no memory for the stream's textures");
  return t;
}

Result<void> StreamTextures::upload_picture(const Picture& p) {
  if (p.chroma_444 != chroma_444_) {  // what the stream really carries wins over what was announced
    chroma_444_ = p.chroma_444;
    cb_ = plane(p.chroma_width(), p.chroma_height());
    cr_ = plane(p.chroma_width(), p.chroma_height());
  }
  put(y_, 0, 0, p.width, p.height, GL_RED, GL_UNSIGNED_BYTE, p.y.data());
  put(cb_, 0, 0, p.chroma_width(), p.chroma_height(), GL_RED, GL_UNSIGNED_BYTE, p.cb.data());
  put(cr_, 0, 0, p.chroma_width(), p.chroma_height(), GL_RED, GL_UNSIGNED_BYTE, p.cr.data());
  return {};
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

void StreamTextures::upload_slots(StreamPlayer& player) {
  const std::uint32_t per_row = shape_.slots_per_row();
  for (const auto& [slot, bytes] : player.take_pixels()) {
    put(y_, slot % per_row * kSlotSize, slot / per_row * kSlotSize, kSlotSize, kSlotSize, GL_RGB, GL_UNSIGNED_BYTE,
        bytes.data());
  }
  const auto coverage = player.take_coverage();
  if (!coverage_) return;
  for (const auto& [slot, bytes] : coverage) {
    put(coverage_, slot % per_row * kSlotSize, slot / per_row * kSlotSize, kSlotSize, kSlotSize, GL_RED,
        GL_UNSIGNED_BYTE, bytes.data());
  }
}

Result<void> StreamTextures::upload(StreamPlayer& player) {
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glActiveTexture(GL_TEXTURE0);
  for (const auto& rows : player.pages().take_dirty_rows()) {
    put(pages_, 0, rows.first, kTableWidth, rows.count, GL_RED_INTEGER, GL_UNSIGNED_SHORT,
        player.pages().data() + std::size_t{rows.first} * kTableWidth);
  }
  upload_slots(player);
  if (const Picture* picture = player.take_picture(); picture != nullptr) {
    if (auto ok = upload_picture(*picture); !ok) return ok;
  }
  if (const Picture* coarse = player.take_coarse(); coarse != nullptr) {
    if (auto ok = upload_coarse(*coarse); !ok) return ok;
  }
  if (glGetError() != GL_NO_ERROR) return fail("GL: an upload failed");
  return {};
}

void StreamTextures::bind() const {
  const gles::Texture* textures[] = {&places_,   &pages_,    &y_,         &cb_,       &cr_,
                                     &coverage_, &coarse_y_, &coarse_cb_, &coarse_cr_};
  for (int unit = 0; unit < 9; ++unit) {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
    glBindTexture(GL_TEXTURE_2D, textures[unit]->id());
  }
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace darm::client
