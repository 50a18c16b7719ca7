kiln_test(light_field_bake_test SOURCES ${CMAKE_CURRENT_LIST_DIR}/lamp_highlights_test.cpp ${CMAKE_CURRENT_LIST_DIR}/lobe_fits_test.cpp ${CMAKE_CURRENT_LIST_DIR}/mirrored_sky_test.cpp ${CMAKE_CURRENT_LIST_DIR}/outgoing_test.cpp ${CMAKE_CURRENT_LIST_DIR}/visibility_fit_test.cpp
          LINKS kiln_light_field_bake kiln_prt_scenes kiln_import Eigen3::Eigen)
