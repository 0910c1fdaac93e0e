# Makes the imported target OpenVDB::openvdb, as OpenVDB's own find module does, when OpenVDB is here, and sets STRATA_OPENVDB_FOUND. Installed beside
# strataConfig.cmake. OpenVDB's own find module needs boost-iostreams' headers; linking it needs nothing of the kind.
find_path(OPENVDB_INCLUDE_DIR openvdb/openvdb.h)
find_library(OPENVDB_LIBRARY openvdb)
# OpenVDB's headers include this one of Boost; Debian's libopenvdb-dev does not bring it.
find_path(STRATA_OPENVDB_BOOST_DIR boost/numeric/conversion/conversion_traits.hpp)
mark_as_advanced(OPENVDB_INCLUDE_DIR OPENVDB_LIBRARY STRATA_OPENVDB_BOOST_DIR)
find_package(TBB QUIET)
find_package(Imath CONFIG QUIET)
set(STRATA_OPENVDB_FOUND OFF)
if(OPENVDB_INCLUDE_DIR AND OPENVDB_LIBRARY AND STRATA_OPENVDB_BOOST_DIR AND TBB_FOUND AND Imath_FOUND)
  set(STRATA_OPENVDB_FOUND ON)
  if(NOT TARGET OpenVDB::openvdb)
    add_library(OpenVDB::openvdb INTERFACE IMPORTED)
    target_include_directories(OpenVDB::openvdb SYSTEM INTERFACE "${OPENVDB_INCLUDE_DIR}" "${STRATA_OPENVDB_BOOST_DIR}")
    target_link_libraries(OpenVDB::openvdb INTERFACE "${OPENVDB_LIBRARY}" TBB::tbb Imath::Imath)
  endif()
endif()
