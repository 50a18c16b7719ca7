#pragma once
// The handlers of all endpoints, a file for each tag of the table.

#include <atomic>
#include <chrono>
#include <functional>

#include "server/http/gate.h"
#include "server/http/message.h"
#include "server/work/service.h"

namespace kiln {

/// What handlers share. Outlives them.
struct RouteContext {
  Service& service;
  Gate& streams;    // event streams and long polls
  Gate& downloads;  // artefacts and bundles
  const std::atomic<bool>& draining;
  std::chrono::milliseconds heartbeat{10'000};  // longest silence of an event stream
  std::function<std::string()> metrics_text;
  std::uint64_t max_upload_bytes = 0;
};

Handlers job_routes(RouteContext&);
Handlers event_routes(RouteContext&);
Handlers artifact_routes(RouteContext&);
Handlers asset_routes(RouteContext&);
Handlers upload_routes(RouteContext&);
Handlers recipe_routes(RouteContext&);
Handlers service_routes(RouteContext&);
Handlers viewer_routes();

/// A file of the built viewer for a path without an endpoint, or 404.
Reply viewer_file(Request&);

}  // namespace kiln
