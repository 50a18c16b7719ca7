#pragma once
// The built viewer (web_viewer/dist), embedded in the program: what kilnd serves at `/`, `/view/{id}`, `/docs` and
// `/trade`.

#include <cstdint>
#include <span>
#include <string_view>

namespace kiln {

/// One file of dist/. All views live as long as the program.
struct Asset {
  std::string_view path;        // relative, no leading slash: "index.html", "assets/view-Bq3x.js"
  std::string_view media_type;  // "text/html; charset=utf-8"
  std::span<const std::uint8_t> bytes;
  std::string_view etag;  // strong and quoted, ready for the header; files below assets/ carry a hash in their
                          // name and may be cached for ever
};

/// All files, sorted by path. Where dist/ was absent when Kiln was built: index.html, view.html and docs.html, each one
/// line that says how to build the viewer.
/// Pages: `/` is index.html, `/view/{id}` is view.html, `/docs` is docs.html, `/trade` is trade.html, anything else its
/// own path.
std::span<const Asset> viewer_assets();

}  // namespace kiln
