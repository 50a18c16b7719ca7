# kiln-make-sample writes a plausible baked scene; the validator test and the viewer's tests start from it.
add_library(kiln_sample_scene STATIC sample_scene.cpp)
kiln_flags(kiln_sample_scene)
target_link_libraries(kiln_sample_scene PUBLIC kiln_baked_scene)
add_executable(kiln-make-sample make_sample.cpp)
kiln_flags(kiln-make-sample)
target_link_libraries(kiln-make-sample PRIVATE kiln_sample_scene)

kiln_test(baked_scene_test
  SOURCES round_trip_test.cpp baked_shape_test.cpp look_json_test.cpp look_test.cpp png_test.cpp damaged_glb_test.cpp
          random_baked.cpp
  LINKS kiln_sample_scene)
set_source_files_properties(png_test.cpp PROPERTIES INCLUDE_DIRECTORIES /usr/include/stb)
