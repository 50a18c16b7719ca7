#pragma once
// Bodies stream to disk: 256 kB at a time, whatever their size.

#include <functional>
#include <string>

#include "server/http/message.h"
#include "server/http/multipart.h"
#include "server/work/service.h"

namespace kiln {

/// Where bytes come from; 0 at the end.
using ReadBytes = std::function<Answer<std::size_t>(std::span<std::uint8_t>)>;

/// Stores what `read` gives as an asset.
Answer<StoredBlob> store_asset(Service&, const AssetRequest&, const ReadBytes& read);

/// Hands all bytes on, piece by piece.
using WriteBytes = std::function<Result<void>(std::span<const std::uint8_t>)>;
Answer<void> copy_bytes(const ReadBytes& read, const WriteBytes& write);

/// The job that a request of POST /v1/jobs, PUT /v1/jobs or POST /v1/plan describes, its files stored:
/// application/json, multipart/form-data, or a bare scene with ?preset=.
Answer<Submission> read_submission(Request&, Service&);

}  // namespace kiln
