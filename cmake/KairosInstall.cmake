# Installs the program, the libraries with their headers, and the CMake package `kairos`.
#
# Each folder of src/ is an imported target kairos::<folder>. The folders listed here need much more than a compiler and
# TBB from whoever links them, so they are components of the package, asked for by name.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(KAIROS_COMPONENTS io lod)
set(KAIROS_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/kairos)

get_property(KAIROS_LIBRARIES GLOBAL PROPERTY KAIROS_LIBRARIES)
foreach(library IN LISTS KAIROS_LIBRARIES)
  get_target_property(folder ${library} EXPORT_NAME)
  get_target_property(directory ${library} SOURCE_DIR)
  set(targets kairosTargets)
  if(folder IN_LIST KAIROS_COMPONENTS)
    set(targets kairos-${folder}Targets)
  endif()
  list(APPEND KAIROS_EXPORTS ${targets})
  install(TARGETS ${library} EXPORT ${targets} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(DIRECTORY ${directory}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/kairos/${folder}
    FILES_MATCHING PATTERN "*.h" PATTERN "*-inl.h" EXCLUDE)
endforeach()

list(REMOVE_DUPLICATES KAIROS_EXPORTS)
foreach(targets IN LISTS KAIROS_EXPORTS)
  install(EXPORT ${targets} NAMESPACE kairos:: DESTINATION ${KAIROS_PACKAGE_DIR})
endforeach()
if(TARGET kairos_app)
  install(TARGETS kairos_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/kairosConfig.cmake.in ${PROJECT_BINARY_DIR}/kairosConfig.cmake
  INSTALL_DESTINATION ${KAIROS_PACKAGE_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/kairosConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/kairosConfig.cmake ${PROJECT_BINARY_DIR}/kairosConfigVersion.cmake
  ${CMAKE_CURRENT_LIST_DIR}/FindBlosc.cmake ${CMAKE_CURRENT_LIST_DIR}/FindEpoxy.cmake
  ${CMAKE_CURRENT_LIST_DIR}/Findlibdeflate.cmake
  DESTINATION ${KAIROS_PACKAGE_DIR})
