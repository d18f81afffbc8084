#include "client/core/renderer_gles.hpp"

#include <EGL/egl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "client/core/gles_resources.hpp"
#include "client/core/shaders.hpp"
#include "client/core/stream_textures.hpp"
#include "client/core/view_space.hpp"

namespace darm::client {
namespace {

constexpr std::uint32_t kSamplesPerAxis = 2;
constexpr GLenum kLowerLeft = 0x8CA1;
constexpr GLenum kZeroToOne = 0x935F;
using ClipControl = void (*)(GLenum origin, GLenum depth);

struct GpuChunk {
  gles::VertexArray array;
  gles::Buffer vertices, indices;
  GLsizei index_count = 0;
};

// One chunk of one instance.
struct Item {
  std::uint32_t instance = 0;
  std::uint32_t chunk = 0;
  double distance = 0;
};

enum class Pass : std::uint8_t { kDepth, kColour, kStats, kThrough };

// Surfaces whose faces a draw call shows.
enum class Faces : std::uint8_t { kAll, kBacks, kFronts };

}  // namespace

struct GlesRenderer::State {
  StreamTextures textures;
  StreamShape shape;
  std::vector<GpuChunk> chunks;
  std::vector<Item> opaque, blended;
  std::map<std::uint32_t, gles::Program> surfaces;
  std::optional<gles::Program> depth, background, background_stats, resolve;
  gles::VertexArray empty_array;
  gles::Target samples, picture, stats;
  std::uint32_t largest = 0;
  bool linear = false;
  ClipControl clip_control = nullptr;

  explicit State(StreamTextures t) : textures(std::move(t)) {}

  Result<gles::Program*> surface(const SurfaceVariant& variant);
  Result<void> make_targets(std::uint32_t width, std::uint32_t height);
  Result<void> fit(gles::Target& target, GLenum format, std::uint32_t width, std::uint32_t height, bool with_depth);
  void add_chunk(const SceneModel& scene, std::uint32_t index);
  void draw_background(const SceneModel& scene, const View& view, bool stats_pass);
  Result<void> draw_items(const SceneModel& scene, const View& view, const std::vector<Item>& items, Pass pass,
                          bool blend);
  Result<void> draw_scene(const SceneModel& scene, const View& view, const gles::Target& target, bool stats_pass);
  void set_frame_uniforms(gles::Program& program, const SceneModel& scene) const;
  void set_blending(const InstanceShape& instance) const;
  Result<gles::Program*> use_program(const SceneModel& scene, const InstanceShape& instance, Pass pass, bool blend);
  Result<void> draw_item(const SceneModel& scene, const View& view, const Item& item, const glm::dmat4& to_clip,
                         Pass pass, bool blend, Faces faces);
  Result<void> draw_blended_item(const SceneModel& scene, const View& view, const Item& item,
                                 const glm::dmat4& to_clip);
  gles::Program* current = nullptr;  // whose frame uniforms are set
  float samples_per_axis = 1;        // of a pixel, in what is drawn now
};

namespace {

bool is_blended(const InstanceShape& i) { return i.alpha_mode == AlphaMode::kBlend || i.transmission > 0; }

// RGBA, bottom row first.
std::vector<std::uint8_t> read_pixels(const gles::Target& target) {
  std::vector<std::uint8_t> rgba(std::size_t{target.width()} * target.height() * 4);
  target.bind();
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, static_cast<GLsizei>(target.width()), static_cast<GLsizei>(target.height()), GL_RGBA,
               GL_UNSIGNED_BYTE, rgba.data());
  return rgba;
}

}  // namespace

