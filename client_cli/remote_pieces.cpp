// Uploading in pieces: tus 1.0, as server/http/README.md has it.
#include <algorithm>
#include <chrono>

#include "client_cli/remote.h"
#include "core/base/base64.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kPieceBytes = 16u << 20;
constexpr auto kPatience = std::chrono::seconds(60);  // without a byte more
constexpr std::size_t kHashedPerS = 64u << 20;        // at least, by a server that makes an asset of an upload
constexpr int kTries = 2;                             // a server may forget an upload once
constexpr double kFirstPauseS = 0.2, kLongestPauseS = 5;

const std::pair<std::string, std::string> kTus{"Tus-Resumable", "1.0.0"};

/// The upload as the server knows it.
struct Place {
  std::string path;
  std::uint64_t offset = 0;
  bool stored = false;  // it has become an asset
};

/// The same file again gives the same upload, so that a client that forgot it goes on too.
Outcome<Place> begin_upload(ServerLink& link, std::size_t bytes, const std::string& sha256) {
  const std::span name(reinterpret_cast<const std::uint8_t*>(sha256.data()), sha256.size());
  KILN_TRY(
      begun,
      link.post("/v1/uploads",
                {kTus, {"Upload-Length", std::to_string(bytes)}, {"Upload-Metadata", "sha256 " + base64_encode(name)}},
                {}));
  const std::size_t slash = begun.location.rfind('/');
  if (slash == std::string::npos)
    return fail(ExitCode::error, "bad_reply", "the server began an upload without a name");
  return Place{"/v1/uploads" + begun.location.substr(slash), begun.upload_offset, begun.upload_stored};
}

/// Whether an upload may go on after this.
bool is_passing(const Failure& failure) {
  return failure.exit == ExitCode::unreachable || failure.problem.code == "upload_busy" ||
         failure.problem.code == "offset_mismatch";
}

/// Where to go on, as the server says; not_found when it knows the upload no more.
Outcome<Place> find_place(ServerLink& link, const Place& last) {
  KILN_TRY(known, link.head(last.path, {kTus}));
  if (known.status == 404) return fail(ExitCode::not_found, "not_found", "the server forgot an upload");
  return known.status < 400 ? Place{last.path, known.upload_offset, known.upload_stored} : last;
}

/// The next piece. When all have come, the server still makes an asset of them: one asks again.
Outcome<HttpReply> send_piece(ServerLink& link, const Place& place, std::span<const std::uint8_t> bytes) {
  if (place.offset >= bytes.size())
    return fail(ExitCode::error, "upload_busy", "the server has all of an upload and makes no asset of it");
  const auto piece = bytes.subspan(place.offset, std::min(kPieceBytes, bytes.size() - place.offset));
  return link.patch(place.path, {kTus, {"Upload-Offset", std::to_string(place.offset)}},
                    {"application/offset+octet-stream", {{reinterpret_cast<const char*>(piece.data()), piece.size()}}});
}

/// From where an upload stands to its end; not_found when the server knows it no more.
Outcome<void> send_rest(ServerLink& link, Place place, std::span<const std::uint8_t> bytes) {
  std::uint64_t furthest = place.offset;
  auto moved = Clock::now();
  double pause = kFirstPauseS;
  const auto patience = kPatience + std::chrono::seconds(bytes.size() / kHashedPerS);
  while (!place.stored) {
    const bool whole = place.offset >= bytes.size();
    const auto sent = send_piece(link, place, bytes);
    if (sent) {
      place = {place.path, sent->upload_offset, sent->upload_stored};
    } else if (!is_passing(sent.error())) {
      return tl::make_unexpected(sent.error());
    } else {
      if (!sleep_unless_interrupted(pause, link.session().interrupt)) return interrupted();
      pause = std::min(pause * 2, kLongestPauseS);
      const auto found = find_place(link, place);
      if (!found && !is_passing(found.error())) return tl::make_unexpected(found.error());
      if (found) place = *found;
      if (found && !whole) say("the connection broke; going on at " + human_bytes(static_cast<double>(place.offset)));
    }
    if (place.offset > furthest) {
      furthest = place.offset;
      moved = Clock::now();
      pause = kFirstPauseS;
    } else if (Clock::now() - moved > patience) {
      return sent ? fail(ExitCode::error, "bad_reply", "the server takes no bytes") : tl::make_unexpected(sent.error());
    }
  }
  return {};
}

}  // namespace

Outcome<bool> upload_in_pieces(ServerLink& link, std::span<const std::uint8_t> bytes, const std::string& sha256) {
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const auto place = begin_upload(link, bytes.size(), sha256);
    const Outcome<void> sent = place ? send_rest(link, *place, bytes) : tl::make_unexpected(place.error());
    if (sent) return true;
    if (sent.error().exit != ExitCode::not_found) return tl::make_unexpected(sent.error());
  }
  return false;
}

}  // namespace kiln
