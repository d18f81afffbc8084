// The clients that really decode, and draw once a second, on a thread of their own: who measures must not wait for
// them.
#pragma once

#include <cstdint>
#include <memory>

#include "client/core/result.hpp"
#include "client/load/load_report.hpp"
#include "client/load/picture_sink.hpp"

namespace darm::client::load {

/// Waiting messages are bounded; what does not fit is skipped, and the decoder goes on at the next key frame.
class PictureWorker {
 public:
  /// `draws`: an OpenGL context without a window is needed. Error: there is none. Pictures are at most `draw_height`
  /// pixels high: software needs a second of processor for one of 1280x720.
  [[nodiscard]] static Result<std::unique_ptr<PictureWorker>> create(bool draws, std::uint32_t draw_height);
  ~PictureWorker();
  PictureWorker(const PictureWorker&) = delete;
  PictureWorker& operator=(const PictureWorker&) = delete;

  /// Of one client; lives as long as the worker.
  [[nodiscard]] PictureSink* add(bool draws);
  [[nodiscard]] PictureCounts counts() const;

 private:
  struct State;
  explicit PictureWorker(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace darm::client::load
