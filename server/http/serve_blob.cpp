#include "server/http/serve_blob.h"

#include <algorithm>
#include <cctype>
#include <vector>

#include "server/api/header_fields.h"

namespace kiln {
namespace {

constexpr std::size_t kPieceBytes = 1u << 20;

Reply not_modified(const std::string& etag) {
  Reply reply;
  reply.status = 304;
  reply.fields = {{"etag", etag}, {"cache-control", "private, no-cache"}};
  return reply;
}

Reply bad_range(const Problem& problem, std::uint64_t size) {
  Reply reply = problem_reply(problem);
  reply.fields.push_back({"content-range", "bytes */" + std::to_string(size)});
  return reply;
}

/// The part that was asked for; all of it without a usable Range.
Answer<std::optional<ByteRange>> asked_range(const Head& head, std::uint64_t size, const std::string& etag) {
  const std::size_t ranges = count_fields(head, "range");
  if (ranges == 0 || head.method != "GET") return std::optional<ByteRange>();
  if (count_fields(head, "if-range") > 0 && !if_range_allows(field_of(head, "if-range"), etag))
    return std::optional<ByteRange>();
  if (ranges > 1) return refuse("range_not_satisfiable", "only one byte range can be served");
  auto range = parse_range(field_of(head, "range"), size);
  if (!range) return tl::make_unexpected(range.error());
  return std::optional<ByteRange>(*range);
}

}  // namespace

std::string safe_media_type(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  const std::string_view end = dot == std::string_view::npos ? std::string_view() : name.substr(dot);
  if (end == ".glb") return "model/gltf-binary";
  if (end == ".png") return "image/png";
  if (end == ".json") return "application/json";
  if (end == ".txt") return "text/plain; charset=utf-8";
  return "application/octet-stream";
}

std::string attachment(std::string_view file_name) {
  std::string plain(file_name);
  for (char& c : plain) {
    const bool keep = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '_';
    if (!keep) c = '_';
  }
  return "attachment; filename=\"" + plain + "\"";
}

bool send_blob(Sink& sink, const BlobReader& reader, std::uint64_t first, std::uint64_t length) {
  std::vector<std::uint8_t> piece(static_cast<std::size_t>(std::min<std::uint64_t>(length, kPieceBytes)));
  while (length > 0) {
    const std::size_t want = static_cast<std::size_t>(std::min<std::uint64_t>(length, piece.size()));
    auto got = reader.read(first, std::span(piece).first(want));
    if (!got || *got == 0) return false;  // the connection ends early: the client sees that the length is not reached
    if (!sink.write({reinterpret_cast<const char*>(piece.data()), *got})) return false;
    first += *got;
    length -= *got;
  }
  return true;
}

Reply serve_blob(const Head& head, BlobReader reader, BlobReply how) {
  const std::string etag = "\"" + how.sha256 + "\"";
  const std::uint64_t size = reader.size();
  if (etag_listed(field_of(head, "if-none-match"), etag)) return not_modified(etag);
  auto range = asked_range(head, size, etag);
  if (!range) return bad_range(range.error(), size);

  Reply reply;
  reply.fields = {{"content-type", how.media_type},
                  {"content-disposition", attachment(how.file_name)},
                  {"etag", etag},
                  {"accept-ranges", "bytes"},
                  {"cache-control", "private, no-cache"}};
  const ByteRange part = range->value_or(ByteRange{0, size - 1});
  const std::uint64_t length = size == 0 ? 0 : part.last - part.first + 1;
  if (*range) {
    reply.status = 206;
    reply.fields.push_back({"content-range", "bytes " + std::to_string(part.first) + "-" + std::to_string(part.last) +
                                                 "/" + std::to_string(size)});
  }
  reply.stream_length = length;
  auto shared = std::make_shared<BlobReader>(std::move(reader));
  reply.stream = [shared, part, length, pass = std::move(how.pass)](Sink& sink) {
    send_blob(sink, *shared, part.first, length);
  };
  return reply;
}

}  // namespace kiln
