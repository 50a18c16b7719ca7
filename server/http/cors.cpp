#include "server/http/cors.h"

#include <algorithm>

namespace kiln {
namespace {

constexpr const char* kSent =
    "authorization, content-range, content-type, idempotency-key, if-none-match, if-range, last-event-id, prefer, "
    "range, "
    "tus-resumable, upload-checksum, upload-length, upload-metadata, upload-offset, x-request-id";
constexpr const char* kReadable =
    "accept-ranges, content-disposition, content-range, etag, location, retry-after, tus-checksum-algorithm, "
    "tus-extension, tus-max-size, tus-resumable, tus-version, upload-asset, upload-expires, upload-length, "
    "upload-metadata, upload-offset, x-request-id";

}  // namespace

bool is_origin(const std::string& text) {
  const std::size_t host = text.starts_with("https://") ? 8 : text.starts_with("http://") ? 7 : text.size();
  const std::string rest = text.substr(host);
  return !rest.empty() && rest.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789.-:[]") == std::string::npos;
}

bool Cors::allows(const Head& head) const {
  return count_fields(head, "origin") == 1 && std::ranges::find(origins_, field_of(head, "origin")) != origins_.end();
}

bool Cors::is_preflight(const Head& head) const {
  return head.method == "OPTIONS" && count_fields(head, "access-control-request-method") == 1 && allows(head);
}

Reply Cors::preflight(const Reply& reply) {
  const auto allow = std::ranges::find(reply.fields, "allow", &Field::name);
  if (allow == reply.fields.end()) return reply;
  Reply answer;
  answer.status = 204;
  answer.fields = {{"access-control-allow-methods", allow->value},
                   {"access-control-allow-headers", kSent},
                   {"access-control-max-age", "600"}};
  return answer;
}

void Cors::open(Reply& reply, const Head& head) const {
  if (origins_.empty()) return;
  reply.fields.push_back({"vary", "Origin"});
  if (!allows(head)) return;
  reply.fields.push_back({"access-control-allow-origin", std::string(field_of(head, "origin"))});
  reply.fields.push_back({"access-control-expose-headers", kReadable});
}

}  // namespace kiln
