# CPack: a .deb for each tool, for the libraries and for the Python package, and an archive of the tools that may be unpacked
# anywhere. `./dev package` makes them in build/packages.
if(NOT PROJECT_IS_TOP_LEVEL OR NOT STRATA_INSTALL OR NOT STRATA_BUILD_TOOLS)
  return()
endif()

# Of the packager, as Debian's own tools have it.
set(strata_maintainer "Strata maintainers <strata@localhost>")
if(DEFINED ENV{DEBEMAIL})
  set(strata_maintainer "Strata maintainers <$ENV{DEBEMAIL}>")
  if(DEFINED ENV{DEBFULLNAME})
    set(strata_maintainer "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
  endif()
elseif(strata_commit)
  execute_process(COMMAND "${GIT_EXECUTABLE}" log -1 "--format=Strata maintainers <%ae>" WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
    OUTPUT_VARIABLE strata_maintainer OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()

set(CPACK_PACKAGE_NAME strata)
set(CPACK_PACKAGE_VENDOR "Strata")
set(CPACK_PACKAGE_CONTACT "${strata_maintainer}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # or it would be the first line of every description
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGE_FILE_NAME "strata-${PROJECT_VERSION}-${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR}")
set(CPACK_PACKAGE_DIRECTORY "${PROJECT_SOURCE_DIR}/build/packages")
set(CPACK_GENERATOR "DEB;TGZ")
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGING_INSTALL_PREFIX "/usr")
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_ARCHIVE_COMPONENT_INSTALL ON)
set(CPACK_PROJECT_CONFIG_FILE "${PROJECT_SOURCE_DIR}/cmake/StrataPackagesOfGenerator.cmake")

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# What Debian asks of each package: copyright, with those of the headers and archives of others that are compiled in, and
# the changes. They are part of packages alone.
set(strata_doc_folder "${PROJECT_BINARY_DIR}/packages")
set(strata_copyright "Strata ${PROJECT_VERSION}: solids as sorted per-pixel depth lists

Copyright 2026 the Strata authors

Strata is under the Apache License, Version 2.0; on Debian systems the text is in /usr/share/common-licenses/Apache-2.0.
")
function(strata_write_copyright name)
  set(text "${strata_copyright}")
  foreach(package IN LISTS ARGN)
    if(EXISTS "/usr/share/doc/${package}/copyright")
      file(READ "/usr/share/doc/${package}/copyright" theirs)
      string(APPEND text "\n\nParts of ${package} are compiled in. Their copyright file says:\n\n${theirs}")
    endif()
  endforeach()
  file(WRITE "${strata_doc_folder}/${name}/copyright" "${text}")
endfunction()

find_program(STRATA_GZIP gzip)
mark_as_advanced(STRATA_GZIP)
string(TIMESTAMP strata_date "%a, %d %b %Y %H:%M:%S +0000" UTC)
if(strata_commit)  # the same package from the same commit
  execute_process(COMMAND "${GIT_EXECUTABLE}" log -1 --format=%cD WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
    OUTPUT_VARIABLE strata_date OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
file(WRITE "${strata_doc_folder}/changelog.Debian" "strata (${PROJECT_VERSION}-1) bookworm; urgency=medium

  * Strata ${PROJECT_VERSION}; changelog.gz says what is new.

 -- ${strata_maintainer}  ${strata_date}
")

# strata_package(COMPONENT PACKAGE SECTION DESCRIPTION PARTS...): PARTS are the Debian packages whose code is compiled in.
set(CPACK_COMPONENTS_ALL "")
macro(strata_package component package section description)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${description}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_SHLIBDEPS ON)
  strata_write_copyright(${package} ${ARGN})
  install(FILES "${strata_doc_folder}/${package}/copyright" DESTINATION "share/doc/${package}" COMPONENT ${component} EXCLUDE_FROM_ALL)
  install(CODE "
    set(folder \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/share/doc/${package}\")
    file(MAKE_DIRECTORY \"\${folder}\")
    configure_file(\"${PROJECT_SOURCE_DIR}/CHANGELOG.md\" \"\${folder}/changelog\" COPYONLY)
    configure_file(\"${strata_doc_folder}/changelog.Debian\" \"\${folder}/changelog.Debian\" COPYONLY)
    file(GLOB pages \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/share/man/man1/*.1\")
    execute_process(COMMAND \"${STRATA_GZIP}\" -9nf \"\${folder}/changelog\" \"\${folder}/changelog.Debian\" \${pages}
      COMMAND_ERROR_IS_FATAL ANY)
  " COMPONENT ${component} EXCLUDE_FROM_ALL)
endmacro()

strata_package(strata strata graphics
"exact voxels, pictures, meshes and numbers of solids
Strata reads meshes (OBJ, STL, PLY, OFF, 3MF, AMF, glTF) and Boolean trees
of OpenSCAD (.csg). It writes voxels (OpenVDB, NumPy, NRRD, VTK, NIfTI, TIFF,
Zarr, MagicaVoxel and more), pictures and films, exact boundary meshes, depth
lists, and reports of volume, area, thickness and faults.
.
It sorts all crossings of each ray with the surfaces. A mesh with holes or
overlapping parts still gives a solid.
.
This package contains the command-line tool. The package strata-view
contains the window."
  libcli11-dev libexpected-dev libglm-dev nlohmann-json3-dev)
# dpkg-shlibdeps finds what is loaded at the start; what calls open is asked for here.
get_property(strata_opened GLOBAL PROPERTY STRATA_OPENED_LIBRARIES)
set(strata_opened_packages "")
foreach(library IN LISTS strata_opened)
  file(REAL_PATH "${library}" library)
  string(REGEX REPLACE "^/usr/lib/" "/lib/" other "${library}")  # dpkg knows a file by the path that its package gives
  execute_process(COMMAND dpkg-query --search "${library}" "${other}" OUTPUT_VARIABLE found ERROR_QUIET)
  if(found MATCHES "^([a-z0-9.+-]+)[:a-z0-9]*: ")
    list(APPEND strata_opened_packages "${CMAKE_MATCH_1}")
  endif()
endforeach()
list(REMOVE_DUPLICATES strata_opened_packages)
list(JOIN strata_opened_packages ", " CPACK_DEBIAN_STRATA_PACKAGE_DEPENDS)
set(CPACK_DEBIAN_STRATA_PACKAGE_RECOMMENDS "fonts-liberation, strata-view")
set(CPACK_DEBIAN_STRATA_PACKAGE_SUGGESTS "openscad, libegl1, libegl-mesa0, libopengl0")

if(TARGET strata-view)
  strata_package(strata-view strata-view graphics
"window for scenes, meshes and voxels
Strata View shows Boolean trees of OpenSCAD (.csg), meshes and voxel files.
One turns, cuts, picks and measures in it, and exports what is seen.
.
It draws with the processor or with OpenGL 4.5; the pictures are the same."
    libcli11-dev libexpected-dev libglm-dev libimgui-dev nlohmann-json3-dev)
  set(CPACK_DEBIAN_STRATA-VIEW_PACKAGE_RECOMMENDS "strata, fonts-liberation")
  set(CPACK_DEBIAN_STRATA-VIEW_PACKAGE_SUGGESTS "openscad")
endif()

if(TARGET strata-mpi)
  strata_package(strata-mpi strata-mpi science
"voxels of meshes, made by the ranks of an MPI job
Strata MPI makes the same files as strata voxelize, by many processes on one
machine or on several: the ranks take parts of the grid from a counter, and
each writes what it made.
.
It is started by mpirun or by a batch system."
    libcli11-dev libexpected-dev libglm-dev nlohmann-json3-dev)
  set(CPACK_DEBIAN_STRATA-MPI_PACKAGE_RECOMMENDS "openmpi-bin")
  set(CPACK_DEBIAN_STRATA-MPI_PACKAGE_SUGGESTS "strata")
endif()

strata_package(dev libstrata-dev libdevel
"C++ library of solids as sorted depth lists: headers and archives
The library voxelizes meshes, evaluates Boolean trees, draws and measures
them, makes their exact boundary meshes, and sorts depth lists of own
fragments. Its functions return results and neither throw nor print.
.
The libraries are static. CMake finds them by find_package(strata),
pkg-config by strata."
  libexpected-dev libglm-dev nlohmann-json3-dev)
list(JOIN strata_dev_packages ", " CPACK_DEBIAN_DEV_PACKAGE_DEPENDS)
string(APPEND CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ", pkgconf")
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
if(STRATA_HAVE_OPENVDB)
  set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "libopenvdb-dev, libboost-dev")
endif()

if(STRATA_HAVE_PYTHON)
  strata_package(python python3-strata python
"Python module of solids, voxels and depth lists
The module strata voxelizes meshes of files and arrays, combines solids by
Boolean operations, draws, measures and meshes them, and sorts depth lists.
Its arrays are those of NumPy and are not copied.
.
The distribution is called strata-toolkit."
    libexpected-dev libglm-dev nlohmann-json3-dev pybind11-dev)
  math(EXPR strata_next_python "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= 3.${Python_VERSION_MINOR}~), python3 (<< 3.${strata_next_python}), python3-numpy")
  foreach(script postinst prerm)
    if(script STREQUAL postinst)
      set(strata_python_action "if command -v py3compile >/dev/null; then\n  py3compile -p python3-strata\nfi")
    else()
      set(strata_python_action "if command -v py3clean >/dev/null; then\n  py3clean -p python3-strata\nfi")
    endif()
    file(CONFIGURE OUTPUT "${strata_doc_folder}/python3-strata/${script}" @ONLY CONTENT "#!/bin/sh\nset -e\n@strata_python_action@\n")
    list(APPEND CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${strata_doc_folder}/python3-strata/${script}")
  endforeach()
endif()

include(CPack)
