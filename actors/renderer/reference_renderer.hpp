// Reference pictures: unbiased path tracing of one camera in two independent halves, resumable.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/picture_io.hpp"
#include "actors/types/camera.hpp"
#include "actors/types/error.hpp"

namespace darm::renderer {

enum class PictureEffects : std::uint8_t { kFull, kViewIndependent };

struct ReferenceProgress {
  std::uint32_t spp = 0;  ///< samples per pixel so far, both halves together
  std::uint32_t target_spp = 0;
  double own_psnr = 0;  ///< at the last look; infinite for a picture without noise
  double seconds = 0;   ///< spent rendering, earlier runs included
};

struct ReferenceJob {
  Camera camera;
  Viewport viewport;
  float exposure = 1;
  PictureEffects effects = PictureEffects::kFull;
  std::uint32_t spp = 64;            ///< samples per pixel, both halves together; rounded up to even
  std::optional<double> until_psnr;  ///< stop earlier, once the mean's own PSNR (dB) is this high
  std::uint64_t seed_a = 1;
  std::uint64_t seed_b = 2;
  unsigned threads = 1;
  std::filesystem::path state_file;  ///< empty: not resumable. Read at the start if it is there, written as below
  double save_seconds = 20;
  /// Told, once, that the state file was no use or cannot be written; the picture is made all the same.
  std::function<void(const std::string&)> warn;
  std::function<bool(const ReferenceProgress&)>
      progress;  ///< after every pass; false: save, stop, return what there is
};

/// All pictures are display-referred and linear: clamp(exposure * L) per quarter of a pixel, averaged (see below); a
/// half may be above 1 by its noise.
struct ReferencePicture {
  Picture mean, half_a, half_b;
  double own_psnr =
      0;  ///< dB of the mean, from the halves: MSE = mean((sRGB(a) - sRGB(b))^2) / 4, the curve going on above 1
  double doubtful_cut = 0;  ///< ReferenceState::doubtful_cut(): by so large a share it may be too dark
  std::uint64_t paths = 0;
  double seconds = 0;  ///< wall time over all runs
  std::uint32_t spp = 0;
  bool stopped = false;  ///< `progress` said so
};

/// Box filter over the pixel. Clamping one noisy path would darken the picture, so each pixel keeps its four quarters
/// apart: paths are averaged unclamped in a quarter, the quarter is clamped where the mean of both halves is white, the
/// quarters are averaged. What is left of the bias falls with the number of samples. Pixels of the same quarter and
/// half depend on (seed, pixel, pass) alone: bits are equal for any number of threads, and for a run that was stopped
/// and resumed. A state file of another picture, a damaged one and one that cannot be written are warnings
/// (ReferenceJob::warn): the first two are written over. Errors: an invalid camera, size or exposure.
[[nodiscard]] Result<ReferencePicture> render_reference(const LightTransport& transport, const ReferenceJob& job);

/// Names what the sums of a job depend on (scene, camera, size, exposure, effects, seeds), for the name of a state
/// file: jobs with the same hash are the same picture with more or fewer samples.
[[nodiscard]] std::uint64_t reference_hash(const LightTransport& transport, const ReferenceJob& job);

/// PSNR in dB of the mean of two independent halves (linear, display-referred, equal sizes), as in ReferencePicture.
[[nodiscard]] double psnr_of_mean(const Picture& half_a, const Picture& half_b);

}  // namespace darm::renderer
