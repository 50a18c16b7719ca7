# Bytes in: glTF, GLB, PLY, .hdr, .exr.
# tinygltf without file access and image decoding, under a name of its own: see tinygltf.cpp.
kiln_library(kiln_tinygltf SOURCES tinygltf.cpp PRIVATE_LINKS nlohmann_json::nlohmann_json)
target_compile_definitions(kiln_tinygltf PUBLIC tinygltf=kiln_tinygltf TINYGLTF_NO_FS TINYGLTF_NO_EXTERNAL_IMAGE
                                                TINYGLTF_NO_STB_IMAGE TINYGLTF_NO_STB_IMAGE_WRITE)
target_compile_options(kiln_tinygltf PRIVATE -O1 -g0)  # a third of the time and memory to compile under the sanitizers
target_include_directories(kiln_tinygltf SYSTEM PUBLIC ${TINYGLTF_INCLUDE_DIR})
kiln_library(kiln_import
  SOURCES findings.cpp uri.cpp json_scan.cpp json_fields.cpp
          gltf_container.cpp gltf_schema.cpp gltf_check_tree.cpp gltf_extensions.cpp gltf_tree.cpp gltf_load.cpp
          gltf_model.cpp gltf_model_geometry.cpp gltf_model_materials.cpp
          gltf_bytes.cpp gltf_meshopt.cpp gltf_check.cpp gltf_accessor.cpp gltf_primitive.cpp
          draco_header.cpp gltf_draco.cpp gltf_placement.cpp gltf_images.cpp gltf_radiance.cpp gltf_scene.cpp
          image_header.cpp image_decode.cpp png_decode.cpp jpeg_decode.cpp
          clean_part.cpp assemble.cpp ply_columns.cpp ply_reader.cpp ply_scene.cpp
          triangle_stream.cpp ply_stream.cpp gltf_stream.cpp
          import_scene.cpp read_scene_files.cpp
          hdr_reader.cpp exr_reader.cpp exr_writer.cpp import_environment.cpp
  LINKS kiln_lightfield_data kiln_scene kiln_mesh kiln_base nlohmann_json::nlohmann_json
  PRIVATE_LINKS kiln_tinygltf draco::draco meshoptimizer::meshoptimizer OpenEXR::OpenEXR PNG::PNG JPEG::JPEG)
