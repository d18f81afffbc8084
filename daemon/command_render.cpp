// darmd render: the unbiased reference picture of one camera, in two halves, with its own error.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "actors/renderer/exposure.hpp"
#include "actors/renderer/reference_renderer.hpp"
#include "daemon/commands.hpp"
#include "daemon/lifecycle/interruption.hpp"
#include "daemon/progress.hpp"
#include "daemon/reference_file.hpp"
#include "daemon/reference_words.hpp"
#include "daemon/scene_setup.hpp"
#include "daemon/world.hpp"
#include "daemon/writable.hpp"

namespace darm {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kMostSamples = 1u << 20;

// The files of a picture: PNG, PFM, its two halves, and the report.
struct PictureFiles {
  explicit PictureFiles(const fs::path& out) : base(fs::path(out).replace_extension()) {}
  [[nodiscard]] fs::path with(const char* suffix) const { return {base.string() + suffix}; }
  fs::path base;
};

constexpr std::array kSuffixes{".png", ".pfm", ".a.pfm", ".b.pfm", ".json"};

Result<void> check_places(const RenderCommand& command) {
  for (const char* suffix : kSuffixes)
    if (auto ok = check_writable_file(PictureFiles(command.out).with(suffix)); !ok) return ok;
  return {};
}

// The file of the sums, as a run finds it and leaves it.
class KeptSums {
 public:
  explicit KeptSums(fs::path file) : file_(std::move(file)), before_(written()) {}
  // What is said of a picture that was cut off: what is there, and how to go on.
  [[nodiscard]] std::string words(const renderer::ReferencePicture& picture) const {
    const std::string done =
        std::to_string(picture.spp) + " samples per pixel, own PSNR " + decibel_words(picture.own_psnr) + ", ";
    if (file_.empty() || written() == before_) return "interrupted; " + done + "could not be kept";
    return "interrupted; " + done + "are kept in " + file_.string() +
           "; the same command goes on from there, and with --spp " + std::to_string(picture.spp) +
           " it writes this picture";
  }

