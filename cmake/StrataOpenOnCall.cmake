# strata_open_on_call(TARGET NAME LIBRARY CALLS regex [WEAK regex] [VALUES regex] [COPIED regex] [POINTERS regex])
#   lets the program TARGET start without the shared library LIBRARY, a path or an imported target: the first call of one
#   of its functions opens it (docs/decisions/62-libraries-opened-on-call.md). TARGET links the library as before, with
#   --as-needed. The linker finds that nothing of it is missing: for each function whose name matches CALLS, TARGET has one
#   that opens the library and jumps on. When the library has a function that TARGET calls and CALLS misses, the library is
#   loaded at the start, as without all this; a test of apps/strata notices.
#   WEAK: functions of templates that the library instantiates for its users.
#   VALUES: variables of the library that TARGET reads. The library takes those of TARGET for its own.
#   COPIED: tables of virtual functions, and types. They are copied when the library is opened.
#   POINTERS: variables that hold functions, as libepoxy has.
#   Does nothing where STRATA_OPEN_ON_CALL is off.
function(strata_open_on_call target name library)
  cmake_parse_arguments(arg "" "CALLS;WEAK;VALUES;COPIED;POINTERS" "" ${ARGN})
  if(NOT STRATA_OPEN_ON_CALL)
    return()
  endif()
  if(TARGET ${library})
    get_target_property(library ${library} LOCATION)
  endif()
  set_property(GLOBAL APPEND PROPERTY STRATA_OPENED_LIBRARIES "${library}")  # for packages
  set(output "${CMAKE_CURRENT_BINARY_DIR}/opened/${name}.cpp")
  set(script "${PROJECT_SOURCE_DIR}/cmake/StrataOpenOnCall.cmake")
  add_custom_command(OUTPUT "${output}"
    COMMAND "${CMAKE_COMMAND}" "-DLIBRARY=${library}" "-DOUTPUT=${output}" "-DCALLS=${arg_CALLS}" "-DVALUES=${arg_VALUES}"
            "-DPOINTERS=${arg_POINTERS}" "-DCOPIED=${arg_COPIED}" "-DWEAK=${arg_WEAK}" "-DNM=${CMAKE_NM}" "-DOBJDUMP=${CMAKE_OBJDUMP}" -P "${script}"
    DEPENDS "${script}" "${library}" VERBATIM)
  target_sources(${target} PRIVATE "${output}")
  set_source_files_properties("${output}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  # What is not called leaves the program; what says where functions are is read-only (relro).
  target_link_options(${target} PRIVATE LINKER:--gc-sections LINKER:-z,relro)
  if(arg_VALUES)
    target_link_options(${target} PRIVATE "LINKER:--export-dynamic-symbol-list=${output}.exported")
    set_property(TARGET ${target} APPEND PROPERTY LINK_DEPENDS "${output}.exported")
    set_property(SOURCE "${output}" APPEND PROPERTY OBJECT_OUTPUTS "${output}.exported")
  endif()
endfunction()

if(NOT CMAKE_SCRIPT_MODE_FILE)
  return()
endif()

# --- as a script: writes OUTPUT, a source whose macros are in apps/strata/opened_library.h ------------------------------
if(NOT LIBRARY MATCHES "\\.so[.0-9]*$")
  file(WRITE "${OUTPUT}" "// ${LIBRARY} is linked statically.\n")
  file(WRITE "${OUTPUT}.exported" "{ };\n")
  return()
endif()
execute_process(COMMAND "${OBJDUMP}" -p "${LIBRARY}" OUTPUT_VARIABLE headers COMMAND_ERROR_IS_FATAL ANY)
if(NOT headers MATCHES "SONAME +([^\n ]+)")
  message(FATAL_ERROR "${LIBRARY} has no SONAME")
endif()
set(soname "${CMAKE_MATCH_1}")
execute_process(COMMAND "${NM}" -D -S --defined-only "${LIBRARY}" OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" symbols "${symbols}")
set(text "// Written by cmake/StrataOpenOnCall.cmake from ${soname}.\n#include \"apps/strata/opened_library.h\"\n\n")
string(APPEND text "STRATA_OPENED_LIBRARY(\"${soname}\")\n")
set(exported "")
foreach(symbol IN LISTS symbols)
  # Functions that are written in assembly may have no size.
  if(NOT symbol MATCHES "^[0-9a-f]+ (([0-9a-f]+) )?([A-Za-z]) ([A-Za-z0-9_]+)(@.*)?$")
    continue()
  endif()
  set(size "${CMAKE_MATCH_2}")
  set(kind "${CMAKE_MATCH_3}")
  set(symbol "${CMAKE_MATCH_4}")
  if((kind STREQUAL "T" AND symbol MATCHES "${CALLS}") OR (WEAK AND kind STREQUAL "W" AND symbol MATCHES "${WEAK}"))
    string(APPEND text "STRATA_OPENED_CALL(\"${symbol}\")\n")
  elseif(COPIED AND symbol MATCHES "${COPIED}")
    string(APPEND text "STRATA_OPENED_COPY(\"${symbol}\", \"0x${size}\")\n")
  elseif(POINTERS AND kind MATCHES "[BDV]" AND symbol MATCHES "${POINTERS}")
    string(APPEND text "STRATA_OPENED_POINTER(\"${symbol}\")\n")
  elseif(VALUES AND kind MATCHES "[BD]" AND symbol MATCHES "${VALUES}")
    string(APPEND text "STRATA_OPENED_VALUE(\"${symbol}\", \"0x${size}\")\n")
    string(APPEND exported " ${symbol};")
  endif()
endforeach()
string(APPEND text "STRATA_OPENED_END()\n")
file(WRITE "${OUTPUT}" "${text}")
if(VALUES)
  file(WRITE "${OUTPUT}.exported" "{${exported} };\n")
endif()
