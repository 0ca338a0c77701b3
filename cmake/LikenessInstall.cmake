# cmake --install: the program, the libraries with their headers, and find_package(Likeness).
include(CMakePackageConfigHelpers)
get_property(_libraries GLOBAL PROPERTY LIKENESS_LIBRARIES)
install(TARGETS ${_libraries} EXPORT LikenessTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
# The run-time library for C and other languages, found by pkg-config too, wherever the installed files are moved.
install(TARGETS likeness_runtime LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES src/likeness/decode/likeness.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES examples/decode.c DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples)
file(RELATIVE_PATH LIKENESS_PREFIX_FROM_PC "/prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig" /prefix)
configure_file(cmake/likeness.pc.in "${CMAKE_CURRENT_BINARY_DIR}/likeness.pc" @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/likeness.pc" DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
install(TARGETS likeness_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY src/likeness DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
set(_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/Likeness")
install(EXPORT LikenessTargets NAMESPACE Likeness:: DESTINATION ${_package_dir})
install(FILES cmake/FindLibTorch.cmake cmake/FindLibAvif.cmake cmake/FindLibDeflate.cmake cmake/FindLibZip.cmake
  cmake/FindLibWebp.cmake cmake/FindOpenGLHeaders.cmake cmake/FindTurboJpeg.cmake DESTINATION ${_package_dir})
configure_package_config_file(cmake/LikenessConfig.cmake.in "${CMAKE_CURRENT_BINARY_DIR}/LikenessConfig.cmake"
  INSTALL_DESTINATION ${_package_dir})
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/LikenessConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/LikenessConfig.cmake"
  "${CMAKE_CURRENT_BINARY_DIR}/LikenessConfigVersion.cmake" DESTINATION ${_package_dir})
