// One camera of a study: its reference, and each variant measured against it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "actors/renderer/reference_renderer.hpp"
#include "daemon/accuracy/camera_frames.hpp"
#include "daemon/accuracy/picture_error.hpp"
#include "daemon/accuracy/recording.hpp"
#include "daemon/accuracy/software_view.hpp"
#include "daemon/accuracy/variants.hpp"
#include "daemon/world.hpp"

namespace darm::accuracy {

struct CameraStudyOptions {
  std::string name;
  Camera camera;
  Viewport viewport;
  unsigned threads = 1;
  double reference_psnr = 40;
  std::filesystem::path state_dir;  ///< keeps references
  std::filesystem::path out;        ///< for what is temporary
  std::function<bool()> stopped;
  std::function<void(double seconds, const std::string& words)> progress;  ///< of the variant under way
  std::function<void(const std::string&)> warn;
};

class CameraStudy {
 public:
  /// `world`: of the base density, without a store; must outlive it.
  CameraStudy(const World& world, CameraStudyOptions options);

  /// False: no pixel counts, so every error would be none.
  [[nodiscard]] bool sees_anything() const { return counted_share(view_.counted()) > 0; }

  /// Renders the reference, or takes the one that is kept. False: stopped.
  [[nodiscard]] Result<bool> prepare();
  [[nodiscard]] CameraFacts facts() const;

  /// What measuring came to: a measurement (without key); nothing, because it was stopped; or nothing, because this
  /// scene cannot have this variant, or not in this time, for the reason given.
  struct Outcome {
    std::optional<Measurement> measurement;
    std::string impossible;
  };
  /// prepare() comes first. Errors: see record_run(), render_reference().
  [[nodiscard]] Result<Outcome> measure(const Variant& variant);

 private:
  [[nodiscard]] renderer::ReferenceJob job() const;
  [[nodiscard]] Result<Outcome> measure_atlas(const Variant& variant);
  [[nodiscard]] Result<Outcome> measure_frames(const Variant& variant);
  [[nodiscard]] Result<Outcome> measure_codec(const Variant& variant);
  [[nodiscard]] Result<Outcome> measure_without(const Variant& variant);
  [[nodiscard]] Result<Recording> record_once(const World& world, const Variant& variant) const;
  [[nodiscard]] Result<Recording> record(const World& world, const Variant& variant) const;
  [[nodiscard]] Result<const TracedHalves*> traced_with(renderer::PictureEffects effects);
  [[nodiscard]] Measurement begin(const Variant& variant) const;

  const World& world_;
  CameraStudyOptions options_;
  SoftwareView view_;
  std::unique_ptr<const ShownHalves> reference_;
  double own_psnr_ = 0;
  std::optional<Recording> balanced_;      // what codec variants are made of
  std::optional<TracedHalves> with_full_;  // pictures with everything, by effects
  std::optional<TracedHalves> with_shared_;
};

}  // namespace darm::accuracy
