kiln_library(kiln_baked_scene
  SOURCES baked_geometry.cpp baked_header.cpp carried_scene.cpp draco_codec.cpp evaluate.cpp eye.cpp glb.cpp glb_extension.cpp grid_exr.cpp links_glb.cpp look.cpp look_json.cpp png.cpp progressive_glb.cpp reduced_glb.cpp
          read_baked_glb.cpp sky_levels.cpp stored_transfer.cpp streams.cpp write_baked_glb.cpp
  LINKS kiln_import kiln_grid_data kiln_lightfield kiln_meshless kiln_base kiln_mesh kiln_sphere
  PRIVATE_LINKS draco::draco nlohmann_json::nlohmann_json)
set_source_files_properties(png.cpp PROPERTIES INCLUDE_DIRECTORIES /usr/include/stb)
