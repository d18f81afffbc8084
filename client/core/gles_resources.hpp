// Owners of OpenGL ES objects. Every call needs the context that made the object to be current.
#pragma once

#include <GLES3/gl3.h>

#include <cstdint>
#include <string>
#include <unordered_map>
#include <utility>

#include "client/core/result.hpp"

namespace darm::client::gles {

enum class Kind : std::uint8_t { kTexture, kFramebuffer, kRenderbuffer, kBuffer, kVertexArray, kProgram };

/// One GL name, deleted with its owner. 0: none.
template <Kind K>
class Name {
 public:
  Name() = default;
  explicit Name(GLuint id) : id_(id) {}
  Name(Name&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  Name& operator=(Name&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  ~Name() { reset(); }
  void reset();
  [[nodiscard]] GLuint id() const { return id_; }
  explicit operator bool() const { return id_ != 0; }

 private:
  GLuint id_ = 0;
};

using Texture = Name<Kind::kTexture>;
using Framebuffer = Name<Kind::kFramebuffer>;
using Renderbuffer = Name<Kind::kRenderbuffer>;
using Buffer = Name<Kind::kBuffer>;
using VertexArray = Name<Kind::kVertexArray>;

/// Immutable 2D texture, clamped at its edges. `filter`: GL_LINEAR or GL_NEAREST. Left bound.
[[nodiscard]] Texture make_texture(GLenum internal_format, std::uint32_t width, std::uint32_t height, GLint filter);
[[nodiscard]] Buffer make_buffer(GLenum target, const void* data, std::size_t bytes);
[[nodiscard]] VertexArray make_vertex_array();
[[nodiscard]] Framebuffer make_framebuffer();
[[nodiscard]] Renderbuffer make_renderbuffer(GLenum internal_format, std::uint32_t width, std::uint32_t height);

/// A colour texture to draw into and, where asked for, a depth buffer beside it.
class Target {
 public:
  [[nodiscard]] static Result<Target> create(GLenum format, std::uint32_t width, std::uint32_t height, bool depth);
  /// As the framebuffer, all of it.
  void bind() const;
  [[nodiscard]] GLuint texture() const { return texture_.id(); }
  [[nodiscard]] GLuint framebuffer() const { return framebuffer_.id(); }
  [[nodiscard]] std::uint32_t width() const { return width_; }
  [[nodiscard]] std::uint32_t height() const { return height_; }

 private:
  Texture texture_;
  Renderbuffer depth_;
  Framebuffer framebuffer_;
  std::uint32_t width_ = 0, height_ = 0;
};

/// A linked program; uniforms that it does not use are ignored when set. Sources are GLSL ES 3.00; where the context is
/// one of desktop OpenGL (3.3 or later) the same text is compiled as GLSL 3.30.
class Program {
 public:
  [[nodiscard]] static Result<Program> link(const std::string& vertex, const std::string& fragment);
  void use() const;
  [[nodiscard]] GLint at(const char* uniform);

 private:
  Name<Kind::kProgram> name_;
  std::unordered_map<std::string, GLint> places_;
};

[[nodiscard]] bool has_extension(const char* name);
/// The context is one of desktop OpenGL, not of OpenGL ES.
[[nodiscard]] bool is_desktop();

}  // namespace darm::client::gles
