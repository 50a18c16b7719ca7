#pragma once
// The tables in PostgreSQL. Internal to server/jobs.

#include "server/jobs/postgres_db.h"

namespace kiln::sql {

/// Makes schema `kiln` and its tables unless they are there; one program at a time.
Result<void> make_postgres_tables(PostgresConnection&);

}  // namespace kiln::sql
