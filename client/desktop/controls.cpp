#include "client/desktop/controls.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <utility>

namespace darm::client::desktop {
namespace {

std::optional<Sticks> sticks_of(int joystick) {
  GLFWgamepadstate state;
  if (glfwJoystickIsGamepad(joystick) != GLFW_TRUE || glfwGetGamepadState(joystick, &state) != GLFW_TRUE)
    return std::nullopt;
  Sticks s;
  s.left = {state.axes[GLFW_GAMEPAD_AXIS_LEFT_X], state.axes[GLFW_GAMEPAD_AXIS_LEFT_Y]};
  s.right = {state.axes[GLFW_GAMEPAD_AXIS_RIGHT_X], state.axes[GLFW_GAMEPAD_AXIS_RIGHT_Y]};
  // GLFW has triggers in [-1, 1], free at -1.
  s.left_trigger = (static_cast<double>(state.axes[GLFW_GAMEPAD_AXIS_LEFT_TRIGGER]) + 1) / 2;
  s.right_trigger = (static_cast<double>(state.axes[GLFW_GAMEPAD_AXIS_RIGHT_TRIGGER]) + 1) / 2;
  s.hurry = state.buttons[GLFW_GAMEPAD_BUTTON_LEFT_THUMB] == GLFW_PRESS ||
            state.buttons[GLFW_GAMEPAD_BUTTON_RIGHT_BUMPER] == GLFW_PRESS;
  return s;
}

std::optional<Action> action_of(int key, bool control) {
  if (control) return key == GLFW_KEY_Q ? std::optional(Action::kQuit) : std::nullopt;
  switch (key) {
    case GLFW_KEY_P:
      return Action::kPanel;
    case GLFW_KEY_O:
      return Action::kMode;
    case GLFW_KEY_HOME:
      return Action::kStart;
    case GLFW_KEY_H:
      return Action::kBare;
    case GLFW_KEY_L:
      return Action::kLink;
    case GLFW_KEY_F1:
      return Action::kHelp;
    case GLFW_KEY_ESCAPE:
      return Action::kCloseHelp;
    case GLFW_KEY_F11:
      return Action::kFullScreen;
    case GLFW_KEY_F12:
      return Action::kScreenshot;
    default:
      return std::nullopt;
  }
}

}  // namespace

Controls& Controls::of(GLFWwindow* window) { return *static_cast<Controls*>(glfwGetWindowUserPointer(window)); }

Controls::Controls(GLFWwindow* window, Rig& rig, PointUnder point_under)
    : window_(window), rig_(rig), point_under_(std::move(point_under)) {
  glfwSetWindowUserPointer(window, this);
  glfwSetKeyCallback(window,
                     [](GLFWwindow* w, int key, int, int action, int mods) { of(w).on_key(key, action, mods); });
  glfwSetCharCallback(window, [](GLFWwindow* w, unsigned code_point) { of(w).on_character(code_point); });
  glfwSetMouseButtonCallback(
      window, [](GLFWwindow* w, int button, int action, int mods) { of(w).on_button(button, action, mods); });
  glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) { of(w).on_move(x, y); });
  glfwSetScrollCallback(window, [](GLFWwindow* w, double, double steps) { of(w).on_scroll(steps); });
  glfwSetWindowRefreshCallback(window, [](GLFWwindow* w) { of(w).events_ = true; });
  glfwSetFramebufferSizeCallback(window, [](GLFWwindow* w, int, int) { of(w).events_ = true; });
  glfwSetWindowFocusCallback(window, [](GLFWwindow* w, int focused) {
    if (focused == GLFW_FALSE) of(w).dragging_ = false;
  });
}

Controls::~Controls() {
  glfwSetKeyCallback(window_, nullptr);
  glfwSetCharCallback(window_, nullptr);
  glfwSetMouseButtonCallback(window_, nullptr);
  glfwSetCursorPosCallback(window_, nullptr);
  glfwSetScrollCallback(window_, nullptr);
  glfwSetWindowRefreshCallback(window_, nullptr);
  glfwSetFramebufferSizeCallback(window_, nullptr);
  glfwSetWindowFocusCallback(window_, nullptr);
}

void Controls::on_key(int key, int action, int mods) {
  events_ = true;
  if (action != GLFW_PRESS || (mods & (GLFW_MOD_ALT | GLFW_MOD_SUPER)) != 0) return;
  if (const auto asked = action_of(key, (mods & GLFW_MOD_CONTROL) != 0)) actions_.push_back(*asked);
}

