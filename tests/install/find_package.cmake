include("${CMAKE_CURRENT_LIST_DIR}/run.cmake")
run("${CMAKE_COMMAND}" -S "${consumer_dir}" -B "${WORK_DIR}" ${configure} "-DEXPECTED_VERSION=${VERSION}")
run("${CMAKE_COMMAND}" --build "${WORK_DIR}")
run_consumer("${WORK_DIR}/consumer")
run_consumer("${WORK_DIR}/consumer_of_core")

# Lists of depth alone refuse a payload, in words.
execute_process(COMMAND "${COMPILER}" -std=c++20 -fsyntax-only "-I${PREFIX}/include" "${consumer_dir}/payload_dropped.cpp"
  RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(result EQUAL 0 OR NOT output MATCHES "Record32 keeps depth alone and would drop the payload")
  message(FATAL_ERROR "payload_dropped.cpp: ${result}\n${output}")
endif()
