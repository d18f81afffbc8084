// darmd render: the unbiased reference picture of one camera, in two halves, with its own error.
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "actors/renderer/exposure.hpp"
#include "actors/renderer/reference_renderer.hpp"
#include "daemon/commands.hpp"
#include "daemon/reference_file.hpp"
#include "daemon/scene_setup.hpp"

namespace darm {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kMostSamples = 1u << 20;

void warn(const std::string& what) { std::fprintf(stderr, "darmd render: warning: %s\n", what.c_str()); }

bool report_progress(const renderer::ReferenceProgress& progress) {
  std::fprintf(stderr, "\rdarmd render: %u of %u samples per pixel, own PSNR %.2f dB, %.0f s ", progress.spp,
               progress.target_spp, progress.own_psnr, progress.seconds);
  return true;
}

Result<void> write_pictures(const fs::path& out, const renderer::ReferencePicture& picture) {
  fs::path base = out;
  base.replace_extension();
  const auto beside = [&base](const char* suffix) { return fs::path(base.string() + suffix); };
  if (auto written = renderer::write_png(beside(".png"), picture.mean); !written) return written;
  if (auto written = renderer::write_pfm(beside(".pfm"), picture.mean); !written) return written;
  if (auto written = renderer::write_pfm(beside(".a.pfm"), picture.half_a); !written) return written;
  return renderer::write_pfm(beside(".b.pfm"), picture.half_b);
}

Result<nlohmann::json> render(const RenderCommand& command) {
  const unsigned threads = command.config.render.threads != 0 ? command.config.render.threads
                                                              : std::max(1u, std::thread::hardware_concurrency());
  auto scene = load_configured_scene(command.config);
  if (!scene) return std::unexpected(scene.error());
  auto camera = find_camera(command.config, **scene, command.camera);
  if (!camera) return std::unexpected(camera.error());
  auto rays = renderer::trace::RayScene::build(*scene, threads);
  if (!rays) return std::unexpected(rays.error());
  renderer::TransportOptions options;
  options.all_effects = command.all_effects;
  const renderer::LightTransport transport(*scene, *rays, options);

  renderer::ReferenceJob job;
  job.camera = *camera;
  job.viewport = {command.width, command.height};
  job.exposure = command.config.scene.exposure > 0 ? static_cast<float>(command.config.scene.exposure)
                                                   : renderer::scene_exposure(transport);
  job.effects = command.view_independent ? renderer::PictureEffects::kViewIndependent : renderer::PictureEffects::kFull;
  job.spp = command.spp != 0 ? command.spp : kMostSamples;
  if (command.until_psnr > 0) job.until_psnr = command.until_psnr;
  job.seed_a = 2 * command.seed;
  job.seed_b = 2 * command.seed + 1;
  job.threads = threads;
  std::error_code made;
  fs::create_directories(command.config.state.dir, made);
  job.state_file = reference_file(command.config.state.dir, transport, job);
  job.warn = warn;
  if (!command.json) job.progress = report_progress;
  auto picture = renderer::render_reference(transport, job);
  if (!command.json) std::fprintf(stderr, "\n");
  if (!picture) return std::unexpected(picture.error());
  if (auto written = write_pictures(command.out, *picture); !written) return std::unexpected(written.error());

  const double rate = picture->seconds > 0 ? static_cast<double>(picture->paths) / picture->seconds : 0.0;
  nlohmann::json report = {
      {"camera", command.camera},    {"width", command.width},
      {"height", command.height},    {"effects", command.view_independent ? "view-independent" : "full"},
      {"spp", picture->spp},         {"reference_psnr", picture->own_psnr},
      {"exposure", job.exposure},    {"paths", picture->paths},
      {"seconds", picture->seconds}, {"paths_per_second", rate},
      {"threads", threads},          {"integrator", renderer::to_string(transport.effects())},
      {"out", command.out.string()}};
  return report;
}

}  // namespace

int run(const RenderCommand& command) {
  const auto report = render(command);
  if (!report) {
    std::fprintf(stderr, "darmd render: %s\n", report.error().message.c_str());
    return 1;
  }
  fs::path json = command.out;
  json.replace_extension(".json");
  if (std::FILE* file = std::fopen(json.c_str(), "w")) {
    std::fprintf(file, "%s\n", report->dump(2).c_str());
    std::fclose(file);
  }
  if (command.json) {
    std::printf("%s\n", report->dump(2).c_str());
  } else {
    std::printf("%s: %u samples per pixel, own PSNR %.2f dB, %.2f M paths/s\n", command.out.c_str(),
                (*report)["spp"].get<unsigned>(), (*report)["reference_psnr"].get<double>(),
                (*report)["paths_per_second"].get<double>() * 1e-6);
  }
  return 0;
}

}  // namespace darm
