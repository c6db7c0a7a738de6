# libepoxy, which finds OpenGL and EGL at run time: the target Epoxy::epoxy.
find_path(Epoxy_INCLUDE_DIR epoxy/egl.h)
find_library(Epoxy_LIBRARY epoxy)
mark_as_advanced(Epoxy_INCLUDE_DIR Epoxy_LIBRARY)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Epoxy REQUIRED_VARS Epoxy_LIBRARY Epoxy_INCLUDE_DIR)
if(Epoxy_FOUND AND NOT TARGET Epoxy::epoxy)
  add_library(Epoxy::epoxy UNKNOWN IMPORTED GLOBAL)
  set_target_properties(Epoxy::epoxy PROPERTIES
    IMPORTED_LOCATION ${Epoxy_LIBRARY} INTERFACE_INCLUDE_DIRECTORIES ${Epoxy_INCLUDE_DIR})
endif()
