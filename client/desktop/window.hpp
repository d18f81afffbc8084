// The window and its GL context. The only place, with controls and overlay, that sees GLFW.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "client/core/result.hpp"

struct GLFWwindow;

namespace darm::client::desktop {

enum class GlKind : std::uint8_t { kAuto, kEs, kDesktop };

struct WindowPlan {
  int width = 1280, height = 720;  ///< of the inside, screen coordinates
  std::string title = "DARM";
  GlKind gl = GlKind::kAuto;
  bool vsync = true;
};

struct PixelSize {
  std::uint32_t width = 0, height = 0;
  bool operator==(const PixelSize&) const = default;
};

/// One a process, on its main thread; its context is current there. OpenGL ES 3.0 through EGL, else as the window
/// system has it, else desktop OpenGL 3.3 core.
class Window {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Window>> open(const WindowPlan& plan);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  [[nodiscard]] GLFWwindow* handle() const { return window_; }
  [[nodiscard]] bool closing() const;
  void close();
  /// Of the device; 0x0 while it is iconified.
  [[nodiscard]] PixelSize pixels() const;
  [[nodiscard]] bool desktop_gl() const { return desktop_gl_; }
  /// Handles what happened, after at most `milliseconds`; 0 or less: at once.
  void wait(double milliseconds);
  /// Ends wait() from any thread.
  static void wake();
  void swap();
  void toggle_full_screen();
  void set_clipboard(const std::string& text);

 private:
  Window() = default;
  GLFWwindow* window_ = nullptr;
  bool desktop_gl_ = false;
  int x_ = 0, y_ = 0, width_ = 0, height_ = 0;  // before it filled the screen
};

}  // namespace darm::client::desktop
