# likeness_library(NAME SOURCES ... [DEPS ...]): the library of one folder, likeness_NAME.
# likeness_test(NAME SOURCES ... [DEPS ...] [LABELS ...] [TIMEOUT seconds]): a test program, one ctest entry a program.

add_library(likeness_flags INTERFACE)
target_compile_features(likeness_flags INTERFACE cxx_std_20)
target_compile_options(likeness_flags INTERFACE -Wall -Wextra -Werror -Wshadow -Wnon-virtual-dtor)
if(LIKENESS_SANITIZE)
  target_compile_options(likeness_flags INTERFACE -fsanitize=${LIKENESS_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(likeness_flags INTERFACE -fsanitize=${LIKENESS_SANITIZE})
endif()

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CCACHE_PROGRAM}")
endif()
find_program(MOLD_PROGRAM mold)
if(MOLD_PROGRAM)
  add_link_options(-fuse-ld=mold)
endif()

set_property(GLOBAL PROPERTY LIKENESS_LIBRARIES "")
# Builds the tests that run under the sanitizers: those with the label "sanitize".
add_custom_target(sanitized_tests)

function(likeness_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS;PRIVATE_DEPS" ${ARGN})
  add_library(likeness_${name} STATIC ${ARG_SOURCES})
  target_include_directories(likeness_${name} PUBLIC
    "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
  target_link_libraries(likeness_${name} PUBLIC ${ARG_DEPS}
    PRIVATE $<BUILD_INTERFACE:likeness_flags> ${ARG_PRIVATE_DEPS})
  target_compile_features(likeness_${name} PUBLIC cxx_std_20)
  set_target_properties(likeness_${name} PROPERTIES EXPORT_NAME ${name})
  add_library(Likeness::${name} ALIAS likeness_${name})
  set_property(GLOBAL APPEND PROPERTY LIKENESS_LIBRARIES likeness_${name})
endfunction()

function(likeness_test name)
  if(NOT LIKENESS_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;DEPS;LABELS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE likeness_flags ${ARG_DEPS} likeness_testing GTest::gmock GTest::gtest GTest::gtest_main)
  add_test(NAME ${name} COMMAND ${name} --gtest_brief=1)
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  if("sanitize" IN_LIST ARG_LABELS)
    add_dependencies(sanitized_tests ${name})
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "unit;${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT})
endfunction()
