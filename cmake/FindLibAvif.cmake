# libavif, as the imported target LibAvif::LibAvif.
find_path(LibAvif_INCLUDE_DIR avif/avif.h)
find_library(LibAvif_LIBRARY avif)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LibAvif REQUIRED_VARS LibAvif_LIBRARY LibAvif_INCLUDE_DIR)
if(LibAvif_FOUND AND NOT TARGET LibAvif::LibAvif)
  add_library(LibAvif::LibAvif UNKNOWN IMPORTED)
  set_target_properties(LibAvif::LibAvif PROPERTIES
    IMPORTED_LOCATION "${LibAvif_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${LibAvif_INCLUDE_DIR}")
endif()
