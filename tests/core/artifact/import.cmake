# The importer: forms, extremes, attacks, damage; and the shared model files.
kiln_library(kiln_gltf_samples SOURCES gltf_samples.cpp radiance_samples.cpp LINKS kiln_import)
kiln_test(import_test
  SOURCES import_geometry_test.cpp import_extremes_test.cpp import_materials_test.cpp import_hostile_test.cpp
          import_mutation_test.cpp import_files_test.cpp import_tinygltf_test.cpp radiance_import_test.cpp
  LINKS kiln_gltf_samples kiln_import kiln_mesh draco::draco meshoptimizer::meshoptimizer OpenEXR::OpenEXR JPEG::JPEG)
if(NOT TARGET conformance_test)
  add_subdirectory(${PROJECT_SOURCE_DIR}/tests/conformance ${PROJECT_BINARY_DIR}/tests/conformance)
endif()
