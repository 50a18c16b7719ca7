# kiln-make-sample writes a plausible baked scene; the validator test and the viewer's tests start from it.
add_executable(kiln-make-sample make_sample.cpp sample_scene.cpp)
kiln_flags(kiln-make-sample)
target_link_libraries(kiln-make-sample PRIVATE kiln_baked_scene)
