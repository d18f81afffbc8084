// An OpenGL ES 3 context without a window: Mesa's surfaceless platform, else a 1x1 pbuffer on the default display.
#pragma once

#include <memory>
#include <string>

#include "client/core/result.hpp"

namespace darm::client {

/// Current on the thread that made it, until it is destroyed (on the same thread).
class EglContext {
 public:
  [[nodiscard]] static Result<std::unique_ptr<EglContext>> create();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

 private:
  EglContext() = default;
  [[nodiscard]] std::string open(void* display, bool surfaceless);  // empty: done
  void close();
  void* display_ = nullptr;
  void* surface_ = nullptr;
  void* context_ = nullptr;
};

}  // namespace darm::client
