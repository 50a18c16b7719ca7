// tinygltf itself, compiled once and without what it must not do: it opens no file and decodes no image.
// import.cmake sets those switches for all who include its header, and renames its namespace: Debian's libdraco exports
// another tinygltf, with other switches, and the linker would take whichever comes first.
#include <fstream>  // its writers, which nobody calls, forget it

#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>