Result<gles::Program*> GlesRenderer::State::surface(const SurfaceVariant& variant) {
  const auto found = surfaces.find(variant.bits());
  if (found != surfaces.end()) return &found->second;
  auto program = gles::Program::link(surface_vertex_source(variant.view), surface_fragment_source(variant));
  if (!program) return std::unexpected(program.error());
  program->use();
  glUniform1i(program->at("u_places"), kPlacesUnit);
  glUniform1i(program->at("u_pages"), kPagesUnit);
  glUniform1i(program->at(variant.lossless ? "u_rgb" : "u_y"), kYUnit);
  glUniform1i(program->at("u_cb"), kCbUnit);
  glUniform1i(program->at("u_cr"), kCrUnit);
  glUniform1i(program->at("u_coverage"), kCoverageUnit);
  glUniform1i(program->at("u_coarse_y"), kCoarseYUnit);
  glUniform1i(program->at("u_coarse_cb"), kCoarseCbUnit);
  glUniform1i(program->at("u_coarse_cr"), kCoarseCrUnit);
  glUniform1i(program->at("u_view_pages"), kViewPagesUnit);
  glUniform1i(program->at(variant.lossless ? "u_view_rgb" : "u_view_y"), kViewYUnit);
  glUniform1i(program->at("u_view_cb"), kViewCbUnit);
  glUniform1i(program->at("u_view_cr"), kViewCrUnit);
  glUniform1i(program->at("u_through"), kThroughUnit);
  glUniform1i(program->at("u_coarse_coverage"), kCoarseCoverageUnit);
  return &surfaces.emplace(variant.bits(), std::move(*program)).first->second;
}

void GlesRenderer::State::set_frame_uniforms(gles::Program& program, const SceneModel& scene) const {
  std::array<glm::vec4, kMaxLevels> levels{};
  for (std::size_t i = 0; i < scene.levels().size(); ++i) {
    const auto& l = scene.levels()[i];
    levels[i] = {l.density, static_cast<float>(l.first_tile), static_cast<float>(l.tiles_x),
                 static_cast<float>(l.tiles_y)};
  }
  glUniform4fv(program.at("u_levels"), static_cast<GLsizei>(kMaxLevels), glm::value_ptr(levels[0]));
  glUniform1i(program.at("u_level_count"), static_cast<GLint>(scene.levels().size()));
  glUniform1ui(program.at("u_patch_count"), scene.patch_count());
  glUniform1f(program.at("u_q_per_pixel"), scene.q() * samples_per_axis);
  glUniform1f(program.at("u_phys_size"), static_cast<float>(shape.phystex_size));
  glUniform1f(program.at("u_chroma_step"), textures.chroma_444() ? 1.0f : 0.5f);
  glUniform1f(program.at("u_view_size"), static_cast<float>(textures.view_size()));
  glUniform1f(program.at("u_view_chroma_step"), textures.view_444() ? 1.0f : 0.5f);
  glUniform2f(program.at("u_coarse_size"), static_cast<float>(textures.coarse_width()),
              static_cast<float>(textures.coarse_height()));
  const glm::vec3& sky = scene.background().horizon;
  const float grey = linear_to_srgb(glm::clamp(0.2126f * sky.x + 0.7152f * sky.y + 0.0722f * sky.z, 0.0f, 1.0f));
  glUniform3f(program.at("u_missing"), grey, grey, grey);
}

// Both classes let through what is behind: BLEND by its coverage, thin clear surfaces by tint times transmission.
void GlesRenderer::State::set_blending(const InstanceShape& instance) const {
  if (instance.transmission > 0) {
    const glm::vec3 through = instance.tint * instance.transmission;
    glBlendColor(through.x, through.y, through.z, 1.0f);
    glBlendFunc(GL_ONE, GL_CONSTANT_COLOR);
  } else {
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  }
}

Result<void> GlesRenderer::State::fit(gles::Target& target, GLenum format, std::uint32_t width, std::uint32_t height,
                                      bool with_depth) {
  if (target.width() == width && target.height() == height) return {};
  target = gles::Target();  // the old one's memory first
  auto made = gles::Target::create(format, width, height, with_depth);
  if (!made) return std::unexpected(made.error());
  target = std::move(*made);
  return {};
}

Result<void> GlesRenderer::State::make_targets(std::uint32_t width, std::uint32_t height) {
  const std::uint32_t most = largest / kSamplesPerAxis;
  if (width == 0 || height == 0 || width > most || height > most)
    return fail(fmt::format("picture of {}x{}: this GL draws at most {} on a side", width, height, most));
  const GLenum format = linear ? GL_RGBA16F : GL_RGBA8;
  if (auto ok = fit(samples, format, width * kSamplesPerAxis, height * kSamplesPerAxis, true); !ok) return ok;
  return fit(picture, GL_RGBA8, width, height, false);
}

