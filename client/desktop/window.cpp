#include "client/desktop/window.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>

namespace darm::client::desktop {
namespace {

std::string glfw_text() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown reason";
}

struct Attempt {
  int api, creation, major, minor;
};

constexpr Attempt kAttempts[] = {{GLFW_OPENGL_ES_API, GLFW_EGL_CONTEXT_API, 3, 0},
                                 {GLFW_OPENGL_ES_API, GLFW_NATIVE_CONTEXT_API, 3, 0},
                                 {GLFW_OPENGL_API, GLFW_NATIVE_CONTEXT_API, 3, 3}};

GLFWwindow* attempt(const Attempt& a, const WindowPlan& plan) {
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CLIENT_API, a.api);
  glfwWindowHint(GLFW_CONTEXT_CREATION_API, a.creation);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, a.major);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, a.minor);
  if (a.api == GLFW_OPENGL_API) {
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  }
  // The picture is drawn elsewhere and copied: the window needs neither depth nor samples.
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_STENCIL_BITS, 0);
  glfwWindowHint(GLFW_ALPHA_BITS, 0);
  return glfwCreateWindow(plan.width, plan.height, plan.title.c_str(), nullptr, nullptr);
}

}  // namespace

Result<std::unique_ptr<Window>> Window::open(const WindowPlan& plan) {
  if (glfwInit() != GLFW_TRUE)
    return fail("window: " + glfw_text() + "; without a display darm-probe draws to a file, xvfb-run makes one");
  std::unique_ptr<Window> window(new Window());
  std::string reason = "nothing was tried";
  for (const Attempt& a : kAttempts) {
    const bool desktop = a.api == GLFW_OPENGL_API;
    if (plan.gl != GlKind::kAuto && desktop != (plan.gl == GlKind::kDesktop)) continue;
    window->window_ = attempt(a, plan);
    window->desktop_gl_ = desktop;
    if (window->window_ != nullptr) break;
    reason = glfw_text();
  }
  if (window->window_ == nullptr) return fail("window: neither OpenGL ES 3.0 nor OpenGL 3.3: " + reason);
  glfwMakeContextCurrent(window->window_);
  glfwSwapInterval(plan.vsync ? 1 : 0);
  return window;
}

Window::~Window() {
  if (window_ != nullptr) glfwDestroyWindow(window_);
  glfwTerminate();
}

bool Window::closing() const { return glfwWindowShouldClose(window_) == GLFW_TRUE; }
void Window::close() { glfwSetWindowShouldClose(window_, GLFW_TRUE); }

PixelSize Window::pixels() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return {static_cast<std::uint32_t>(std::max(0, width)), static_cast<std::uint32_t>(std::max(0, height))};
}

void Window::wait(double milliseconds) {
  if (milliseconds > 0) {
    glfwWaitEventsTimeout(milliseconds / 1000);
  } else {
    glfwPollEvents();
  }
}

void Window::wake() { glfwPostEmptyEvent(); }
void Window::swap() { glfwSwapBuffers(window_); }
void Window::set_clipboard(const std::string& text) { glfwSetClipboardString(window_, text.c_str()); }

void Window::toggle_full_screen() {
  if (glfwGetWindowMonitor(window_) != nullptr) {
    glfwSetWindowMonitor(window_, nullptr, x_, y_, width_, height_, GLFW_DONT_CARE);
    return;
  }
  GLFWmonitor* monitor = glfwGetPrimaryMonitor();
  const GLFWvidmode* mode = monitor != nullptr ? glfwGetVideoMode(monitor) : nullptr;
  if (mode == nullptr) return;
  glfwGetWindowPos(window_, &x_, &y_);
  glfwGetWindowSize(window_, &width_, &height_);
  glfwSetWindowMonitor(window_, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

}  // namespace darm::client::desktop
