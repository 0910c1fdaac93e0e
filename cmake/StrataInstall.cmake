# The umbrella target strata::strata, the target `product` (all that is installed), and install(): headers, libraries,
# tools, the CMake package and strata.pc. It takes what strata_add_library and strata_add_tool have listed. Each tool is a
# component of its own, named as the tool; what a user of the libraries needs is the component `dev`.
get_property(strata_libraries GLOBAL PROPERTY STRATA_LIBRARIES)
get_property(strata_bridges GLOBAL PROPERTY STRATA_BRIDGES)
get_property(strata_tools GLOBAL PROPERTY STRATA_TOOLS)
if(TARGET strata AND NOT "strata" IN_LIST strata_tools)
  list(APPEND strata_tools strata)
endif()

add_library(strata_all INTERFACE)
add_library(strata::strata ALIAS strata_all)
set_target_properties(strata_all PROPERTIES EXPORT_NAME strata)
target_link_libraries(strata_all INTERFACE ${strata_libraries})
add_custom_target(product)
add_dependencies(product ${strata_libraries} ${strata_bridges} ${strata_tools})

if(NOT STRATA_INSTALL)
  return()
endif()
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(strata_package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/strata")
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME dev)

# Public headers are those that the libraries list as HEADERS, and these right in strata/. Headers of a library that is not
# built are not installed: one without its library, or without the package it includes, is a trap.
set(strata_umbrella_headers strata/csg.h strata/lists.h strata/transparency.h strata/voxels.h)
list(TRANSFORM strata_umbrella_headers PREPEND "${PROJECT_SOURCE_DIR}/")
target_sources(strata_all INTERFACE
  FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${strata_umbrella_headers})
install(TARGETS strata_all ${strata_libraries} EXPORT strata FILE_SET HEADERS DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
foreach(tool IN LISTS strata_tools)
  install(TARGETS ${tool} COMPONENT ${tool})
endforeach()
install(EXPORT strata NAMESPACE strata:: FILE strataTargets.cmake DESTINATION "${strata_package_dir}")

# --- the CMake package: whoever links the static libraries needs what they were built with -------------------------------
set(strata_find_dependencies "")  # lines of strataConfig.cmake
set(strata_pc_requires "")        # modules of strata.pc
set(strata_pc_libraries "")       # libraries that have no module
set(strata_components "")         # what find_package(strata COMPONENTS ...) takes: gl, mesh, ...
set(strata_component_needs "")    # for each, a line of strataConfig.cmake: all targets it links, directly or not
set(strata_links "")
foreach(library IN LISTS strata_libraries strata_bridges)  # foundations first
  get_target_property(component ${library} EXPORT_NAME)
  get_target_property(links ${library} LINK_LIBRARIES)
  set(needs_${component} "")
  foreach(link IN LISTS links)
    if(link MATCHES "^strata::(.*)$")
      list(APPEND needs_${component} ${needs_${CMAKE_MATCH_1}})
    else()
      list(APPEND needs_${component} ${link})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES needs_${component})
  list(APPEND strata_components ${component})
  if(library IN_LIST strata_bridges)
    list(REMOVE_ITEM needs_${component} OpenVDB::openvdb)  # StrataFindOpenVDB.cmake finds it
  endif()
  list(APPEND strata_links ${needs_${component}})
  list(JOIN needs_${component} " " needs)
  string(APPEND strata_component_needs "set(strata_${component}_needs ${needs})\n")
endforeach()
list(REMOVE_DUPLICATES strata_links)
list(JOIN strata_components " " strata_components)

# strata_depends(TARGET DEBIAN LINE MODULE LIBRARY): what a link to TARGET asks of a user of the libraries, first Debian's packages.
set(strata_dev_packages "")
macro(strata_depends target debian line module library)
  if("${target}" IN_LIST strata_links)
    list(REMOVE_ITEM strata_links "${target}")
    list(APPEND strata_dev_packages ${debian})
    string(APPEND strata_find_dependencies "if(\"${target}\" IN_LIST strata_needs)\n  ${line}\nendif()\n")
    string(APPEND strata_pc_requires " ${module}")
    string(APPEND strata_pc_libraries " ${library}")
  endif()
endmacro()
set(pc_modules "find_dependency(PkgConfig)\n  pkg_check_modules")
strata_depends(Threads::Threads libc6-dev "find_dependency(Threads)" "" "-pthread")
strata_depends(fmt::fmt libfmt-dev "find_dependency(fmt)" fmt "")
strata_depends(glm::glm libglm-dev "find_dependency(glm)" "" "")
strata_depends(tl::expected libexpected-dev "find_dependency(tl-expected CONFIG)" "" "")
strata_depends(TBB::tbb libtbb-dev "find_dependency(TBB)" tbb "")
strata_depends(ZLIB::ZLIB zlib1g-dev "find_dependency(ZLIB)" zlib "")
strata_depends(PNG::PNG libpng-dev "find_dependency(PNG)" libpng "")
strata_depends(PkgConfig::hwy libhwy-dev "${pc_modules}(hwy REQUIRED QUIET IMPORTED_TARGET libhwy)" libhwy "")
strata_depends(PkgConfig::libdeflate libdeflate-dev "${pc_modules}(libdeflate REQUIRED QUIET IMPORTED_TARGET libdeflate)" libdeflate "")
strata_depends(PkgConfig::isal libisal-dev "${pc_modules}(isal REQUIRED QUIET IMPORTED_TARGET libisal)" libisal "")
strata_depends(PkgConfig::polyclipping libpolyclipping-dev
  "${pc_modules}(polyclipping REQUIRED QUIET IMPORTED_TARGET polyclipping)" polyclipping "")
