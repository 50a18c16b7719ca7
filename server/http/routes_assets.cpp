#include <nlohmann/json.hpp>
#include <vector>

#include "server/api/header_fields.h"
#include "server/http/reply_of.h"
#include "server/http/routes.h"
#include "server/http/serve_blob.h"
#include "server/http/upload.h"

namespace kiln {
namespace {

using nlohmann::json;

Reply asset_reply(const StoredBlob& blob) {
  Reply reply = json_reply(blob.existed ? 200 : 201,
                           json{{"sha256", blob.sha256}, {"bytes", blob.bytes}, {"existed", blob.existed}}.dump());
  reply.fields.push_back({"location", "/v1/assets/" + blob.sha256});
  return reply;
}

Problem bad_name(const std::string& name) {
  return make_problem("bad_asset_name", "an asset is named by the SHA-256 of its bytes",
                      {{"/sha256", "must be 64 lower-case hex digits",
                        json(name).dump(-1, ' ', false, json::error_handler_t::replace), "^[0-9a-f]{64}$"}});
}

/// Where an upload begins and whether its bytes end the file.
struct Piece {
  std::uint64_t offset = 0;
  bool last = true;
};

Answer<Piece> asked_piece(const Request& request) {
  const std::string_view offset = field_of(request.head, "upload-offset");
  const std::string_view range_text = field_of(request.head, "content-range");
  if (!range_text.empty()) {
    auto range = parse_content_range(range_text);
    if (!range) return tl::make_unexpected(range.error());
    if (range->range.last - range->range.first + 1 != request.body->length())
      return refuse("bad_header", "Content-Range and Content-Length disagree");
    return Piece{range->range.first, range->range.last + 1 == range->total};
  }
  if (offset.empty()) return Piece{};
  const auto number = parse_decimal(offset);
  if (!number) return refuse("bad_header", "Upload-Offset must be a number of bytes");
  return Piece{*number, true};
}

/// The file is known: nothing to store. A client that asks first (100-continue) is spared the upload; another one
/// may not look at the reply before it has sent everything, so its bytes are read and forgotten.
Reply known_asset(Service& service, Request& request, const std::string& sha256) {
  auto reader = service.open_asset(sha256);
  if (!reader) return fault_reply(reader.error());
  if (field_of(request.head, "expect").empty()) {
    std::vector<std::uint8_t> piece(256u << 10);
    while (true) {
      auto got = request.body->read(piece);
      if (!got) return problem_reply(got.error());
      if (*got == 0) break;
    }
  }
  return asset_reply({sha256, reader->size(), true});
}

Reply with_offset(Reply reply, Service& service, const std::string& sha256) {
  reply.fields.push_back({"upload-offset", std::to_string(service.asset_offset(sha256, ""))});
  return reply;
}

Reply store_piece(Service& service, Request& request, const std::string& sha256, const Piece& piece) {
  auto upload = service.put_asset({sha256, piece.offset, request.body->length()});
  if (!upload) return with_offset(fault_reply(upload.error()), service, sha256);
  auto copied = copy_bytes([&](std::span<std::uint8_t> out) { return request.body->read(out); },
                           [&](std::span<const std::uint8_t> bytes) { return (*upload)->write(bytes); });
  if (!copied) return problem_reply(copied.error());
  if (!piece.last) {
    const std::uint64_t bytes = (*upload)->bytes();
    upload->reset();
    Reply reply = json_reply(202, json{{"sha256", sha256}, {"bytes", bytes}}.dump());
    return with_offset(std::move(reply), service, sha256);
  }
  auto stored = (*upload)->finish();
  return stored ? asset_reply(*stored) : fault_reply(stored.error());
}

Reply put_asset(RouteContext&, Request& request) {
  const std::string& sha256 = path_param(request, "sha256");
  if (!is_sha256(sha256)) return problem_reply(bad_name(sha256));
  auto piece = asked_piece(request);
  if (!piece) return problem_reply(piece.error());
  if (request.service->has_asset(sha256, "")) return known_asset(*request.service, request, sha256);
  return store_piece(*request.service, request, sha256, *piece);
}

Reply post_asset(RouteContext&, Request& request) {
  AssetRequest asset;
  asset.expected = request.body->length();
  auto stored =
      store_asset(*request.service, asset, [&](std::span<std::uint8_t> out) { return request.body->read(out); });
  return stored ? asset_reply(*stored) : problem_reply(stored.error());
}

Reply get_asset(RouteContext& context, Request& request) {
  const std::string& sha256 = path_param(request, "sha256");
  if (!is_sha256(sha256)) return problem_reply(bad_name(sha256));
  Pass pass = context.downloads.enter();
  if (!pass) return problem_reply(make_problem("overloaded", "too many downloads at once; try again in a moment"));
  if (!request.service->has_asset(sha256, std::nullopt))
    return with_offset(problem_reply(make_problem("not_found", "there is no such asset")), *request.service, sha256);
  auto reader = request.service->open_asset(sha256);
  if (!reader) return fault_reply(reader.error());
  return serve_blob(request.head, std::move(*reader), {"application/octet-stream", sha256, sha256, std::move(pass)});
}

Reply pin_asset(Request& request) {
  const std::string& sha256 = path_param(request, "sha256");
  if (!is_sha256(sha256)) return problem_reply(bad_name(sha256));
  const auto pinned = request.service->pin_asset(sha256, "", request.head.method == "PUT");
  if (!pinned) return fault_reply(pinned.error());
  Reply reply;
  reply.status = 204;
  return reply;
}

}  // namespace

Handlers asset_routes(RouteContext& context) {
  return {{"putAsset", [&context](Request& request) { return put_asset(context, request); }},
          {"pinAsset", pin_asset},
          {"unpinAsset", pin_asset},
          {"postAsset", [&context](Request& request) { return post_asset(context, request); }},
          {"getAsset", [&context](Request& request) { return get_asset(context, request); }}};
}

}  // namespace kiln
