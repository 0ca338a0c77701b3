# The bitmap font of the stb headers (libstb-dev), included as <stb/stb_easy_font.h>.
find_path(StbEasyFont_INCLUDE_DIR stb/stb_easy_font.h)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(StbEasyFont
  REQUIRED_VARS StbEasyFont_INCLUDE_DIR REASON_FAILURE_MESSAGE "install libstb-dev")
