# The writer stands alone; the reader needs the importer's parser.
set(reader "")
if(TARGET kiln_import)
  set(reader baked_header.cpp read_baked_glb.cpp)
endif()
kiln_library(kiln_baked_scene
  SOURCES baked_geometry.cpp draco_codec.cpp evaluate.cpp glb.cpp look.cpp look_json.cpp png.cpp prt_slots.cpp streams.cpp
          write_baked_glb.cpp ${reader}
  LINKS kiln_base kiln_mesh kiln_sphere $<TARGET_NAME_IF_EXISTS:kiln_import>
  PRIVATE_LINKS draco::draco nlohmann_json::nlohmann_json)
set_source_files_properties(png.cpp PROPERTIES INCLUDE_DIRECTORIES /usr/include/stb)
