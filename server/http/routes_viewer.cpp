#include <algorithm>

#include "server/api/header_fields.h"
#include "server/http/routes.h"
#include "web_viewer/assets.h"

namespace kiln {
namespace {

// reliability.md S7, word for word.
constexpr const char* kPagePolicy =
    "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self' blob:; style-src 'self'; "
    "img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const Asset* find_asset(std::string_view path) {
  const auto all = viewer_assets();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Asset& asset) { return asset.path == path; });
  return found == all.end() ? nullptr : &*found;
}

/// Files below assets/ carry a hash in their name; pages are asked for anew every time.
const char* cache_rule(std::string_view path) {
  return path.starts_with("assets/") ? "public, max-age=31536000, immutable" : "no-cache";
}

Reply asset_reply(const Head& head, const Asset& asset) {
  Reply reply;
  reply.fields = {{"etag", std::string(asset.etag)},
                  {"cache-control", cache_rule(asset.path)},
                  {"content-security-policy", kPagePolicy},
                  {"cross-origin-opener-policy", "same-origin"}};
  if (etag_listed(field_of(head, "if-none-match"), asset.etag)) {
    reply.status = 304;
    return reply;
  }
  reply.fields.push_back({"content-type", std::string(asset.media_type)});
  reply.stream_length = asset.bytes.size();
  const std::string_view bytes(reinterpret_cast<const char*>(asset.bytes.data()), asset.bytes.size());
  reply.stream = [bytes](Sink& sink) { sink.write(bytes); };
  return reply;
}

Handler page(std::string_view path) {
  return [path](Request& request) {
    const Asset* asset = find_asset(path);
    return asset != nullptr ? asset_reply(request.head, *asset)
                            : problem_reply(make_problem("not_found", "this server was built without that page"));
  };
}

}  // namespace

Handlers viewer_routes() {
  return {{"galleryPage", page("index.html")},
          {"viewerPage", page("view.html")},
          {"docsPage", page("docs.html")},
          {"tradePage", page("trade.html")}};
}

Reply viewer_file(Request& request) {
  const bool reads = request.head.method == "GET" || request.head.method == "HEAD";
  const Asset* asset = reads ? find_asset(std::string_view(request.head.path).substr(1)) : nullptr;
  return asset != nullptr ? asset_reply(request.head, *asset)
                          : problem_reply(make_problem("not_found", "there is nothing at this address"));
}

}  // namespace kiln
