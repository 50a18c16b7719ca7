# kiln-make-sample writes baked scenes made in code; the validator test and the viewer's tests start from them.
add_library(kiln_sample_scene STATIC sample_scene.cpp random_baked.cpp)
kiln_flags(kiln_sample_scene)
target_link_libraries(kiln_sample_scene PUBLIC kiln_baked_scene kiln_prt)
add_executable(kiln-make-sample make_sample.cpp)
kiln_flags(kiln-make-sample)
target_link_libraries(kiln-make-sample PRIVATE kiln_sample_scene kiln_reduce)

kiln_test(baked_scene_test
  SOURCES round_trip_test.cpp baked_shape_test.cpp look_json_test.cpp look_test.cpp png_test.cpp damaged_glb_test.cpp components_glb_test.cpp glossy_glb_test.cpp grid_exr_test.cpp light_field_glb_test.cpp links_glb_test.cpp
  LINKS kiln_sample_scene nlohmann_json::nlohmann_json)
set_source_files_properties(png_test.cpp PROPERTIES INCLUDE_DIRECTORIES /usr/include/stb)

kiln_test(lightmap_file_test SOURCES lightmap_file_test.cpp points_glb_test.cpp
  LINKS kiln_sample_scene nlohmann_json::nlohmann_json)

# The Khronos validator over those samples. Skipped with its reason while tests/gltf/node_modules is missing.
add_test(NAME gltf_validator COMMAND ${PROJECT_SOURCE_DIR}/tests/gltf/check_samples.sh $<TARGET_FILE:kiln-make-sample>)
set_tests_properties(gltf_validator PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300)