strata_depends(PkgConfig::qhull_r libqhull-dev "${pc_modules}(qhull_r REQUIRED QUIET IMPORTED_TARGET qhull_r)" qhull_r "")
strata_depends(PkgConfig::text "libfreetype-dev;libharfbuzz-dev;libfontconfig-dev" "${pc_modules}(text REQUIRED QUIET IMPORTED_TARGET freetype2 harfbuzz fontconfig)"
  "freetype2 harfbuzz fontconfig" "")
strata_depends(PkgConfig::jpeg libjpeg62-turbo-dev "${pc_modules}(jpeg REQUIRED QUIET IMPORTED_TARGET libjpeg)" libjpeg "")
strata_depends(PkgConfig::gif libgif-dev "${pc_modules}(gif REQUIRED QUIET IMPORTED_TARGET libgif)" libgif "")
strata_depends(PkgConfig::webp libwebp-dev "${pc_modules}(webp REQUIRED QUIET IMPORTED_TARGET libwebp libwebpmux)" "libwebp libwebpmux" "")
strata_depends(PkgConfig::libzip libzip-dev "${pc_modules}(libzip REQUIRED QUIET IMPORTED_TARGET libzip)" libzip "")
strata_depends(PkgConfig::epoxy libepoxy-dev "${pc_modules}(epoxy REQUIRED QUIET IMPORTED_TARGET epoxy)" epoxy "")
strata_depends(PkgConfig::blosc libblosc-dev "${pc_modules}(blosc REQUIRED QUIET IMPORTED_TARGET blosc)" blosc "")
strata_depends(PkgConfig::hdf5 libhdf5-dev "${pc_modules}(hdf5 REQUIRED QUIET IMPORTED_TARGET hdf5)" hdf5 "")
strata_depends(pugixml::pugixml libpugixml-dev "find_dependency(pugixml CONFIG)" pugixml "")
strata_depends(OpenEXR::OpenEXR libopenexr-dev "find_dependency(OpenEXR CONFIG)" OpenEXR "")
strata_depends(OpenMeshCore libopenmesh-dev "find_dependency(OpenMesh CONFIG)" "" "-lOpenMeshCore")  # Debian has no module of it
if(strata_links)
  message(FATAL_ERROR "cmake/StrataInstall.cmake does not know what a user needs for: ${strata_links}")
endif()
foreach(list strata_pc_requires strata_pc_libraries)
  string(REGEX REPLACE " +" " " ${list} "${${list}}")
  string(STRIP "${${list}}" ${list})
endforeach()
set(strata_find_bridges "")
if(strata_bridges)  # without OpenVDB there is no target strata::openvdb, and all else works
  install(TARGETS ${strata_bridges} EXPORT strata_bridges FILE_SET HEADERS DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  install(EXPORT strata_bridges NAMESPACE strata:: FILE strataBridges.cmake DESTINATION "${strata_package_dir}")
  string(APPEND strata_find_bridges "if(\"openvdb\" IN_LIST strata_wanted)\n"
    "  include(\"\${CMAKE_CURRENT_LIST_DIR}/StrataFindOpenVDB.cmake\")\n"
    "  set(strata_openvdb_FOUND \${STRATA_OPENVDB_FOUND})\n"
    "  if(STRATA_OPENVDB_FOUND)\n    include(\"\${CMAKE_CURRENT_LIST_DIR}/strataBridges.cmake\")\n  endif()\nendif()\n")
  install(FILES "${PROJECT_SOURCE_DIR}/cmake/StrataFindOpenVDB.cmake" DESTINATION "${strata_package_dir}")
endif()
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/strataConfig.cmake.in" "${PROJECT_BINARY_DIR}/strataConfig.cmake"
  INSTALL_DESTINATION "${strata_package_dir}" NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file("${PROJECT_BINARY_DIR}/strataConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/strataConfig.cmake" "${PROJECT_BINARY_DIR}/strataConfigVersion.cmake"
  DESTINATION "${strata_package_dir}")

# --- pkg-config ---------------------------------------------------------------------------------------------------------
# Libraries are listed in the order they were made, foundations first; a linker wants them last.
set(strata_pc_archives "")
foreach(library IN LISTS strata_libraries)
  string(PREPEND strata_pc_archives "-l${library} ")
endforeach()
# The prefix is found from where strata.pc lies, so that an installed tree may be moved.
cmake_path(SET strata_pc_dir "/${CMAKE_INSTALL_LIBDIR}/pkgconfig")
cmake_path(RELATIVE_PATH strata_pc_dir BASE_DIRECTORY "/" OUTPUT_VARIABLE strata_pc_up)
string(REGEX REPLACE "[^/]+" ".." strata_pc_up "${strata_pc_up}")
configure_file("${PROJECT_SOURCE_DIR}/cmake/strata.pc.in" "${PROJECT_BINARY_DIR}/strata.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/strata.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT license)
