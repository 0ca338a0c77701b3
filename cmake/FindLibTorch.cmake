# LibTorch from a PyTorch wheel or from the LibTorch archive, as the imported target LibTorch::LibTorch.
#
# The wheel's own CMake package stops on a machine without a CUDA toolkit when the wheel was built with CUDA, so the
# target is made here. Searched, in this order: LIBTORCH_DIR (the folder `torch` of a wheel, or an unpacked
# LibTorch), CMAKE_PREFIX_PATH, and .deps/python, where scripts/setup puts the wheel.
file(GLOB _libtorch_wheels "${CMAKE_CURRENT_LIST_DIR}/../.deps/python/lib/python3*/site-packages/torch")
set(_libtorch_prefixes "")
foreach(_prefix IN LISTS CMAKE_PREFIX_PATH)
  file(GLOB _found "${_prefix}" "${_prefix}/torch" "${_prefix}/lib/python3*/site-packages/torch")
  list(APPEND _libtorch_prefixes ${_found})
endforeach()
find_path(LibTorch_ROOT include/torch/csrc/api/include/torch/torch.h
  HINTS "${LIBTORCH_DIR}" ${_libtorch_prefixes} ${_libtorch_wheels} NO_DEFAULT_PATH)
set(_libtorch_components c10 torch_cpu torch)
set(LibTorch_LIBRARIES "")
set(_libtorch_complete TRUE)
foreach(_component IN LISTS _libtorch_components)
  find_library(LibTorch_${_component}_LIBRARY ${_component} HINTS "${LibTorch_ROOT}/lib" NO_DEFAULT_PATH)
  if(LibTorch_${_component}_LIBRARY)
    list(APPEND LibTorch_LIBRARIES "${LibTorch_${_component}_LIBRARY}")
  else()
    set(_libtorch_complete FALSE)
  endif()
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LibTorch
  REQUIRED_VARS LibTorch_ROOT LibTorch_LIBRARIES _libtorch_complete
  REASON_FAILURE_MESSAGE "run scripts/setup, or name an existing one: -DLIBTORCH_DIR=.../site-packages/torch")
if(LibTorch_FOUND AND NOT TARGET LibTorch::LibTorch)
  set(_libtorch_link "${LibTorch_LIBRARIES}")
  # Nothing refers to the CUDA library by name: it registers itself when it is loaded.
  find_library(LibTorch_cuda_LIBRARY torch_cuda HINTS "${LibTorch_ROOT}/lib" NO_DEFAULT_PATH)
  if(LibTorch_cuda_LIBRARY)
    list(APPEND _libtorch_link "-Wl,--push-state,--no-as-needed" "${LibTorch_cuda_LIBRARY}" "-Wl,--pop-state")
  endif()
  # The OpenMP runtime is LibTorch's own: a second one would have threads of its own.
  file(GLOB _libtorch_openmp "${LibTorch_ROOT}/lib/libgomp*.so*" "${LibTorch_ROOT}/lib/libiomp5.so")
  if(NOT _libtorch_openmp)
    set(_libtorch_openmp -fopenmp)
  endif()
  list(APPEND _libtorch_link ${_libtorch_openmp})
  add_library(LibTorch::LibTorch INTERFACE IMPORTED)
  # The wheel brings headers of other libraries, fmt's among them: searched last, they do not hide the system's.
  set_target_properties(LibTorch::LibTorch PROPERTIES
    INTERFACE_COMPILE_OPTIONS
      "SHELL:-idirafter \"${LibTorch_ROOT}/include\";SHELL:-idirafter \"${LibTorch_ROOT}/include/torch/csrc/api/include\""
    INTERFACE_LINK_LIBRARIES "${_libtorch_link}"
    INTERFACE_LINK_OPTIONS "-Wl,-rpath,${LibTorch_ROOT}/lib")
endif()
