# The real server, so only where it is built. Its driver is that of tests/faults.
if(TARGET kiln_daemon_driver)
  add_executable(kiln_job_latency job_latency.cpp)
  kiln_flags(kiln_job_latency)
  target_link_libraries(kiln_job_latency PRIVATE kiln_daemon_driver kiln_base)
  add_dependencies(kiln_job_latency kilnd)
endif()
