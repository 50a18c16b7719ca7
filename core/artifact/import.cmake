# Bytes in: glTF, GLB, PLY, .hdr, .exr.
kiln_library(kiln_import
  SOURCES findings.cpp uri.cpp json_scan.cpp json_fields.cpp
          gltf_container.cpp gltf_parse.cpp gltf_parse_extensions.cpp gltf_parse_geometry.cpp gltf_parse_materials.cpp
          gltf_bytes.cpp gltf_meshopt.cpp gltf_check.cpp gltf_accessor.cpp gltf_primitive.cpp
          draco_header.cpp gltf_draco.cpp gltf_placement.cpp gltf_images.cpp gltf_scene.cpp
          image_header.cpp image_decode.cpp png_decode.cpp jpeg_decode.cpp
          clean_part.cpp assemble.cpp ply_reader.cpp ply_scene.cpp
          import_scene.cpp read_scene_files.cpp
          hdr_reader.cpp exr_reader.cpp import_environment.cpp
  LINKS kiln_scene kiln_mesh kiln_base nlohmann_json::nlohmann_json
  PRIVATE_LINKS draco::draco meshoptimizer::meshoptimizer OpenEXR::OpenEXR PNG::PNG JPEG::JPEG)