void GlesRenderer::State::add_chunk(const SceneModel& scene, std::uint32_t index) {
  const Chunk& chunk = scene.chunks()[index];
  GpuChunk gpu;
  gpu.array = gles::make_vertex_array();
  gpu.vertices = gles::make_buffer(GL_ARRAY_BUFFER, chunk.vertices.data(), chunk.vertices.size() * sizeof(Vertex));
  gpu.indices =
      gles::make_buffer(GL_ELEMENT_ARRAY_BUFFER, chunk.indices.data(), chunk.indices.size() * sizeof(std::uint32_t));
  gpu.index_count = static_cast<GLsizei>(chunk.indices.size());
  // GL takes offsets as pointers. NOLINTNEXTLINE(performance-no-int-to-ptr)
  const auto at = [](std::size_t offset) { return reinterpret_cast<const void*>(offset); };
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), at(offsetof(Vertex, position)));
  glEnableVertexAttribArray(1);
  glVertexAttribPointer(1, 2, GL_FLOAT, GL_FALSE, sizeof(Vertex), at(offsetof(Vertex, uv)));
  glEnableVertexAttribArray(2);
  glVertexAttribIPointer(2, 1, GL_UNSIGNED_INT, sizeof(Vertex), at(offsetof(Vertex, local_patch)));
  glBindVertexArray(0);
  chunks.push_back(std::move(gpu));
  if (chunk.indices.empty()) return;
  for (std::uint32_t i = 0; i < scene.instances().size(); ++i) {
    const auto& instance = scene.instances()[i];
    if (instance.chart == chunk.chart) (is_blended(instance) ? blended : opaque).push_back({i, index, 0});
  }
}

