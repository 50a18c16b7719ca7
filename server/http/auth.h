#pragma once
// Bearer tokens. Kept and compared as SHA-256, so neither memory dumps nor timing tell one.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/http/message.h"
#include "server/jobs/job_store.h"

namespace kiln {

/// Who a token stands for and what it may do.
struct AccessToken {
  std::string hash;    // SHA-256 of the token
  std::string tenant;  // sees its own jobs and assets alone; with `admin` everybody's
  bool read = true, submit = true, admin = true;
  int max_jobs = 0;                   // unfinished at a time; 0: no limit
  int max_uploads = 0;                // bodies on their way at a time; 0: no limit but the server's
  double rate = 0;                    // requests a second, ten seconds' worth at once; 0: no limit
  std::uint64_t max_daily_bytes = 0;  // uploaded by its tenant from midnight to midnight (UTC); 0: no limit
  int keep_days = 0;                  // how long jobs that ended are kept; 0: as those of others
};

/// The tokens in a file, one a line; empty lines and #-comments are skipped. A line is a token of 43 characters
/// [A-Za-z0-9_-], and after it, as far as wanted:
///   tenant=NAME scopes=read,submit,admin jobs=N uploads=N rate=N daily_mb=N keep_days=N
/// Scopes are all of them by default, of a token with a tenant read and submit. `admin` sees everybody's jobs and the
/// metrics, and goes with neither tenant nor jobs, daily_mb, keep_days. Fails  bad_token_file: unreadable,
/// without any token, with a line that is none, or with two keep_days for one tenant.
Result<std::vector<AccessToken>> read_tokens(const std::string& file);

/// How long each tenant's jobs are kept, as far as the tokens say.
std::map<std::string, Millis> kept_by_tenant(const std::vector<AccessToken>&);

/// The place of the token that the request carries: `Authorization: Bearer TOKEN`, or Basic with the token as password
/// (what a browser sends, for pages and event streams too).
std::optional<std::size_t> carried_token(const Head&, const std::vector<AccessToken>&);

}  // namespace kiln
