#include "client/desktop/overlay.hpp"

#include <GLES3/gl3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <array>

#include "client/desktop/panel_room.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

namespace darm::client::desktop {
namespace {

constexpr float kMargin = 10;
constexpr ImGuiWindowFlags kPlain = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                                    ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                                    ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

constexpr std::array<std::array<const char*, 2>, 16> kHelp = {{{"W A S D, arrows", "walk and turn"},
                                                               {"Q, E", "down, up"},
                                                               {"R, F", "look up, down"},
                                                               {"Shift", "hurry"},
                                                               {"Drag, wheel", "look, go ahead"},
                                                               {"Right drag", "ahead; orbit: across"},
                                                               {"Gamepad", "left walks, right looks"},
                                                               {"O", "walk or orbit"},
                                                               {"Home", "where the scene begins"},
                                                               {"P", "measurements"},
                                                               {"H", "nothing but the scene"},
                                                               {"L", "copy a link to this view"},
                                                               {"F12", "save a picture"},
                                                               {"F11", "full screen"},
                                                               {"F1 or ?", "these keys"},
                                                               {"Ctrl Q", "leave"}}};

// The window without its margins.
Extent room() {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  return {std::max(0.0f, size.x - 2 * kMargin), std::max(0.0f, size.y - 2 * kMargin)};
}

// A window whose corner (0, 0 the left top, 1, 1 the right bottom) lies there in the screen, `lower` by so much.
void place(float x, float y, float lower = 0) {
  ImGui::SetNextWindowPos({kMargin + x * room().width, kMargin + y * room().height + lower}, ImGuiCond_Always, {x, y});
}

// What a table of these takes, with the window around it.
template <class Lines>
Extent extent(const Lines& lines) {
  const ImGuiStyle& style = ImGui::GetStyle();
  float labels = 0, values = 0, height = 2 * style.WindowPadding.y;
  for (const auto& [label, value] : lines) {
    labels = std::max(labels, ImGui::CalcTextSize(&label[0]).x);
    values = std::max(values, ImGui::CalcTextSize(&value[0]).x);
    height += ImGui::GetTextLineHeight() + 2 * style.CellPadding.y;
  }
  return {labels + values + 4 * style.CellPadding.x + 2 * style.WindowPadding.x, height};
}

template <class Lines>
void table(const char* name, const Lines& lines) {
  if (!ImGui::BeginTable(name, 2)) return;
  for (const auto& [label, value] : lines) {
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(&label[0]);
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(&value[0]);
  }
  ImGui::EndTable();
}

// How much room they take.
Extent buttons(const OverlayShow& show, std::vector<Action>& clicked) {
  place(0, 0);
  ImGui::Begin("buttons", nullptr, kPlain | ImGuiWindowFlags_NoBackground);
  const auto button = [&](const char* label, Action action) {
    if (ImGui::Button(label)) clicked.push_back(action);
    ImGui::SameLine();
  };
  button(show.mode == Mode::kOrbit ? "Orbit" : "Walk", Action::kMode);
  button("Link", Action::kLink);
  button("Numbers", Action::kPanel);
  button("?", Action::kHelp);
  const ImVec2 size = ImGui::GetWindowSize();
  ImGui::End();
  return {size.x, size.y};
}

// In the left corner below the buttons.
Extent help(Extent bar) {
  const Extent all = room(), keys = extent(kHelp);
  const float scale = shrunk({all.width, all.height - bar.height - kMargin}, keys);
  place(0, 1);
  ImGui::SetNextWindowBgAlpha(0.7f);
  ImGui::Begin("help", nullptr, kPlain | ImGuiWindowFlags_NoInputs);
  ImGui::SetWindowFontScale(scale);
  const ImVec2 padding = ImGui::GetStyle().CellPadding;
  ImGui::PushStyleVar(ImGuiStyleVar_CellPadding, {padding.x, padding.y * scale});
  table("keys", kHelp);
  ImGui::PopStyleVar();
  ImGui::End();
  return {keys.width * scale, keys.height * scale};
}

// In the right corner, as far as the window has room. `sheet`: what the help has taken.
void panel(const OverlayShow& show, Extent bar, Extent sheet) {
  const Extent all = room(), whole = extent(show.lines), brief = extent(show.brief);
  const PanelForm form = panel_form(all, whole, brief);
  const Extent taken = form == PanelForm::kWhole ? whole : brief;
  if (form == PanelForm::kNone || !apart(all, taken, sheet, kMargin)) return;
  const bool beside = bar.width + kMargin + taken.width <= all.width;
  place(1, 0, beside ? 0 : bar.height);
  ImGui::SetNextWindowBgAlpha(0.7f);
  ImGui::Begin("panel", nullptr, kPlain);
  table("lines", form == PanelForm::kWhole ? show.lines : show.brief);
  ImGui::End();
}

// In as many lines as it takes, no wider than `width` and the window.
void wrapped(const std::string& text, float width) {
  ImGui::PushTextWrapPos(std::max(1.0f, std::min(width, room().width - ImGui::GetStyle().WindowPadding.x)));
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
}

void words(const Notice& notice) {
  if (!notice.quiet.empty()) {
    place(0.5f, 1);
    ImGui::SetNextWindowBgAlpha(0.7f);
    ImGui::Begin("notice", nullptr, kPlain | ImGuiWindowFlags_NoInputs);
    wrapped(notice.quiet, room().width);
    ImGui::End();
  }
  if (!notice.alert.empty()) {
    place(0.5f, 0.5f);
    ImGui::SetNextWindowBgAlpha(0.9f);
    ImGui::Begin("alert", nullptr, kPlain | ImGuiWindowFlags_NoInputs);
    wrapped(notice.alert, std::max(200.0f, room().width * 0.6f));
    ImGui::End();
  }
}

}  // namespace

Result<std::unique_ptr<Overlay>> Overlay::create(Window& window) {
  std::unique_ptr<Overlay> overlay(new Overlay());
  ImGui::CreateContext();
  ImGui::StyleColorsDark();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;
  float scale_x = 1, scale_y = 1;
  glfwGetWindowContentScale(window.handle(), &scale_x, &scale_y);
  const float scale = std::clamp(scale_x, 1.0f, 4.0f);
  ImFontConfig font;
  font.SizePixels = 13 * scale;
  io.Fonts->AddFontDefault(&font);
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = style.FrameRounding = 4;
  style.FrameBorderSize = 1;
  // As the page has it: read over any picture, a white one too.
  style.Colors[ImGuiCol_Button] = {0.07f, 0.075f, 0.09f, 0.88f};
  style.ScaleAllSizes(scale);
  overlay->glfw_ = ImGui_ImplGlfw_InitForOpenGL(window.handle(), true);
  overlay->gl_ =
      overlay->glfw_ && ImGui_ImplOpenGL3_Init(window.desktop_gl() ? "#version 330 core" : "#version 300 es");
  if (!overlay->gl_) return fail("overlay: OpenGL's library does not load; install libgl1");
  return overlay;
}

Overlay::~Overlay() {
  if (gl_) ImGui_ImplOpenGL3_Shutdown();
  if (glfw_) ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

bool Overlay::takes_mouse() const { return ImGui::GetIO().WantCaptureMouse; }

void Overlay::lay_out(const OverlayShow& show, std::vector<Action>& clicked) {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  if (!show.bare) {
    const Extent bar = buttons(show, clicked);
    const Extent sheet = show.help ? help(bar) : Extent{};
    if (show.panel) panel(show, bar, sheet);
  }
  words(show.bare ? Notice{"", show.notice.alert} : show.notice);
}

std::vector<Action> Overlay::draw(const OverlayShow& show) {
  std::vector<Action> clicked;
  // A box takes its size from what was in it the time before, and is hidden the first time: what is new would be cut,
  // or not seen at all, until something else is drawn.
  lay_out(show, clicked);
  ImGui::EndFrame();
  lay_out(show, clicked);
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  // The backend asks for state that OpenGL ES does not have.
  while (glGetError() != GL_NO_ERROR) {
  }
  return clicked;
}

}  // namespace darm::client::desktop
