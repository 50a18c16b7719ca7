# Our tree of balls against Embree's point queries.
if(TARGET kiln_reference_set)
  add_executable(kiln_point_queries point_queries.cpp)
  kiln_flags(kiln_point_queries)
  target_link_libraries(kiln_point_queries PRIVATE kiln_meshless kiln_reference_set embree)
  target_compile_definitions(kiln_point_queries PRIVATE KILN_SHARED="${PROJECT_SOURCE_DIR}/../shared")
endif()
