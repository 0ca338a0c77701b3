# Dear ImGui with its GLFW and OpenGL 3 backends, as Debian packs it, as the imported target DearImGui::DearImGui.
find_path(DearImGui_INCLUDE_DIR imgui.h PATH_SUFFIXES imgui)
find_path(DearImGui_BACKENDS_DIR imgui_impl_opengl3.h PATH_SUFFIXES imgui/backends)
find_library(DearImGui_LIBRARY imgui)
find_library(DearImGui_STB_LIBRARY stb)
find_package(glfw3 3.3 QUIET)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(DearImGui
  REQUIRED_VARS DearImGui_LIBRARY DearImGui_STB_LIBRARY DearImGui_INCLUDE_DIR DearImGui_BACKENDS_DIR glfw3_FOUND
  REASON_FAILURE_MESSAGE "install libimgui-dev and libglfw3-dev")
if(DearImGui_FOUND AND NOT TARGET DearImGui::DearImGui)
  add_library(DearImGui::DearImGui UNKNOWN IMPORTED)
  set_target_properties(DearImGui::DearImGui PROPERTIES
    IMPORTED_LOCATION "${DearImGui_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${DearImGui_INCLUDE_DIR};${DearImGui_BACKENDS_DIR}"
    INTERFACE_LINK_LIBRARIES "${DearImGui_STB_LIBRARY};glfw;${CMAKE_DL_LIBS}")
endif()
