# Installs the build. The other tests of this folder use what this one leaves.
include("${CMAKE_CURRENT_LIST_DIR}/run.cmake")
file(REMOVE_RECURSE "${PREFIX}")
run("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${WORK_DIR}/first")
# A tree that was moved after its installation must work as well.
file(RENAME "${WORK_DIR}/first" "${PREFIX}")
file(REMOVE_RECURSE "${WORK_DIR}")
