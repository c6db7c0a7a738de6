# OpenVDB itself, for tests and fuzzing: it writes what simulations write and reads what Kairos writes. Debian's brings a
# find module instead of a package configuration, in a directory CMake does not search.
find_path(KAIROS_OPENVDB_MODULE_DIR FindOpenVDB.cmake
  PATHS ${CMAKE_PREFIX_PATH} /usr /usr/local
  PATH_SUFFIXES lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB lib/cmake/OpenVDB lib64/cmake/OpenVDB)
mark_as_advanced(KAIROS_OPENVDB_MODULE_DIR)
list(APPEND CMAKE_MODULE_PATH ${KAIROS_OPENVDB_MODULE_DIR})
find_package(OpenVDB REQUIRED COMPONENTS openvdb)
