# Run by CTest; see CMakeLists.txt for the variables.
cmake_policy(VERSION 3.22)

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILT} --config ${CONFIGURATION} --prefix ${WORK}/installed)
# The package must not depend on where it was installed first.
file(RENAME ${WORK}/installed ${WORK}/moved)

file(GLOB_RECURSE internal ${WORK}/moved/*-inl.h)
if(internal)
  message(FATAL_ERROR "internal headers were installed: ${internal}")
endif()

set(flags)
if(SANITIZE)
  set(flags -D CMAKE_CXX_FLAGS=-fsanitize=${SANITIZE})
endif()
run(${WORK}/moved/bin/kairos --version)
run(${CMAKE_COMMAND} -S ${CONSUMER} -B ${WORK}/build -G ${GENERATOR}
  -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=${CONFIGURATION} -D CMAKE_PREFIX_PATH=${WORK}/moved
  -D EXPECTED_VERSION=${VERSION} ${flags})
run(${CMAKE_COMMAND} --build ${WORK}/build --config ${CONFIGURATION})
run(${WORK}/build/in_memory)
run(${WORK}/build/with_files ${WORK}/build/image.exr)
