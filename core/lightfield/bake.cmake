# Baking light fields needs rays; what is done with them after that (kiln_lightfield) does not.
kiln_library(kiln_light_field_bake SOURCES ${CMAKE_CURRENT_LIST_DIR}/lobe_fits.cpp ${CMAKE_CURRENT_LIST_DIR}/outgoing.cpp ${CMAKE_CURRENT_LIST_DIR}/visibility_fit.cpp
             LINKS kiln_lightfield kiln_meshless kiln_prt kiln_trace kiln_scene kiln_sphere kiln_mesh kiln_base
             PRIVATE_LINKS Eigen3::Eigen)
