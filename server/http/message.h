#pragma once
// One request and its reply, as the routes see them.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/api/job_request.h"
#include "server/api/problem.h"
#include "server/http/gate.h"

namespace kiln {

class Service;

struct Field {
  std::string name;  // lower case
  std::string value;
};

struct Head {
  std::string method;
  std::string path;      // percent-decoded, starts with '/'
  std::string raw_path;  // as it was sent
  QueryParams params;
  std::vector<Field> fields;
  std::optional<std::uint64_t> content_length;
};

/// The value of the first field of that (lower-case) name; empty when there is none.
std::string_view field_of(const Head&, std::string_view name);
std::size_t count_fields(const Head&, std::string_view name);
/// The media type alone: "text/plain" of "Text/Plain; charset=utf-8".
std::string media_type_of(const Head&);

/// The request's body, read on demand. Nothing is sent to a client that waits for 100 Continue before the first read.
class BodySource {
 public:
  virtual ~BodySource() = default;
  virtual std::uint64_t length() const = 0;
  virtual std::uint64_t taken() const = 0;  // bytes read so far
  /// Fills a part of `out`; 0 at the end. Problems: incomplete_body (400), timeout (408).
  virtual Answer<std::size_t> read(std::span<std::uint8_t> out) = 0;
};

/// The whole body, refused as too_large beyond `limit` bytes before any of it is read.
Answer<std::string> read_all(BodySource&, std::uint64_t limit);

/// Where a reply of any length goes, piece by piece.
class Sink {
 public:
  virtual ~Sink() = default;
  /// False when the client is gone or too slow: stop.
  virtual bool write(std::string_view bytes) = 0;
  virtual bool client_gone() = 0;
};

struct Reply {
  int status = 200;
  std::vector<Field> fields;
  std::string body;
  /// Instead of `body`: writes `stream_length` bytes, or any number when that is absent (the connection's end tells).
  std::function<void(Sink&)> stream;
  std::optional<std::uint64_t> stream_length;
};

Reply json_reply(int status, std::string json);
Reply problem_reply(const Problem&);

struct Request {
  Head head;
  std::vector<std::pair<std::string, std::string>> path_params;  // {id} of the route, in order
  BodySource* body = nullptr;
  Sink* client = nullptr;      // for client_gone() while waiting
  Pass upload;                 // the place among the uploads; a handler that has read the body may leave it
  std::string id;              // X-Request-Id
  std::string peer;            // address
  std::string refusal;         // code of the problem that was the answer; empty: none
  Service* service = nullptr;  // what of the service the one who asks may see
};

/// The value of a path parameter that the route has.
const std::string& path_param(const Request&, std::string_view name);

using Handler = std::function<Reply(Request&)>;
/// By the operation of their endpoint (server/api/endpoints.h).
using Handlers = std::map<std::string, Handler, std::less<>>;

}  // namespace kiln