// By what it writes: its key is elsewhere on each keyboard.
void Controls::on_character(unsigned code_point) {
  if (code_point == '?') actions_.push_back(Action::kHelp);
}

void Controls::on_button(int button, int action, int mods) {
  events_ = true;
  if (action == GLFW_RELEASE) dragging_ = false;
  if (action != GLFW_PRESS || mouse_taken_) return;
  glfwGetCursorPos(window_, &x_, &y_);
  dragging_ = true;
  second_ = button != GLFW_MOUSE_BUTTON_LEFT || (mods & GLFW_MOD_SHIFT) != 0;
  rig_.stop();
  if (rig_.mode != Mode::kOrbit) return;
  int width = 1, height = 1;
  glfwGetWindowSize(window_, &width, &height);
  const double high = std::max(1, height);
  if (const auto point = point_under_((x_ - width / 2.0) / high, (height / 2.0 - y_) / high)) rig_.pivot = *point;
}

void Controls::on_move(double x, double y) {
  events_ = true;
  const double dx = x - std::exchange(x_, x), dy = y - std::exchange(y_, y);
  if (!dragging_) return;
  int width = 1, height = 1;
  glfwGetWindowSize(window_, &width, &height);
  drag(rig_, dx / std::max(1, height), dy / std::max(1, height), second_);
  moved_ = true;
}

void Controls::on_scroll(double steps) {
  events_ = true;
  if (mouse_taken_) return;
  roll(rig_, steps);
  moved_ = true;
}

bool Controls::down(int key) const { return glfwGetKey(window_, key) == GLFW_PRESS; }

HeldKeys Controls::held_keys() const {
  HeldKeys k;
  const int chords[] = {GLFW_KEY_LEFT_CONTROL, GLFW_KEY_RIGHT_CONTROL, GLFW_KEY_LEFT_ALT, GLFW_KEY_LEFT_SUPER};
  if (std::any_of(std::begin(chords), std::end(chords), [&](int key) { return down(key); })) return k;
  k.ahead = down(GLFW_KEY_W) || down(GLFW_KEY_UP);
  k.back = down(GLFW_KEY_S) || down(GLFW_KEY_DOWN);
  k.left = down(GLFW_KEY_A);
  k.right = down(GLFW_KEY_D);
  k.up = down(GLFW_KEY_E) || down(GLFW_KEY_PAGE_UP);
  k.down = down(GLFW_KEY_Q) || down(GLFW_KEY_PAGE_DOWN);
  k.turn_left = down(GLFW_KEY_LEFT);
  k.turn_right = down(GLFW_KEY_RIGHT);
  k.look_up = down(GLFW_KEY_R);
  k.look_down = down(GLFW_KEY_F);
  k.hurry = down(GLFW_KEY_LEFT_SHIFT) || down(GLFW_KEY_RIGHT_SHIFT);
  return k;
}

bool Controls::advance(double seconds, bool mouse_taken) {
  mouse_taken_ = mouse_taken;
  Steering steering;
  add(steering, held_keys());
  for (int joystick = GLFW_JOYSTICK_1; joystick <= GLFW_JOYSTICK_LAST; ++joystick) {
    if (const auto pad = sticks_of(joystick)) add(steering, *pad);
  }
  const bool steered = steer(rig_, steering, seconds);
  return std::exchange(moved_, false) || steered;
}

bool Controls::restless() const {
  if (rig_.moving()) return true;
  Steering steering;
  add(steering, held_keys());
  if (steering.any()) return true;
  for (int joystick = GLFW_JOYSTICK_1; joystick <= GLFW_JOYSTICK_LAST; ++joystick) {
    if (glfwJoystickIsGamepad(joystick) == GLFW_TRUE) return true;
  }
  return false;
}

std::vector<Action> Controls::take_actions() { return std::exchange(actions_, {}); }
bool Controls::take_events() { return std::exchange(events_, false); }

void Controls::toggle_mode() {
  rig_.mode = rig_.mode == Mode::kWalk ? Mode::kOrbit : Mode::kWalk;
  if (rig_.mode != Mode::kOrbit) return;
  if (const auto point = point_under_(0, 0)) rig_.pivot = *point;
}

}  // namespace darm::client::desktop
