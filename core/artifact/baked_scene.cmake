# kiln_baked_reader reads what untrusted hands may have changed; kiln_baked_scene writes and shows it, too.
kiln_library(kiln_baked_reader
  SOURCES baked_header.cpp carried_scene.cpp draco_codec.cpp glb.cpp glb_extension.cpp lightmap_file.cpp links_glb.cpp points_glb.cpp progressive_glb.cpp
          read_baked_glb.cpp sky_levels.cpp stored_transfer.cpp
  LINKS kiln_import kiln_lightfield_data kiln_prt_data kiln_mesh kiln_sphere kiln_base
  PRIVATE_LINKS draco::draco nlohmann_json::nlohmann_json)
kiln_library(kiln_baked_scene
  SOURCES baked_geometry.cpp evaluate.cpp eye.cpp grid_exr.cpp look.cpp look_json.cpp png.cpp reduced_glb.cpp
          streams.cpp write_baked_glb.cpp write_lightmap.cpp
  LINKS kiln_baked_reader kiln_import kiln_grid_data kiln_lightfield kiln_meshless kiln_base kiln_mesh kiln_sphere
  PRIVATE_LINKS draco::draco nlohmann_json::nlohmann_json PNG::PNG)
set_source_files_properties(png.cpp PROPERTIES INCLUDE_DIRECTORIES /usr/include/stb)
