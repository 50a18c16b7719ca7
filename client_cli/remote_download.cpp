// Downloading artefacts, each checked against its hash.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "client_cli/remote.h"
#include "core/base/sha256.h"

namespace kiln {
namespace {

constexpr int kTries = 3;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

tl::unexpected<Failure> unwritable(const std::string& path) {
  return fail(ExitCode::error, "unwritable_file", "cannot be written", path);
}

/// Streams to `part`; true when every byte came and the hash is right.
Outcome<bool> try_download(ServerLink& link, const std::string& url, const ArtifactReply& artifact,
                           const std::string& part) {
  std::unique_ptr<std::FILE, CloseFile> file(std::fopen(part.c_str(), "wb"));
  if (!file) return unwritable(part);
  Sha256 hash;
  std::uint64_t bytes = 0;
  bool written = true;
  const Outcome<void> streamed = link.stream(url, {}, [&](std::string_view data) {
    hash.update({reinterpret_cast<const std::uint8_t*>(data.data()), data.size()});
    bytes += data.size();
    written = std::fwrite(data.data(), 1, data.size(), file.get()) == data.size();
    return written;
  });
  if (!written || std::fflush(file.get()) != 0) return unwritable(part);
  if (!streamed && streamed.error().exit != ExitCode::unreachable) return tl::make_unexpected(streamed.error());
  return streamed.has_value() && bytes == artifact.bytes && hash.hex() == artifact.sha256;
}

}  // namespace

Outcome<void> download_artifact(ServerLink& link, const std::string& id, const ArtifactReply& artifact,
                                const std::string& path) {
  KILN_TRY(job, job_path(id));
  const std::string part = path + ".part";
  std::error_code error;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    const Outcome<bool> whole = try_download(link, job + "/artifacts/" + artifact.name, artifact, part);
    if (whole && *whole) std::filesystem::rename(part, path, error);
    if (whole && *whole && !error) return {};
    std::filesystem::remove(part, error);
    if (!whole) return tl::make_unexpected(whole.error());
  }
  return fail(ExitCode::error, "broken_download", "did not arrive whole in " + std::to_string(kTries) + " tries",
              artifact.name);
}

}  // namespace kiln
