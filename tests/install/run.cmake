# What the scripts of this folder share. Their arguments: BUILD_DIR, SOURCE_DIR, PREFIX (the installed tree), WORK_DIR,
# COMPILER, LAUNCHER (a command with ccache, or nothing), SANITIZE, VERSION, OPENMESH.
cmake_minimum_required(VERSION 3.25)

# run(COMMAND...): ends the test if it fails; `output` is what it printed.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\nfailed (${result}):\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

# run_consumer(PROGRAM): it must say that Strata works.
function(run_consumer program)
  run("${program}")
  if(NOT output MATCHES "strata works")
    message(FATAL_ERROR "${program} did not say that strata works, but: ${output}")
  endif()
endfunction()

set(ENV{CMAKE_CXX_COMPILER_LAUNCHER} "${LAUNCHER}")  # a list, which an argument of run() would not stay
set(flags "-Wall -Wextra -Werror")  # what Strata's headers must not disturb
if(SANITIZE)
  string(APPEND flags " -fsanitize=${SANITIZE}")
endif()
set(configure -G Ninja "-DCMAKE_PREFIX_PATH=${PREFIX}" "-DCMAKE_CXX_COMPILER=${COMPILER}"
  "-DCMAKE_CXX_FLAGS=${flags}"
  -DCMAKE_NO_SYSTEM_FROM_IMPORTED=ON)  # or the compiler keeps quiet about our headers
set(consumer_dir "${SOURCE_DIR}/tests/install/consumer")
file(REMOVE_RECURSE "${WORK_DIR}")
file(MAKE_DIRECTORY "${WORK_DIR}")
