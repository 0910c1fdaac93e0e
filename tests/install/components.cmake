# Components ask for their own packages only, and those that are not there are named.
include("${CMAKE_CURRENT_LIST_DIR}/run.cmake")

# configure_with(COMPONENTS... [WITHOUT packages...]): sets `result` and `output`.
function(configure_with)
  cmake_parse_arguments(arg "" "" "WITHOUT" ${ARGN})
  list(JOIN arg_UNPARSED_ARGUMENTS " " components)
  file(WRITE "${WORK_DIR}/source/CMakeLists.txt"
    "cmake_minimum_required(VERSION 3.25)\nproject(asks LANGUAGES CXX)\nfind_package(strata CONFIG REQUIRED COMPONENTS ${components})\n")
  list(TRANSFORM arg_WITHOUT REPLACE "(.+)" "-DCMAKE_DISABLE_FIND_PACKAGE_\\1=ON" OUTPUT_VARIABLE without)
  file(REMOVE_RECURSE "${WORK_DIR}/build")
  execute_process(COMMAND "${CMAKE_COMMAND}" -S "${WORK_DIR}/source" -B "${WORK_DIR}/build" ${configure} ${without}
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  string(REGEX REPLACE "[ \n]+" " " output "${output}")
  set(result "${result}" PARENT_SCOPE)
  set(output "${output}" PARENT_SCOPE)
endfunction()

configure_with(hashbuffer voxelize WITHOUT PNG ZLIB OpenEXR pugixml OpenMesh)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "hashbuffer and voxelize need packages of other components:\n${output}")
endif()
configure_with(hashbuffer_formats WITHOUT PNG)
if(result EQUAL 0)
  message(FATAL_ERROR "hashbuffer_formats writes PNG and did not ask for it")
endif()
configure_with(core voxels)
if(result EQUAL 0 OR NOT output MATCHES "Strata has no component 'voxels'; it has: core, ")
  message(FATAL_ERROR "an unknown component is not named:\n${output}")
endif()
file(REMOVE_RECURSE "${WORK_DIR}")