 private:
  [[nodiscard]] fs::file_time_type written() const {
    std::error_code none;
    const auto time = fs::last_write_time(file_, none);
    return none ? fs::file_time_type::min() : time;
  }
  fs::path file_;
  fs::file_time_type before_;
};

Result<void> write_pictures(const fs::path& out, const renderer::ReferencePicture& picture) {
  const PictureFiles files(out);
  if (auto written = renderer::write_png(files.with(".png"), picture.mean); !written) return written;
  if (auto written = renderer::write_pfm(files.with(".pfm"), picture.mean); !written) return written;
  if (auto written = renderer::write_pfm(files.with(".a.pfm"), picture.half_a); !written) return written;
  return renderer::write_pfm(files.with(".b.pfm"), picture.half_b);
}

renderer::ReferenceJob job_of(const RenderCommand& command, const renderer::LightTransport& transport,
                              const Camera& camera, unsigned threads) {
  renderer::ReferenceJob job;
  job.camera = camera;
  job.viewport = {command.width, command.height};
  job.exposure = command.config.scene.exposure > 0 ? static_cast<float>(command.config.scene.exposure)
                                                   : renderer::scene_exposure(transport);
  job.effects = command.view_independent ? renderer::PictureEffects::kViewIndependent : renderer::PictureEffects::kFull;
  job.spp = command.spp != 0 ? command.spp : kMostSamples;
  if (command.until_psnr > 0) job.until_psnr = command.until_psnr;
  job.seed_a = 2 * command.seed;
  job.seed_b = 2 * command.seed + 1;
  job.threads = threads;
  return job;
}

nlohmann::json report_of(const RenderCommand& command, const renderer::ReferencePicture& picture,
                         const renderer::ReferenceJob& job, const renderer::LightTransport& transport) {
  const double rate = picture.seconds > 0 ? static_cast<double>(picture.paths) / picture.seconds : 0.0;
  return {{"camera", command.camera},
          {"width", command.width},
          {"height", command.height},
          {"effects", command.view_independent ? "view-independent" : "full"},
          {"spp", picture.spp},
          {"reference_psnr", std::min(picture.own_psnr, kMostDecibels)},
          {"exposure", job.exposure},
          {"doubtful_cut", picture.doubtful_cut},
          {"paths", picture.paths},
          {"seconds", picture.seconds},
          {"paths_per_second", rate},
          {"threads", job.threads},
          {"integrator", renderer::to_string(transport.effects())},
          {"out", command.out.string()}};
}

constexpr double kMuchCut = 0.01;  // of the light

std::string cut_words(double share) {
  return fmt::format(
      "{:.0f} % of the light is cut at white where the two halves do not agree that it is white: rare bright samples. "
      "The "
      "picture may be too dark by as much, and its own PSNR does not show it; a larger --spp or a smaller --exposure "
      "leaves less",
      100 * share);
}

std::string reached_words(const renderer::ReferencePicture& picture, double wanted) {
  return "own PSNR " + decibel_words(picture.own_psnr) + " after " + std::to_string(picture.spp) +
         " samples per pixel, short of the " + decibel_words(wanted) + " asked for; a larger --spp goes on from there";
}

/// The report of the picture, or nothing: it was cut off, and that has been said.
Result<std::optional<nlohmann::json>> render(const RenderCommand& command, const lifecycle::Interruption& interruption,
                                             Progress& progress) {
  if (auto ok = check_places(command); !ok) return std::unexpected(ok.error());
  const auto state = make_writable_folder(command.config.state.dir);
  if (!state) progress.warn(state.error().message + "; until then a picture that is cut off is begun anew");
  const unsigned threads = thread_count(command.config);
  auto scene = load_configured_scene(command.config);
  if (!scene) return std::unexpected(scene.error());
  for (const auto& warning : (*scene)->warnings) progress.warn((*scene)->path + ": " + warning);
  auto camera = find_camera(command.config, **scene, command.camera);
  if (!camera) return std::unexpected(camera.error());
  auto rays = renderer::trace::RayScene::build(*scene, threads);
  if (!rays) return std::unexpected(rays.error());
  renderer::TransportOptions options;
  options.all_effects = command.all_effects;
  const renderer::LightTransport transport(*scene, *rays, options);

  auto job = job_of(command, transport, *camera, threads);
  if (state) job.state_file = reference_file(command.config.state.dir, transport, job);
  const KeptSums kept(job.state_file);
  job.warn = [&progress](const std::string& what) { progress.warn(what); };
  job.progress = [&](const renderer::ReferenceProgress& now) {
    progress.show(0, reference_words(now, kMostSamples));
    return !interruption.asked();
  };
  auto picture = renderer::render_reference(transport, job);
  if (!picture) return std::unexpected(picture.error());
  if (picture->stopped) {
    progress.announce(kept.words(*picture));
    return std::nullopt;
  }
  if (job.until_psnr && picture->own_psnr < *job.until_psnr) progress.warn(reached_words(*picture, *job.until_psnr));
  if (picture->doubtful_cut >= kMuchCut) progress.warn(cut_words(picture->doubtful_cut));
  if (auto written = write_pictures(command.out, *picture); !written) return std::unexpected(written.error());
  return report_of(command, *picture, job, transport);
}

}  // namespace

int run(const RenderCommand& command) {
  const lifecycle::Interruption interruption("darmd render");
  Progress progress("darmd render", command.json);
  const auto made = render(command, interruption, progress);
  if (!made) {
    std::fprintf(stderr, "darmd render: %s\n", made.error().message.c_str());
    return 1;
  }
  if (!*made) return lifecycle::kInterrupted;
  const auto& report = **made;
  const std::string text = report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  const auto file = PictureFiles(command.out).with(".json");
  if (!(std::ofstream(file) << text << '\n').flush()) {
    std::fprintf(stderr, "darmd render: %s: cannot be written\n", file.c_str());
    return 1;
  }
  if (command.json) {
    std::printf("%s\n", text.c_str());
  } else {
    std::printf("%s: %u samples per pixel, own PSNR %s, %.2f M paths/s\n", command.out.c_str(),
                report["spp"].get<unsigned>(), decibel_words(report["reference_psnr"].get<double>()).c_str(),
                report["paths_per_second"].get<double>() * 1e-6);
  }
  return 0;
}

}  // namespace darm
