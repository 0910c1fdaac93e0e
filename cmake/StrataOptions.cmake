# Options of the build; each is off by itself when the package it needs is missing (StrataDependencies).
option(STRATA_BUILD_TOOLS "Build the tools, strata and strata-view; tests, benchmarks and fuzz targets need them" ${PROJECT_IS_TOP_LEVEL})
option(STRATA_BUILD_TESTS "Build the tests" ${PROJECT_IS_TOP_LEVEL})
option(STRATA_BUILD_BENCH "Build the benchmarks" OFF)
option(STRATA_BUILD_FUZZ "Build the fuzz targets (clang only)" OFF)
option(STRATA_INSTALL "Make install() rules" ${PROJECT_IS_TOP_LEVEL})
option(STRATA_WARNINGS_AS_ERRORS "Treat compiler warnings as errors" OFF)
option(STRATA_USE_TBB "Run parallel work on oneTBB; off: std::thread (for ThreadSanitizer)" ON)
option(STRATA_WITH_MPI "strata-mpi: strata voxelize by the ranks of an MPI job" ON)
option(STRATA_WITH_OPENVDB "A bridge to OpenVDB; comparisons in tests and benchmarks. .vdb files are written without it" ON)
option(STRATA_WITH_OPENEXR "Read and write deep .exr files" ON)
option(STRATA_WITH_OPENMESH "Build the OpenMesh bridge" ON)
option(STRATA_WITH_GL "Build the OpenGL part: libepoxy, EGL; the window: GLFW, Dear ImGui" ON)
option(STRATA_WITH_PYTHON "Build the Python package" ${STRATA_BUILD_TESTS})
option(STRATA_JOIN_SOURCES "Compile several sources of a target as one: a whole build in half the time" OFF)
option(STRATA_OPEN_ON_CALL "strata opens shared libraries when a job needs them (x86-64 Linux)" ON)
option(STRATA_EXACT_NO_FILTERS "Take every exact sign from integers; no result may change" OFF)
set(STRATA_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize=")

if(STRATA_BUILD_TESTS OR STRATA_BUILD_BENCH OR STRATA_BUILD_FUZZ)
  set(STRATA_BUILD_TOOLS ON)
endif()
if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)  # for clang-tidy and clangd
set(CMAKE_UNITY_BUILD ${STRATA_JOIN_SOURCES})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)  # a room is one unit, or two
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")

find_program(STRATA_CCACHE ccache)
mark_as_advanced(STRATA_CCACHE)
if(STRATA_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # Without these ccache keeps nothing that was compiled with precompiled headers (STRATA_JOIN_SOURCES).
  set(CMAKE_CXX_COMPILER_LAUNCHER
    "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros "${STRATA_CCACHE}")
endif()

# Compiling CGAL or OpenVDB takes up to 2 GB: targets with JOB_POOL_COMPILE heavy do it one at a time.
set_property(GLOBAL APPEND PROPERTY JOB_POOLS heavy=1)

# Sanitizers want to see libraries loaded; the code is written for one processor.
if(NOT CMAKE_SYSTEM_NAME STREQUAL "Linux" OR NOT CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64" OR STRATA_SANITIZE)
  set(STRATA_OPEN_ON_CALL OFF)
endif()
