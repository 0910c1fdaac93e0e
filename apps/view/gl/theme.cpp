#include "apps/view/gl/theme.h"

#include <imgui.h>

#include <memory>
#include <string>

#ifdef STRATA_HAVE_TEXT
#include <fontconfig/fontconfig.h>
#endif

namespace strata::view {
namespace {

/// The file of the system's plain font; empty when it cannot be told.
std::string plain_font() {
  std::string file;
#ifdef STRATA_HAVE_TEXT
  using Pattern = std::unique_ptr<FcPattern, decltype(&FcPatternDestroy)>;
  const std::unique_ptr<FcConfig, decltype(&FcConfigDestroy)> config(FcInitLoadConfigAndFonts(),
                                                                     FcConfigDestroy);
  const Pattern wanted(FcNameParse(reinterpret_cast<const FcChar8*>("sans-serif")),
                       FcPatternDestroy);
  if (!config || !wanted) return file;
  FcConfigSubstitute(config.get(), wanted.get(), FcMatchPattern);
  FcDefaultSubstitute(wanted.get());
  FcResult result = FcResultNoMatch;
  const Pattern found(FcFontMatch(config.get(), wanted.get(), &result), FcPatternDestroy);
  FcChar8* name = nullptr;
  if (found && FcPatternGetString(found.get(), FC_FILE, 0, &name) == FcResultMatch) {
    file = reinterpret_cast<const char*>(name);
  }
  // What the atlas reads.
  if (!file.ends_with(".ttf") && !file.ends_with(".otf") && !file.ends_with(".ttc")) file.clear();
#endif
  return file;
}

}  // namespace

void load_font(float scale) {
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // nothing is left behind in the user's folder
  io.LogFilename = nullptr;
  const std::string font = plain_font();
  constexpr float kFontPixels = 14.0f;
  // Names of solids and files may hold any letter of these scripts.
  static const ImWchar kLetters[] = {0x0020, 0x024f, 0x0370, 0x052f, 0x2010, 0x205f, 0};
  if (font.empty() || io.Fonts->AddFontFromFileTTF(font.c_str(), kFontPixels * scale, nullptr,
                                                   kLetters) == nullptr) {
    ImFontConfig config;
    config.SizePixels = 13.0f * scale;
    io.Fonts->AddFontDefault(&config);
  }
}

namespace {

void dark_colours(ImVec4* colours) {
  ImGui::StyleColorsDark();
  colours[ImGuiCol_Text] = {0.92f, 0.93f, 0.94f, 1};
  colours[ImGuiCol_TextDisabled] = {0.66f, 0.69f, 0.73f, 1};
  colours[ImGuiCol_WindowBg] = {0.135f, 0.145f, 0.16f, 1};
  colours[ImGuiCol_ChildBg] = {0.11f, 0.12f, 0.13f, 1};
  colours[ImGuiCol_PopupBg] = {0.16f, 0.17f, 0.19f, 0.98f};
  colours[ImGuiCol_FrameBg] = {0.21f, 0.23f, 0.26f, 1};
  colours[ImGuiCol_FrameBgHovered] = {0.27f, 0.3f, 0.34f, 1};
  colours[ImGuiCol_FrameBgActive] = {0.3f, 0.34f, 0.39f, 1};
  colours[ImGuiCol_Button] = {0.235f, 0.26f, 0.295f, 1};
  colours[ImGuiCol_ButtonHovered] = {0.31f, 0.36f, 0.42f, 1};
  colours[ImGuiCol_ButtonActive] = {0.16f, 0.44f, 0.72f, 1};
  colours[ImGuiCol_Header] = {0.19f, 0.21f, 0.24f, 1};
  colours[ImGuiCol_HeaderHovered] = {0.25f, 0.29f, 0.34f, 1};
  colours[ImGuiCol_HeaderActive] = {0.16f, 0.44f, 0.72f, 1};
  colours[ImGuiCol_SliderGrab] = {0.3f, 0.58f, 0.86f, 1};
  colours[ImGuiCol_SliderGrabActive] = {0.4f, 0.68f, 0.96f, 1};
  colours[ImGuiCol_CheckMark] = {0.4f, 0.72f, 1.0f, 1};
  colours[ImGuiCol_PlotHistogram] = {0.2f, 0.5f, 0.8f, 1};
  colours[ImGuiCol_TitleBg] = {0.16f, 0.18f, 0.2f, 1};
  colours[ImGuiCol_TitleBgActive] = {0.2f, 0.24f, 0.29f, 1};
  colours[ImGuiCol_Tab] = colours[ImGuiCol_Header];
  colours[ImGuiCol_TabHovered] = colours[ImGuiCol_ButtonHovered];
  colours[ImGuiCol_TabActive] = {0.16f, 0.38f, 0.6f, 1};
}

void light_colours(ImVec4* colours) {
  ImGui::StyleColorsLight();
  colours[ImGuiCol_Text] = {0.1f, 0.11f, 0.13f, 1};
  colours[ImGuiCol_TextDisabled] = {0.33f, 0.36f, 0.4f, 1};
  colours[ImGuiCol_WindowBg] = {0.945f, 0.95f, 0.955f, 1};
  colours[ImGuiCol_ChildBg] = {0.985f, 0.985f, 0.99f, 1};
  colours[ImGuiCol_PopupBg] = {0.985f, 0.985f, 0.99f, 0.99f};
  colours[ImGuiCol_TitleBg] = {0.87f, 0.885f, 0.9f, 1};
  colours[ImGuiCol_TitleBgActive] = {0.82f, 0.85f, 0.885f, 1};
  colours[ImGuiCol_FrameBg] = {1.0f, 1.0f, 1.0f, 1};
  colours[ImGuiCol_FrameBgHovered] = {0.9f, 0.94f, 0.985f, 1};
  colours[ImGuiCol_FrameBgActive] = {0.84f, 0.9f, 0.97f, 1};
  colours[ImGuiCol_Button] = {0.845f, 0.865f, 0.89f, 1};
  colours[ImGuiCol_ButtonHovered] = {0.755f, 0.815f, 0.885f, 1};
  colours[ImGuiCol_ButtonActive] = {0.52f, 0.72f, 0.93f, 1};
  colours[ImGuiCol_Header] = {0.875f, 0.89f, 0.91f, 1};
  colours[ImGuiCol_HeaderHovered] = {0.79f, 0.845f, 0.905f, 1};
  colours[ImGuiCol_HeaderActive] = {0.52f, 0.72f, 0.93f, 1};
  colours[ImGuiCol_SliderGrab] = {0.3f, 0.55f, 0.82f, 1};
  colours[ImGuiCol_SliderGrabActive] = {0.2f, 0.45f, 0.75f, 1};
  colours[ImGuiCol_CheckMark] = {0.1f, 0.4f, 0.75f, 1};
  colours[ImGuiCol_PlotHistogram] = {0.25f, 0.55f, 0.85f, 1};
  colours[ImGuiCol_Tab] = colours[ImGuiCol_Button];
  colours[ImGuiCol_TabHovered] = colours[ImGuiCol_ButtonHovered];
  colours[ImGuiCol_TabActive] = colours[ImGuiCol_ChildBg];
}

}  // namespace

void apply_theme(float scale, bool light) {
  ImGuiStyle& style = ImGui::GetStyle();
  style = ImGuiStyle();
  style.WindowRounding = 0;
  style.FrameRounding = 3;
  style.GrabRounding = 3;
  style.WindowBorderSize = 0;
  style.FrameBorderSize = light ? 1 : 0;
  style.ItemSpacing = {6, 5};
  style.FramePadding = {6, 3};
  style.WindowPadding = {8, 8};
  style.GrabMinSize = 12;
  style.ScaleAllSizes(scale);
  if (light) {
    light_colours(style.Colors);
  } else {
    dark_colours(style.Colors);
  }
}

}  // namespace strata::view
