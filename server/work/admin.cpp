#include "server/work/admin.h"

#include <fcntl.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "core/base/sha256.h"
#include "server/jobs/sqlite_store.h"
#include "server/work/data_folder.h"
#include "server/work/housekeeping.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Both stores, and the lock where nobody else may write.
struct Stores {
  std::optional<DataLock> lock;
  std::unique_ptr<JobStore> jobs;
  std::unique_ptr<BlobStore> blobs;
};

Result<Stores> open_stores(const ServiceOptions& options) {
  Stores stores;
  if (options.stores.jobs.empty()) {
    KILN_TRY(lock, DataLock::take(options.data));
    stores.lock.emplace(std::move(lock));
  }
  KILN_TRY(jobs, open_job_store(options.stores, options.data));
  KILN_TRY(blobs, open_blob_store(options.stores, options.data));
  if (auto ours = check_owner(options.stores, *jobs, *blobs); !ours) return tl::make_unexpected(ours.error());
  stores.jobs = std::move(jobs);
  stores.blobs = std::move(blobs);
  return stores;
}

/// True when the bytes can be read and hash to their name.
bool is_sound(const BlobStore& blobs, const std::string& sha256) {
  const auto reader = blobs.open_blob(sha256);
  if (!reader) return false;
  std::vector<std::uint8_t> piece(1 << 20);
  Sha256 hash;
  for (std::uint64_t offset = 0; offset < reader->size();) {
    const auto got = reader->read(offset, piece);
    if (!got || *got == 0) return false;
    hash.update(std::span(piece).first(*got));
    offset += *got;
  }
  return hash.hex() == sha256;
}

/// What was written below the folder is on its disk afterwards.
Result<void> sync_disk(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = fd >= 0 && ::syncfs(fd) == 0;
  if (fd >= 0) ::close(fd);
  if (!synced) return fault("io_failed", "the backup could not be made durable");
  return {};
}

}  // namespace

Result<std::string> admin_stats(const ServiceOptions& options) {
  KILN_TRY(stores, open_stores(options));
  KILN_TRY(counts, stores.jobs->counts());
  std::uint64_t blobs = 0, bytes = 0;
  const auto listed = stores.blobs->for_each([&](const BlobEntry& blob) {
    ++blobs;
    bytes += blob.bytes;
  });
  if (!listed) return tl::make_unexpected(listed.error());
  return json{{"jobs",
               {{"queued", counts.queued},
                {"running", counts.running},
                {"succeeded", counts.succeeded},
                {"failed", counts.failed},
                {"canceled", counts.canceled},
                {"pinned", counts.pinned}}},
              {"blobs", blobs},
              {"blob_bytes", bytes},
              {"free_bytes", disk_space(stores.blobs->folder()).free_bytes}}
      .dump();
}

Result<std::string> admin_gc(const ServiceOptions& options, bool only_count) {
  KILN_TRY(stores, open_stores(options));
  KILN_TRY(forgotten, stores.jobs->forget_old_jobs(options.retention, only_count));
  if (only_count) {
    KILN_TRY(unused, stores.jobs->forget_unused_blobs(options.blob_grace, true));
    return json{{"forgotten", forgotten}, {"removed", unused.size()}}.dump();
  }
  EventBus bus;
  WorkCounters counters;
  const WorkOptions work;
  KILN_TRY(removed, collect_unused_blobs({*stores.jobs, *stores.blobs, bus, counters, work}, options.blob_grace));
  return json{{"forgotten", forgotten}, {"removed", removed}}.dump();
}

Result<std::string> admin_pin(const ServiceOptions& options, const PinOrder& order) {
  KILN_TRY(stores, open_stores(options));
  const auto done = is_sha256(order.what) ? stores.jobs->pin_blob(order.what, order.tenant, order.pinned)
                                          : stores.jobs->pin(order.what, order.pinned).map([](const Job&) {});
  if (!done) return tl::make_unexpected(done.error());
  return json{{"pinned", order.pinned}}.dump();
}

Result<Scrub> admin_scrub(const ServiceOptions& options) {
  KILN_TRY(blobs, open_blob_store(options.stores, options.data));
  std::vector<BlobEntry> all;
  const auto listed = blobs->for_each([&](const BlobEntry& blob) { all.push_back(blob); });
  if (!listed) return tl::make_unexpected(listed.error());
  json wrong = json::array();
  std::uint64_t bytes = 0;
  for (const BlobEntry& blob : all) {
    bytes += blob.bytes;
    if (!is_sound(*blobs, blob.sha256) && blobs->exists(blob.sha256)) wrong.push_back(blob.sha256);
  }
  const bool sound = wrong.empty();
  return Scrub{json{{"blobs", all.size()}, {"bytes", bytes}, {"wrong", std::move(wrong)}}.dump(), sound};
}

Result<std::string> admin_backup(const ServiceOptions& options, const fs::path& target) {
  if (!options.stores.jobs.empty()) {
    return fault("bad_store", "a backup of PostgreSQL is made by pg_dump or its own base backups");
  }
  std::error_code error;
  if (!fs::create_directories(target, error) || error) {
    return fault("io_failed", "the folder of a backup must be a new one that can be made");
  }
  // Jobs first: blobs are only ever added, or removed a long while after the last job that needs them.
  if (auto copied = backup_sqlite_store(options.data / "kiln.db", target / "kiln.db"); !copied) {
    return tl::make_unexpected(copied.error());
  }
  KILN_TRY(blobs, open_blob_store(options.stores, options.data));
  std::uint64_t count = 0, bytes = 0;
  Result<void> placed;
  const auto listed = blobs->for_each([&](const BlobEntry& blob) {
    if (!placed) return;
    const fs::path shelf = target / "cas" / blob.sha256.substr(0, 2);
    fs::create_directories(shelf, error);
    placed = blobs->place(blob.sha256, shelf / blob.sha256);
    if (!placed && placed.error().code == "not_found") placed = {};  // collected meanwhile
    ++count;
    bytes += blob.bytes;
  });
  if (!listed) return tl::make_unexpected(listed.error());
  if (!placed) return tl::make_unexpected(placed.error());
  if (auto synced = sync_disk(target); !synced) return tl::make_unexpected(synced.error());
  return json{{"blobs", count}, {"bytes", bytes}}.dump();
}

}  // namespace kiln
