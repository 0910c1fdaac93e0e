# The shapes of Strata's targets. All that a folder's CMakeLists.txt needs is here.

# Warnings, sanitizers, hardening and the arithmetic that results may depend on.
function(strata_set_flags target)
  # What is not a debug build goes to users: overflows of the stack and of known buffers end it, and no table of
  # functions can be written once main() has begun (SECURITY.md).
  if(NOT STRATA_SANITIZE)
    set(optimized "$<NOT:$<CONFIG:Debug>>")
    target_compile_options(${target} PRIVATE
      "$<${optimized}:-fstack-protector-strong>" "$<${optimized}:-U_FORTIFY_SOURCE>" "$<${optimized}:-D_FORTIFY_SOURCE=2>")
    target_link_options(${target} PRIVATE "$<${optimized}:LINKER:-z,relro,-z,now>")
  endif()
  # Depth must not depend on the compiler: no fused multiply-add that the source does not ask for.
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -ffp-contract=off)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # GCC bug 105651: `"text" + std::to_string(i)` is reported as an overlapping copy.
    target_compile_options(${target} PRIVATE -Wno-restrict)
  endif()
  if(STRATA_JOIN_SOURCES)
    # Names of one file may hide those of another, and anonymous namespaces are in no main file.
    target_compile_options(${target} PRIVATE -Wno-shadow)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
      # Functions that come from a precompiled header are not known to be the system's: GCC warns of strings in them.
      target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread)
    endif()
  endif()
  if(STRATA_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(STRATA_SANITIZE)
    target_compile_options(${target} PRIVATE
      -fsanitize=${STRATA_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    target_link_options(${target} PRIVATE -fsanitize=${STRATA_SANITIZE})
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # With AddressSanitizer GCC takes what std::regex moves from for uninitialized (GCC bug 105562).
      target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
    endif()
  endif()
  if(STRATA_BUILD_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
endfunction()

# strata_compile_alone(FILES...): sources that another of their folder would disturb when several are compiled as one
#   (STRATA_JOIN_SOURCES): Highway includes its files again for each target, and local names may be there twice.
function(strata_compile_alone)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# strata_share_tables(FILES...): sources whose inner loops call functions of Highway that look into tables. GCC copies the
#   local table of a function onto the stack, 1 KiB for each hn::Compress(), unless constants may share an address. Then
#   AddressSanitizer takes the table for a variable that is gone.
function(strata_share_tables)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT STRATA_SANITIZE)
    set_property(SOURCE ${ARGN} APPEND PROPERTY COMPILE_OPTIONS -fmerge-all-constants)
  endif()
endfunction()

# strata_optimize_sanitized(FILES...): sources that tests spend most of their time in. Builds with sanitizers optimize them,
#   also those that compile all else without, to compile quickly (the preset `sanitized`).
function(strata_optimize_sanitized)
  if(STRATA_SANITIZE)
    # Headers that were compiled without optimization do not fit.
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -O1 SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()

# strata_add_library(NAME [HEADERS...] SOURCES... [PUBLIC targets...] [PRIVATE targets...])
#   makes strata_NAME, alias strata::NAME. It is installed, and part of the umbrella strata::strata, unless it is INTERNAL.
#   A BRIDGE is installed but no part of the umbrella: who links it needs a library that others do not.
#   HEADERS are the public ones, by their names in strata/ROOM/; no others are installed. All headers are found from the
#   project's root. The libraries are static whatever BUILD_SHARED_LIBS says: there is no stable binary interface yet.
function(strata_add_library name)
  cmake_parse_arguments(arg "INTERNAL;BRIDGE" "" "HEADERS;SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(strata_${name} STATIC ${arg_SOURCES})
  add_library(strata::${name} ALIAS strata_${name})
  set_target_properties(strata_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(strata_${name} PUBLIC
    "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>" "$<INSTALL_INTERFACE:include>")
  if(arg_HEADERS)
    cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY "${PROJECT_SOURCE_DIR}" OUTPUT_VARIABLE room)
    list(TRANSFORM arg_HEADERS PREPEND "${PROJECT_SOURCE_DIR}/strata/${room}/")
    target_sources(strata_${name} PUBLIC
      FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${arg_HEADERS})
  endif()
  target_compile_features(strata_${name} PUBLIC cxx_std_20)
  target_link_libraries(strata_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  strata_set_flags(strata_${name})
  if(TARGET strata_headers)
    target_precompile_headers(strata_${name} REUSE_FROM strata_headers)
  endif()
  if(arg_BRIDGE)
    set_property(GLOBAL APPEND PROPERTY STRATA_BRIDGES strata_${name})
  elseif(NOT arg_INTERNAL)
    set_property(GLOBAL APPEND PROPERTY STRATA_LIBRARIES strata_${name})
  endif()
endfunction()

# strata_embed_glsl(TARGET FILES...): compiles shader text into the target, so that nothing is looked for at run time.
#   `raster/gl/cover.comp.glsl` becomes `extern const gl::GlslPiece raster_gl_cover_comp;` in namespace strata::glsl:
#   declare it where it is used (strata/gl/shader_program.h has the type). `name.glsl.h` becomes ..._name_h.
function(strata_embed_glsl target)
  foreach(file IN LISTS ARGN)
    cmake_path(ABSOLUTE_PATH file OUTPUT_VARIABLE input)
    cmake_path(RELATIVE_PATH input BASE_DIRECTORY "${PROJECT_SOURCE_DIR}" OUTPUT_VARIABLE path)
    string(REPLACE ".glsl" "" symbol "${path}")
    string(REGEX REPLACE "[^A-Za-z0-9]" "_" symbol "${symbol}")
    set(output "${CMAKE_CURRENT_BINARY_DIR}/glsl/${symbol}.cpp")
    add_custom_command(OUTPUT "${output}"
      COMMAND "${CMAKE_COMMAND}" "-DINPUT=${input}" "-DOUTPUT=${output}" "-DPATH=${path}" "-DSYMBOL=${symbol}"
              -P "${PROJECT_SOURCE_DIR}/cmake/StrataEmbedGlsl.cmake"
      DEPENDS "${input}" "${PROJECT_SOURCE_DIR}/cmake/StrataEmbedGlsl.cmake" VERBATIM)
    target_sources(${target} PRIVATE "${output}")
  endforeach()
endfunction()

# strata_add_tool(NAME SOURCES... [LIBRARIES targets...]): an executable for users, at bin/NAME, installed.
function(strata_add_tool name)
  cmake_parse_arguments(arg "" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES})
  target_compile_definitions(${name} PRIVATE STRATA_VERSION="${PROJECT_VERSION}")
  strata_set_flags(${name})
  set_property(GLOBAL APPEND PROPERTY STRATA_TOOLS ${name})
endfunction()

# strata_room_of_test(VARIABLE LABELS): the room that this folder of tests/ is about, such as csg/scene, and the labels of
#   its tests: csg, csg/scene; gl where the last folder is gl. The targets test_csg and test_csg_scene build them.
function(strata_room_of_test variable labels)
  cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY "${PROJECT_SOURCE_DIR}/tests" OUTPUT_VARIABLE room)
  set(all "")
  set(path "${room}")
  while(path)
    list(APPEND all "${path}")
    cmake_path(GET path PARENT_PATH path)
  endwhile()
  if(room MATCHES "/gl$")
    list(APPEND all gl)
  endif()
  set(${variable} "${room}" PARENT_SCOPE)
  set(${labels} "${all}" PARENT_SCOPE)
endfunction()

# strata_tests_of_room(TARGETS...): what must be built before the tests of this folder run.
function(strata_tests_of_room)
  strata_room_of_test(room labels)
  foreach(label IN LISTS labels)
    string(REPLACE "/" "_" target "test_${label}")
    if(NOT TARGET ${target})
      add_custom_target(${target})
    endif()
    add_dependencies(${target} ${ARGN})
  endforeach()
endfunction()

# strata_test_flags(NAME): the flags of a test. They compile in half the time with -O1, and what they test is compiled for
#   its library.
function(strata_test_flags name)
  strata_set_flags(${name})
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# strata_add_test(NAME [SANITIZED] SOURCES... [LIBRARIES targets...]): a Google Test executable, one ctest entry a case,
#   named `room.Suite.Case` and labelled with its room.
#   SANITIZED: it reads what may be hostile, and is one of those that `./dev sanitized` runs.
function(strata_add_test name)
  cmake_parse_arguments(arg "SANITIZED" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES} GTest::gtest GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE STRATA_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  strata_test_flags(${name})
  include(GoogleTest)
  strata_room_of_test(room labels)
  strata_tests_of_room(${name})
  if(arg_SANITIZED)
    list(APPEND labels sanitized)
    add_dependencies(sanitized_tests ${name})
  endif()
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${STRATA_JOIN_SOURCES})
  if(TARGET strata_test_headers)
    target_precompile_headers(${name} REUSE_FROM strata_test_headers)
  endif()
  string(REPLACE "/" "." prefix "${room}.")
  gtest_discover_tests(${name} TEST_PREFIX "${prefix}" DISCOVERY_TIMEOUT 120 PROPERTIES TIMEOUT 600)
  # gtest_discover_tests() takes no list as a property.
  file(CONFIGURE OUTPUT "${name}_labels.cmake" @ONLY
    CONTENT "set_tests_properties(\${@name@_TESTS} PROPERTIES LABELS \"@labels@\")\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${CMAKE_CURRENT_BINARY_DIR}/${name}_labels.cmake")
endfunction()

# strata_add_fuzz(NAME [SANITIZED] SOURCES... CORPUS folder [LIBRARIES targets...])
#   SOURCES define LLVMFuzzerTestOneInput. With STRATA_BUILD_FUZZ this is a libFuzzer executable, NAME; in a build with
#   tests it is one that replays the saved corpus, with a ctest entry of the same name. SANITIZED: as for strata_add_test.
function(strata_add_fuzz name)
  cmake_parse_arguments(arg "SANITIZED" "CORPUS" "SOURCES;LIBRARIES" ${ARGN})
  if(STRATA_BUILD_FUZZ)
    add_executable(${name} ${arg_SOURCES})
    target_link_options(${name} PRIVATE -fsanitize=fuzzer)
    set_property(GLOBAL APPEND PROPERTY STRATA_FUZZ_TARGETS "${name} ${arg_CORPUS}")
  else()
    add_executable(${name} ${arg_SOURCES} "${PROJECT_SOURCE_DIR}/tests/fuzz/replay_main.cpp")
    add_test(NAME fuzz.${name} COMMAND ${name} "${arg_CORPUS}")
    set(labels fuzz)
    if(arg_SANITIZED)
      list(APPEND labels sanitized)
      add_dependencies(sanitized_tests ${name})
    endif()
    set_tests_properties(fuzz.${name} PROPERTIES TIMEOUT 600 LABELS "${labels}")
    strata_tests_of_room(${name})
  endif()
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES})
  strata_test_flags(${name})
endfunction()
