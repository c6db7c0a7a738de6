# Finds OpenImageIO's headers and library: the target OpenImageIO::OpenImageIO.
#
# OpenImageIO's own CMake package would do, but Debian's names programs and OpenCV folders which its development package
# does not bring: using it means installing a Qt viewer, and still fails for want of /usr/include/opencv4.
find_path(OpenImageIO_INCLUDE_DIR OpenImageIO/imageio.h)
find_library(OpenImageIO_LIBRARY OpenImageIO)
find_library(OpenImageIO_Util_LIBRARY OpenImageIO_Util)
find_package(Imath CONFIG QUIET)
if(OpenImageIO_INCLUDE_DIR AND EXISTS ${OpenImageIO_INCLUDE_DIR}/OpenImageIO/oiioversion.h)
  file(STRINGS ${OpenImageIO_INCLUDE_DIR}/OpenImageIO/oiioversion.h lines REGEX "#define OIIO_VERSION_(MAJOR|MINOR|PATCH) ")
  string(REGEX MATCHALL "[0-9]+" OpenImageIO_VERSION "${lines}")
  list(JOIN OpenImageIO_VERSION "." OpenImageIO_VERSION)
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenImageIO
  REQUIRED_VARS OpenImageIO_LIBRARY OpenImageIO_Util_LIBRARY OpenImageIO_INCLUDE_DIR Imath_FOUND
  VERSION_VAR OpenImageIO_VERSION)
mark_as_advanced(OpenImageIO_INCLUDE_DIR OpenImageIO_LIBRARY OpenImageIO_Util_LIBRARY)
if(OpenImageIO_FOUND AND NOT TARGET OpenImageIO::OpenImageIO)
  add_library(OpenImageIO::OpenImageIO UNKNOWN IMPORTED)
  set_target_properties(OpenImageIO::OpenImageIO PROPERTIES
    IMPORTED_LOCATION ${OpenImageIO_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${OpenImageIO_INCLUDE_DIR}
    INTERFACE_LINK_LIBRARIES "${OpenImageIO_Util_LIBRARY};Imath::Imath")
endif()