void GlesRenderer::State::draw_background(const SceneModel& scene, const View& view, bool stats_pass) {
  gles::Program& program = stats_pass ? *background_stats : *background;
  program.use();
  const double half = std::tan(view.fovy * 0.5);
  const glm::dmat3 axes = glm::mat3_cast(view.orientation);
  const glm::vec3 right(axes[0] * (half * view.width / view.height)), up(axes[1] * half), forward(-axes[2]);
  const Background& b = scene.background();
  glUniform3fv(program.at("u_right"), 1, glm::value_ptr(right));
  glUniform3fv(program.at("u_up"), 1, glm::value_ptr(up));
  glUniform3fv(program.at("u_forward"), 1, glm::value_ptr(forward));
  glUniform3fv(program.at("u_zenith"), 1, glm::value_ptr(b.zenith));
  glUniform3fv(program.at("u_horizon"), 1, glm::value_ptr(b.horizon));
  glUniform3fv(program.at("u_ground"), 1, glm::value_ptr(b.ground));
  glUniform4f(program.at("u_sun"), b.sun_direction.x, b.sun_direction.y, b.sun_direction.z,
              b.has_sun ? b.sun_cos : 2.0f);
  glUniform3fv(program.at("u_sun_rgb"), 1, glm::value_ptr(b.sun_rgb));
  glUniform1f(program.at("u_depth"), clip_control != nullptr ? 0.0f : 1.0f);
  glDisable(GL_CULL_FACE);
  glBindVertexArray(empty_array.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

Result<gles::Program*> GlesRenderer::State::use_program(const SceneModel& scene, const InstanceShape& instance,
                                                        Pass pass, bool blend) {
  gles::Program* program = &*depth;
  if (pass != Pass::kDepth) {
    SurfaceVariant variant;
    variant.lossless = shape.lossless;
    variant.mask = instance.alpha_mode == AlphaMode::kMask;
    variant.blend = blend && instance.alpha_mode == AlphaMode::kBlend;
    variant.linear = linear;
    variant.stats = pass == Pass::kStats;
    variant.view = textures.has_view() && pass != Pass::kStats;
    variant.through = pass == Pass::kThrough;
    auto found = surface(variant);
    if (!found) return std::unexpected(found.error());
    program = *found;
  }
  if (program != current) {
    program->use();
    if (pass != Pass::kDepth) set_frame_uniforms(*program, scene);
    current = program;
  }
  return program;
}

Result<void> GlesRenderer::State::draw_item(const SceneModel& scene, const View& view, const Item& item,
                                            const glm::dmat4& to_clip, Pass pass, bool blend, Faces faces) {
  const auto& instance = scene.instances()[item.instance];
  auto found = use_program(scene, instance, pass, blend);
  if (!found) return std::unexpected(found.error());
  gles::Program& program = **found;
  const glm::mat4 matrix(to_clip * glm::dmat4(instance.to_world));
  glUniformMatrix4fv(program.at("u_to_clip"), 1, GL_FALSE, glm::value_ptr(matrix));
  if (pass != Pass::kDepth) {
    glUniform1ui(program.at("u_front_base"), instance.front_base);
    glUniform1ui(program.at("u_back_base"), instance.back_base);
    glUniform1f(program.at("u_cutoff"), instance.alpha_cutoff);
  }
  if (textures.has_view() && (pass == Pass::kColour || pass == Pass::kThrough)) {
    glm::dmat4 from_eye(instance.to_world);
    from_eye[3] -= glm::dvec4(view.position - scene.origin(), 0.0);
    const glm::mat4 from_eye_f(from_eye);
    const glm::vec3 tint = instance.tint * instance.transmission;
    glUniformMatrix4fv(program.at("u_from_eye"), 1, GL_FALSE, glm::value_ptr(from_eye_f));
    glUniform3fv(program.at("u_tint"), 1, glm::value_ptr(tint));
    glUniform1f(program.at("u_f0"), instance.f0);
  }
  glFrontFace(instance.flipped ? GL_CW : GL_CCW);  // makes gl_FrontFacing the scene's front
  if (instance.camera_sees_back && faces == Faces::kAll) {
    glDisable(GL_CULL_FACE);
  } else {
    glEnable(GL_CULL_FACE);
    glCullFace(faces == Faces::kBacks ? GL_FRONT : GL_BACK);
  }
  const GpuChunk& gpu = chunks[item.chunk];
  glBindVertexArray(gpu.array.id());
  glDrawElements(GL_TRIANGLES, gpu.index_count, GL_UNSIGNED_INT, nullptr);
  glCullFace(GL_BACK);
  return {};
}

// Faces turned away before those turned here, so that a closed body's far side lies under its near one. With the
// private layer each twice: what is behind is multiplied by what comes through, then their light is added.
Result<void> GlesRenderer::State::draw_blended_item(const SceneModel& scene, const View& view, const Item& item,
                                                    const glm::dmat4& to_clip) {
  const auto& instance = scene.instances()[item.instance];
  const bool clear = instance.transmission > 0 && textures.has_view();
  for (const Faces faces : {Faces::kBacks, Faces::kFronts}) {
    if (faces == Faces::kBacks && !instance.camera_sees_back) continue;
    if (!clear) {
      set_blending(instance);
      if (auto ok = draw_item(scene, view, item, to_clip, Pass::kColour, true, faces); !ok) return ok;
      continue;
    }
    glBlendFunc(GL_ZERO, GL_SRC_COLOR);
    if (auto ok = draw_item(scene, view, item, to_clip, Pass::kThrough, true, faces); !ok) return ok;
    glBlendFunc(GL_SRC_ALPHA, GL_ONE);
    if (auto ok = draw_item(scene, view, item, to_clip, Pass::kColour, true, faces); !ok) return ok;
  }
  return {};
}

Result<void> GlesRenderer::State::draw_items(const SceneModel& scene, const View& view, const std::vector<Item>& items,
                                             Pass pass, bool blend) {
  const glm::dmat4 to_clip = world_to_clip(scene, view, clip_control != nullptr);
  current = nullptr;
  for (const Item& item : items) {
    const auto& instance = scene.instances()[item.instance];
    if (pass == Pass::kDepth && instance.alpha_mode == AlphaMode::kMask) continue;
    if (outside(scene.chunks()[item.chunk], to_clip * glm::dmat4(instance.to_world))) continue;
    auto ok = blend && pass == Pass::kColour ? draw_blended_item(scene, view, item, to_clip)
                                             : draw_item(scene, view, item, to_clip, pass, blend, Faces::kAll);
    if (!ok) return ok;
  }
  return {};
}

Result<void> GlesRenderer::State::draw_scene(const SceneModel& scene, const View& view, const gles::Target& target,
                                             bool stats_pass) {
  target.bind();
  samples_per_axis = static_cast<float>(target.height()) / static_cast<float>(view.height);
  const bool reversed = clip_control != nullptr;
  if (reversed) clip_control(kLowerLeft, kZeroToOne);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glDepthMask(GL_TRUE);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glClearDepthf(reversed ? 0.0f : 1.0f);
  glClear(GL_DEPTH_BUFFER_BIT);
  textures.bind();
  const auto eye = glm::vec3(view.position - scene.origin());
  for (auto* items : {&opaque, &blended}) {
    for (Item& item : *items)
      item.distance = glm::length(centre(scene.chunks()[item.chunk], scene.instances()[item.instance]) - eye);
  }
  std::sort(opaque.begin(), opaque.end(), [](const Item& a, const Item& b) {
    return std::tie(a.distance, a.instance, a.chunk) < std::tie(b.distance, b.instance, b.chunk);
  });
  std::sort(blended.begin(), blended.end(), [](const Item& a, const Item& b) {
    return std::tie(a.distance, a.instance, a.chunk) > std::tie(b.distance, b.instance, b.chunk);
  });
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(reversed ? GL_GEQUAL : GL_LEQUAL);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  Result<void> ok = draw_items(scene, view, opaque, Pass::kDepth, false);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  const Pass pass = stats_pass ? Pass::kStats : Pass::kColour;
  if (ok) ok = draw_items(scene, view, opaque, pass, false);
  glDepthMask(GL_FALSE);
  draw_background(scene, view, stats_pass);  // at the far plane: only where nothing opaque is
  if (!stats_pass) glEnable(GL_BLEND);
  if (ok) ok = draw_items(scene, view, blended, pass, true);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glDepthMask(GL_TRUE);
  glBindVertexArray(0);
  return ok;
}

GlesRenderer::GlesRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
GlesRenderer::~GlesRenderer() = default;

Result<std::unique_ptr<GlesRenderer>> GlesRenderer::create(const SceneModel& scene, const StreamShape& shape) {
  auto textures = StreamTextures::create(scene, shape);
  if (!textures) return std::unexpected(textures.error());
  auto state = std::make_unique<State>(std::move(*textures));
  State& s = *state;
  s.shape = shape;
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  s.largest = static_cast<std::uint32_t>(largest);
  const bool desktop = gles::is_desktop();
  s.linear = desktop || gles::has_extension("GL_EXT_color_buffer_float") ||
             gles::has_extension("GL_EXT_color_buffer_half_float");
  if (gles::has_extension(desktop ? "GL_ARB_clip_control" : "GL_EXT_clip_control")) {
    s.clip_control = reinterpret_cast<ClipControl>(eglGetProcAddress(desktop ? "glClipControl" : "glClipControlEXT"));
  }
  s.empty_array = gles::make_vertex_array();
  const struct {
    std::optional<gles::Program>& program;
    std::string vertex, fragment;
  } sources[] = {{s.depth, surface_vertex_source(), depth_fragment_source()},
                 {s.background, fullscreen_vertex_source(), background_fragment_source(s.linear, false)},
                 {s.background_stats, fullscreen_vertex_source(), background_fragment_source(s.linear, true)},
                 {s.resolve, fullscreen_vertex_source(), resolve_fragment_source(s.linear)}};
  for (const auto& source : sources) {
    auto program = gles::Program::link(source.vertex, source.fragment);
    if (!program) return std::unexpected(program.error());
    source.program.emplace(std::move(*program));
  }
  return std::unique_ptr<GlesRenderer>(new GlesRenderer(std::move(state)));
}

Result<void> GlesRenderer::synchronise(const SceneModel& scene, const StreamNews& news) {
  for (auto i = static_cast<std::uint32_t>(state_->chunks.size()); i < scene.chunks().size(); ++i)
    state_->add_chunk(scene, i);
  return state_->textures.upload(news);
}

Result<void> GlesRenderer::synchronise_view(const SceneModel& scene, const StreamShape& shape, const StreamNews& news) {
  return state_->textures.upload_view(news, scene, shape);
}

Result<void> GlesRenderer::draw(const SceneModel& scene, const View& view) {
  State& s = *state_;
  if (auto ok = s.make_targets(view.width, view.height); !ok) return ok;
  if (auto ok = s.draw_scene(scene, view, s.samples, false); !ok) return ok;
  s.picture.bind();
  glDisable(GL_DEPTH_TEST);
  s.resolve->use();
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, s.samples.texture());
  glUniform1i(s.resolve->at("u_samples"), 0);
  glBindVertexArray(s.empty_array.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindVertexArray(0);
  if (const GLenum code = glGetError(); code != GL_NO_ERROR)
    return fail(fmt::format("GL: drawing failed with {:#x}", code));
  return {};
}

void GlesRenderer::present(std::uint32_t framebuffer, std::uint32_t width, std::uint32_t height) {
  const gles::Target& picture = state_->picture;
  const auto w = static_cast<GLint>(picture.width()), h = static_cast<GLint>(picture.height());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, picture.framebuffer());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  const bool as_it_is = picture.width() == width && picture.height() == height;
  glBlitFramebuffer(0, 0, w, h, 0, 0, static_cast<GLint>(width), static_cast<GLint>(height), GL_COLOR_BUFFER_BIT,
                    as_it_is ? GL_NEAREST : GL_LINEAR);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
}

Result<Image8> GlesRenderer::read_picture() {
  const gles::Target& picture = state_->picture;
  const std::uint32_t width = picture.width(), height = picture.height();
  if (width == 0) return fail("picture: nothing is drawn yet");
  const auto rgba = read_pixels(picture);
  Image8 image{width, height, std::vector<std::uint8_t>(std::size_t{width} * height * 3)};
  for (std::uint32_t y = 0; y < height; ++y) {
    const std::uint8_t* from = rgba.data() + std::size_t{height - 1 - y} * width * 4;
    std::uint8_t* to = image.rgb.data() + std::size_t{y} * width * 3;
    for (std::uint32_t x = 0; x < width; ++x) std::memcpy(to + x * 3, from + x * 4, 3);
  }
  return image;
}

Result<ResidencyCounts> GlesRenderer::count_residency(const SceneModel& scene, const View& view,
                                                      std::uint32_t coarseness) {
  State& s = *state_;
  const auto side = [&](std::uint32_t pixels) {
    return coarseness == 0 ? pixels * kSamplesPerAxis : std::max(1u, pixels / coarseness);
  };
  const std::uint32_t width = side(view.width), height = side(view.height);
  if (width == 0 || height == 0 || width > s.largest || height > s.largest)
    return fail(fmt::format("view of {}x{} is too large to count", view.width, view.height));
  if (auto ok = s.fit(s.stats, GL_RGBA8, width, height, true); !ok) return std::unexpected(ok.error());
  if (auto ok = s.draw_scene(scene, view, s.stats, true); !ok) return std::unexpected(ok.error());
  const auto rgba = read_pixels(s.stats);
  std::array<std::uint64_t, 9> counts{};
  for (std::size_t i = 0; i < rgba.size(); i += 4) ++counts[static_cast<std::size_t>((rgba[i] * 8 + 127) / 255)];
  return ResidencyCounts{std::uint64_t{width} * height, counts[0], counts[1], counts[2], counts[3], counts[4]};
}

void GlesRenderer::finish() { glFinish(); }

std::string GlesRenderer::device() const {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name != nullptr ? name : "unknown";
}

}  // namespace darm::client
