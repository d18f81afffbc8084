#include "client/core/egl_context.hpp"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <cstring>

namespace darm::client {

std::string EglContext::open(void* display, bool surfaceless) {
  if (display == EGL_NO_DISPLAY) return "no display";
  if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return "display does not start";
  display_ = display;
  if (eglBindAPI(EGL_OPENGL_ES_API) != EGL_TRUE) return "no OpenGL ES";
  const EGLint wanted[] = {EGL_RENDERABLE_TYPE,
                           EGL_OPENGL_ES3_BIT,
                           EGL_SURFACE_TYPE,
                           surfaceless ? 0 : EGL_PBUFFER_BIT,
                           EGL_RED_SIZE,
                           8,
                           EGL_GREEN_SIZE,
                           8,
                           EGL_BLUE_SIZE,
                           8,
                           EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (eglChooseConfig(display, wanted, &config, 1, &count) != EGL_TRUE || count < 1)
    return "no OpenGL ES 3 configuration";
  const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0, EGL_NONE};
  context_ = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
  if (context_ == EGL_NO_CONTEXT) return "no OpenGL ES 3 context";
  if (!surfaceless) {
    const EGLint size[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
    surface_ = eglCreatePbufferSurface(display, config, size);
    if (surface_ == EGL_NO_SURFACE) return "no pbuffer";
  }
  if (eglMakeCurrent(display, surface_, surface_, context_) != EGL_TRUE) return "context cannot be made current";
  return {};
}

void EglContext::close() {
  if (display_ == nullptr) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  if (surface_ != nullptr) eglDestroySurface(display_, surface_);
  if (context_ != nullptr) eglDestroyContext(display_, context_);
  eglTerminate(display_);
  display_ = surface_ = context_ = nullptr;
}

Result<std::unique_ptr<EglContext>> EglContext::create() {
  std::unique_ptr<EglContext> context(new EglContext());
  std::string reason = "no surfaceless platform";
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (extensions != nullptr && std::strstr(extensions, "EGL_MESA_platform_surfaceless") != nullptr) {
    reason = context->open(eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr), true);
    if (reason.empty()) return context;
    context->close();
  }
  const std::string fallback = context->open(eglGetDisplay(EGL_DEFAULT_DISPLAY), false);
  if (fallback.empty()) return context;
  context->close();
  return fail("EGL: no headless context (surfaceless: " + reason + "; default display: " + fallback +
              "); install libegl1 and libgl1-mesa-dri");
}

EglContext::~EglContext() { close(); }

}  // namespace darm::client
