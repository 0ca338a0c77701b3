# libwebp, as the imported target LibWebp::LibWebp.
find_path(LibWebp_INCLUDE_DIR webp/decode.h)
find_library(LibWebp_LIBRARY webp)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LibWebp REQUIRED_VARS LibWebp_LIBRARY LibWebp_INCLUDE_DIR)
if(LibWebp_FOUND AND NOT TARGET LibWebp::LibWebp)
  add_library(LibWebp::LibWebp UNKNOWN IMPORTED)
  set_target_properties(LibWebp::LibWebp PROPERTIES
    IMPORTED_LOCATION "${LibWebp_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${LibWebp_INCLUDE_DIR}")
endif()
