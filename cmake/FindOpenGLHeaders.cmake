# The Khronos headers of OpenGL and EGL, without their libraries, as the imported target OpenGLHeaders::OpenGLHeaders.
find_path(OpenGLHeaders_GL_DIR GL/glcorearb.h)
find_path(OpenGLHeaders_EGL_DIR EGL/eglext.h)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenGLHeaders REQUIRED_VARS OpenGLHeaders_GL_DIR OpenGLHeaders_EGL_DIR)
if(OpenGLHeaders_FOUND AND NOT TARGET OpenGLHeaders::OpenGLHeaders)
  add_library(OpenGLHeaders::OpenGLHeaders INTERFACE IMPORTED)
  set_target_properties(OpenGLHeaders::OpenGLHeaders PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${OpenGLHeaders_GL_DIR};${OpenGLHeaders_EGL_DIR}")
endif()
