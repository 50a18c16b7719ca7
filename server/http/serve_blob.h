#pragma once
// A stored file as a reply: strong ETag, If-None-Match, one Range, If-Range, streamed in pieces of 1 MiB.

#include <memory>
#include <string>

#include "server/http/gate.h"
#include "server/http/message.h"
#include "server/work/service.h"

namespace kiln {

struct BlobReply {
  std::string media_type;  // one of the fixed ones (safe_media_type)
  std::string sha256;      // its quoted form is the ETag
  std::string file_name;   // proposed to who saves it
  Pass pass;               // held until the reply is written
};

Reply serve_blob(const Head&, BlobReader reader, BlobReply how);

/// The media type of an artefact by its name. Never html, svg or anything else that a browser would run (S8).
std::string safe_media_type(std::string_view name);

/// attachment with a file name that needs no escapes.
std::string attachment(std::string_view file_name);

/// Writes bytes [first, first + length) of a blob; false when the client is gone or the blob cannot be read.
bool send_blob(Sink&, const BlobReader&, std::uint64_t first, std::uint64_t length);

}  // namespace kiln
