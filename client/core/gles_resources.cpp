#include "client/core/gles_resources.hpp"

#include <array>
#include <cstring>
#include <string_view>

namespace darm::client::gles {
namespace {

constexpr std::string_view kEsVersion = "#version 300 es\n";

Result<GLuint> compile(GLenum stage, std::string source) {
  if (is_desktop() && source.starts_with(kEsVersion)) source.replace(0, kEsVersion.size(), "#version 330 core\n");
  const GLuint shader = glCreateShader(stage);
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint ok = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == GL_TRUE) return shader;
  std::array<char, 1024> log{};
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()) - 1, nullptr, log.data());
  glDeleteShader(shader);
  return fail(std::string("shader does not compile: ") + log.data());
}

}  // namespace

template <Kind K>
void Name<K>::reset() {
  if (id_ == 0) return;
  if constexpr (K == Kind::kTexture) glDeleteTextures(1, &id_);
  if constexpr (K == Kind::kFramebuffer) glDeleteFramebuffers(1, &id_);
  if constexpr (K == Kind::kRenderbuffer) glDeleteRenderbuffers(1, &id_);
  if constexpr (K == Kind::kBuffer) glDeleteBuffers(1, &id_);
  if constexpr (K == Kind::kVertexArray) glDeleteVertexArrays(1, &id_);
  if constexpr (K == Kind::kProgram) glDeleteProgram(id_);
  id_ = 0;
}
template class Name<Kind::kTexture>;
template class Name<Kind::kFramebuffer>;
template class Name<Kind::kRenderbuffer>;
template class Name<Kind::kBuffer>;
template class Name<Kind::kVertexArray>;
template class Name<Kind::kProgram>;

Texture make_texture(GLenum internal_format, std::uint32_t width, std::uint32_t height, GLint filter) {
  GLuint id = 0;
  glGenTextures(1, &id);
  glBindTexture(GL_TEXTURE_2D, id);
  glTexStorage2D(GL_TEXTURE_2D, 1, internal_format, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return Texture(id);
}

Buffer make_buffer(GLenum target, const void* data, std::size_t bytes) {
  GLuint id = 0;
  glGenBuffers(1, &id);
  glBindBuffer(target, id);
  glBufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
  return Buffer(id);
}

VertexArray make_vertex_array() {
  GLuint id = 0;
  glGenVertexArrays(1, &id);
  glBindVertexArray(id);
  return VertexArray(id);
}

Framebuffer make_framebuffer() {
  GLuint id = 0;
  glGenFramebuffers(1, &id);
  glBindFramebuffer(GL_FRAMEBUFFER, id);
  return Framebuffer(id);
}

Renderbuffer make_renderbuffer(GLenum internal_format, std::uint32_t width, std::uint32_t height) {
  GLuint id = 0;
  glGenRenderbuffers(1, &id);
  glBindRenderbuffer(GL_RENDERBUFFER, id);
  glRenderbufferStorage(GL_RENDERBUFFER, internal_format, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  return Renderbuffer(id);
}

Result<Target> Target::create(GLenum format, std::uint32_t width, std::uint32_t height, bool depth) {
  Target t;
  t.width_ = width;
  t.height_ = height;
  if (depth) t.depth_ = make_renderbuffer(GL_DEPTH_COMPONENT32F, width, height);
  t.texture_ = make_texture(format, width, height, GL_NEAREST);
  t.framebuffer_ = make_framebuffer();
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t.texture_.id(), 0);
  if (depth) glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, t.depth_.id());
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return fail("GL: no render target of " + std::to_string(width) + "x" + std::to_string(height));
  return t;
}

void Target::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
  glViewport(0, 0, static_cast<GLsizei>(width_), static_cast<GLsizei>(height_));
}

Result<Program> Program::link(const std::string& vertex, const std::string& fragment) {
  const auto v = compile(GL_VERTEX_SHADER, vertex);
  if (!v) return std::unexpected(v.error());
  const auto f = compile(GL_FRAGMENT_SHADER, fragment);
  if (!f) {
    glDeleteShader(*v);
    return std::unexpected(f.error());
  }
  Program program;
  program.name_ = Name<Kind::kProgram>(glCreateProgram());
  const GLuint id = program.name_.id();
  glAttachShader(id, *v);
  glAttachShader(id, *f);
  glLinkProgram(id);
  glDeleteShader(*v);
  glDeleteShader(*f);
  GLint ok = GL_FALSE;
  glGetProgramiv(id, GL_LINK_STATUS, &ok);
  if (ok == GL_TRUE) return program;
  std::array<char, 1024> log{};
  glGetProgramInfoLog(id, static_cast<GLsizei>(log.size()) - 1, nullptr, log.data());
  return fail(std::string("shader program does not link: ") + log.data());
}

void Program::use() const { glUseProgram(name_.id()); }

GLint Program::at(const char* uniform) {
  const auto found = places_.find(uniform);
  if (found != places_.end()) return found->second;
  const GLint place = glGetUniformLocation(name_.id(), uniform);
  places_.emplace(uniform, place);
  return place;
}

bool has_extension(const char* name) {
  GLint count = 0;
  glGetIntegerv(GL_NUM_EXTENSIONS, &count);
  for (GLint i = 0; i < count; ++i) {
    const auto* extension = reinterpret_cast<const char*>(glGetStringi(GL_EXTENSIONS, static_cast<GLuint>(i)));
    if (extension != nullptr && std::strcmp(extension, name) == 0) return true;
  }
  return false;
}

bool is_desktop() {
  const auto* version = reinterpret_cast<const char*>(glGetString(GL_VERSION));
  return version != nullptr && std::strncmp(version, "OpenGL ES", 9) != 0;
}

}  // namespace darm::client::gles
