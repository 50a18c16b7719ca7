// Uploads in pieces: tus 1.0 (https://tus.io/protocols/resumable-upload) with creation, checksum, expiration and
// termination.

#include <nlohmann/json.hpp>

#include "server/api/header_fields.h"
#include "server/api/job.h"
#include "server/api/upload_fields.h"
#include "server/http/reply_of.h"
#include "server/http/routes.h"
#include "server/http/upload.h"

namespace kiln {
namespace {

using nlohmann::json;

Reply empty_reply(int status) {
  Reply reply;
  reply.status = status;
  reply.fields.push_back({"cache-control", "no-store"});
  return reply;
}

/// Where an upload stands.
Reply with_state(Reply reply, const PartialUpload& upload) {
  reply.fields.push_back({"upload-offset", std::to_string(upload.offset)});
  reply.fields.push_back({"upload-length", std::to_string(upload.length)});
  reply.fields.push_back({"upload-expires", http_date(upload.expires_s)});
  if (!upload.metadata.empty()) reply.fields.push_back({"upload-metadata", upload.metadata});
  if (upload.done) reply.fields.push_back({"upload-asset", upload.sha256});
  return reply;
}

Answer<void> check_version(const Head& head) {
  if (field_of(head, "tus-resumable") == kTusVersion) return {};
  return refuse("tus_version", std::string("this address speaks tus ") + kTusVersion + " (Tus-Resumable)");
}

Reply version_refusal(const Problem& problem) {
  Reply reply = problem_reply(problem);
  reply.fields.push_back({"tus-version", kTusVersion});
  return reply;
}

Reply options(const RouteContext& context, Request&) {
  Reply reply = empty_reply(204);
  reply.fields.push_back({"allow", "POST, OPTIONS"});
  reply.fields.push_back({"tus-version", kTusVersion});
  reply.fields.push_back({"tus-extension", "creation,checksum,expiration,termination"});
  reply.fields.push_back({"tus-checksum-algorithm", "sha256,sha1"});
  reply.fields.push_back({"tus-max-size", std::to_string(context.max_upload_bytes)});
  return reply;
}

Answer<PartialUpload> wanted_upload(const RouteContext& context, const Head& head) {
  const auto length = parse_decimal(field_of(head, "upload-length"));
  if (!length) return refuse("bad_header", "Upload-Length must be the number of bytes of the file");
  if (*length == 0) return refuse("empty_upload", "the file is empty");
  if (*length > context.max_upload_bytes)
    return refuse("too_large", "an upload may have " + std::to_string(context.max_upload_bytes) + " bytes");
  auto metadata = parse_upload_metadata(field_of(head, "upload-metadata"));
  if (!metadata) return tl::make_unexpected(metadata.error());
  PartialUpload wanted;
  wanted.length = *length;
  wanted.metadata = std::move(metadata->text);
  wanted.expected = std::move(metadata->sha256);
  return wanted;
}

Reply begin(const RouteContext& context, Request& request) {
  if (auto version = check_version(request.head); !version) return version_refusal(version.error());
  const auto wanted = wanted_upload(context, request.head);
  if (!wanted) return problem_reply(wanted.error());
  const auto upload = request.service->begin_upload(*wanted);
  if (!upload) return fault_reply(upload.error());
  Reply reply = with_state(empty_reply(201), *upload);
  reply.fields.push_back({"location", "/v1/uploads/" + upload->id});
  return reply;
}

Reply show(Request& request) {
  if (request.head.method == "HEAD") {
    if (auto version = check_version(request.head); !version) return version_refusal(version.error());
  }
  const auto upload = request.service->find_upload(path_param(request, "upload"), "");
  if (!upload) return fault_reply(upload.error());
  const json asset = upload->done ? json(upload->sha256) : json(nullptr);
  return with_state(json_reply(200, json{{"id", upload->id},
                                         {"length", upload->length},
                                         {"offset", upload->offset},
                                         {"expires_at", rfc3339(upload->expires_s * 1000)},
                                         {"asset", asset}}
                                        .dump()),
                    *upload);
}

/// A piece of the file, as its head announces it.
struct AskedPiece {
  std::uint64_t offset = 0;
  std::optional<UploadChecksum> checksum;
};

Answer<AskedPiece> asked_piece(const Head& head) {
  if (media_type_of(head) != "application/offset+octet-stream")
    return refuse("unsupported_media_type", "a piece is application/offset+octet-stream");
  const auto offset = parse_decimal(field_of(head, "upload-offset"));
  if (!offset) return refuse("bad_header", "Upload-Offset must be a number of bytes");
  auto checksum = parse_upload_checksum(field_of(head, "upload-checksum"));
  if (!checksum) return tl::make_unexpected(checksum.error());
  return AskedPiece{*offset, std::move(*checksum)};
}

/// What came of a piece that is cut counts, but for one with a checksum, which counts whole or not at all.
Answer<PartialUpload> take_piece(Request& request, UploadPiece& piece, const std::optional<UploadChecksum>& checksum) {
  if (checksum) piece.all_or_nothing();
  Digest digest(checksum ? checksum->kind : DigestKind::sha256);
  auto copied = copy_bytes([&](std::span<std::uint8_t> out) { return request.body->read(out); },
                           [&](std::span<const std::uint8_t> bytes) {
                             if (checksum) digest.update(bytes);
                             return piece.write(bytes);
                           });
  if (!copied) return tl::make_unexpected(copied.error());
  if (checksum && digest.bytes() != checksum->digest)
    return refuse("checksum_mismatch", "the piece has another checksum than announced; nothing of it counts");
  auto kept = piece.keep();
  if (!kept) return tl::make_unexpected(problem_of(kept.error()));
  return std::move(*kept);
}

Reply append(Request& request) {
  if (auto version = check_version(request.head); !version) return version_refusal(version.error());
  const auto asked = asked_piece(request.head);
  if (!asked) return problem_reply(asked.error());
  const auto upload = request.service->find_upload(path_param(request, "upload"), "");
  if (!upload) return fault_reply(upload.error());
  auto piece = request.service->append_upload(*upload, asked->offset);
  if (!piece) return fault_reply(piece.error());
  if (request.body->length() > upload->length - asked->offset)
    return problem_reply(make_problem("too_large", "the upload was announced with " + std::to_string(upload->length) +
                                                       " bytes: the piece goes beyond"));
  const auto kept = take_piece(request, **piece, asked->checksum);
  return kept ? with_state(empty_reply(204), *kept) : problem_reply(kept.error());
}

Reply remove(Request& request) {
  if (auto version = check_version(request.head); !version) return version_refusal(version.error());
  const auto removed = request.service->remove_upload(path_param(request, "upload"), "");
  return removed ? empty_reply(204) : fault_reply(removed.error());
}

}  // namespace

Handlers upload_routes(RouteContext& context) {
  return {{"uploadOptions", [&context](Request& request) { return options(context, request); }},
          {"beginUpload", [&context](Request& request) { return begin(context, request); }},
          {"getUpload", show},
          {"appendUpload", append},
          {"deleteUpload", remove}};
}

}  // namespace kiln
