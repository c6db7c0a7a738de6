# Warnings, floating-point rules and sanitizers shared by every target of the project.
add_library(kairos_options INTERFACE)
target_compile_options(kairos_options INTERFACE
  -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Woverloaded-virtual
  # Results must not depend on which multiplications the compiler happens to fuse; kernels ask for FMA by name.
  -ffp-contract=off
  # GCC 12 sees overlapping copies inside std::string operator+ that are not there (GCC bug 105651).
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
if(KAIROS_SANITIZE)
  target_compile_options(kairos_options INTERFACE -fsanitize=${KAIROS_SANITIZE} -fno-omit-frame-pointer
    -fno-sanitize-recover=all)
  target_link_options(kairos_options INTERFACE -fsanitize=${KAIROS_SANITIZE})
  target_compile_definitions(kairos_options INTERFACE KAIROS_AVX2_ALONE)
endif()
if(KAIROS_FUZZ)
  # OpenVDB is built without the information that the check of virtual tables needs.
  target_compile_options(kairos_options INTERFACE -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize=vptr
    -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(kairos_options INTERFACE -fsanitize=address,undefined -fno-sanitize=vptr)
endif()

# kairos_add_library(NAME SOURCES ... PUBLIC ... PRIVATE ...): one folder of src/, one static library.
function(kairos_add_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(kairos_${name} STATIC ${ARG_SOURCES})
  add_library(kairos::${name} ALIAS kairos_${name})
  set_target_properties(kairos_${name} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(kairos_${name} PUBLIC cxx_std_20)
  target_include_directories(kairos_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:include/kairos>)
  target_link_libraries(kairos_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:kairos_options>)
  set_property(GLOBAL APPEND PROPERTY KAIROS_LIBRARIES kairos_${name})
endfunction()

# kairos_add_test(NAME SOURCES ... LINK ...): one GoogleTest program, its cases registered one by one.
function(kairos_add_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${name} PRIVATE ${ARG_LINK} kairos_options GTest::gtest GTest::gmock GTest::gtest_main)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT ${ARG_TIMEOUT} LABELS "${ARG_LABELS}")
endfunction()
