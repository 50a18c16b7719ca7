# Writes OUT/viewer_files.S (one .incbin per file below DIST) and OUT/viewer_assets.cpp (the table of assets.h).
cmake_minimum_required(VERSION 3.25)

# Text is always UTF-8; "," stands for ";", which CMake would take as a list's end.
set(media_html "text/html, charset=utf-8")
set(media_js "text/javascript, charset=utf-8")
set(media_css "text/css, charset=utf-8")
set(media_txt "text/plain, charset=utf-8")
set(media_json "application/json")
set(media_wasm "application/wasm")
set(media_svg "image/svg+xml")
set(media_png "image/png")

function(media_type path out)
  string(REGEX REPLACE "^.*\\." "" extension "${path}")
  set(type "application/octet-stream")
  if(DEFINED media_${extension})
    set(type "${media_${extension}}")
  endif()
  set(${out} "${type}" PARENT_SCOPE)
endfunction()

# A viewer that was never built says so itself.
function(write_how_to_build folder)
  foreach(page index view docs trade)
    file(CONFIGURE OUTPUT ${folder}/${page}.html @ONLY CONTENT
         "<!doctype html><html lang=\"en\"><title>Kiln</title><p>This kilnd was built without its viewer. Build it with: cd web_viewer &amp;&amp; npm ci &amp;&amp; npx vite build, then build kilnd again.</p></html>\n")
  endforeach()
endfunction()

set(folder ${DIST})
if(NOT EXISTS ${DIST}/index.html)
  set(folder ${OUT}/no_viewer)
  write_how_to_build(${folder})
endif()

file(GLOB_RECURSE files RELATIVE ${folder} ${folder}/*)
list(FILTER files EXCLUDE REGEX "(^|/)\\.")  # stamps of build scripts
list(SORT files)
set(index 0)
set(blobs "")
set(symbols "")
set(rows "")
foreach(path IN LISTS files)
  file(SHA256 ${folder}/${path} sha256)
  file(SIZE ${folder}/${path} bytes)
  media_type(${path} type)
  string(SUBSTRING ${sha256} 0 32 tag)
  string(APPEND blobs ".balign 16\n.globl kiln_viewer_file_${index}\n.hidden kiln_viewer_file_${index}\n"
                      "kiln_viewer_file_${index}:  /* sha256 ${sha256} */\n.incbin \"${folder}/${path}\"\n.byte 0\n")
  string(APPEND symbols "extern \"C\" const std::uint8_t kiln_viewer_file_${index}[];\n")
  string(REPLACE "," ";" type "${type}")
  string(APPEND rows "    {\"${path}\", \"${type}\", {kiln_viewer_file_${index}, ${bytes}}, \"\\\"${tag}\\\"\"},\n")
  math(EXPR index "${index} + 1")
endforeach()

file(CONFIGURE OUTPUT ${OUT}/viewer_files.S @ONLY CONTENT
     "/* written by web_viewer/embed.cmake */\n.section .rodata\n@blobs@.section .note.GNU-stack,\"\",%progbits\n")
file(CONFIGURE OUTPUT ${OUT}/viewer_assets.cpp @ONLY CONTENT "// Written by web_viewer/embed.cmake.
#include \"web_viewer/assets.h\"

@symbols@
namespace kiln {

std::span<const Asset> viewer_assets() {
  static const Asset kAssets[] = {
@rows@  };
  return kAssets;
}

}  // namespace kiln
")
