#pragma once
// The store of a fleet: one PostgreSQL database, any number of programs. Rows are locked one by one, claims pass over
// those that others hold (SKIP LOCKED), leases end by the database's clock. LISTEN/NOTIFY only wakes.

#include <functional>
#include <memory>
#include <string>

#include "server/jobs/job_store.h"

namespace kiln {

struct PostgresOptions {
  std::string address;                   // libpq's: "postgresql://user@host/database" or "host=... dbname=..."
  std::function<std::int64_t()> now_ms;  // the store's clock; the database's own when empty
};

/// Connects, makes the tables in schema `kiln` when they are not there, refuses a newer schema ("schema_too_new") and a
/// server that may forget what it acknowledged ("store_unsafe": synchronous_commit or fsync off). Fails with
/// "store_unavailable" when there is no such server; later it is looked for again by every call.
Result<std::unique_ptr<JobStore>> open_postgres_store(const PostgresOptions&);

/// True when the address itself holds a password, which has no place on a command line.
bool has_password(const std::string& postgres_address);

}  // namespace kiln
