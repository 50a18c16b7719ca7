#pragma once
// One exchange: a head becomes a request, its rules are checked, its handler runs, the reply is written and logged.

#include <string>
#include <string_view>
#include <vector>

#include "server/http/access_log.h"
#include "server/http/addresses.h"
#include "server/http/connection.h"
#include "server/http/cors.h"
#include "server/http/gate.h"
#include "server/http/httplib_server.h"
#include "server/http/metrics.h"
#include "server/http/visitors.h"

namespace kiln {

struct ExchangeRules {
  std::uint64_t max_upload_bytes = 8ull << 30;
  std::vector<std::string> hosts;    // names a Host field may have; empty: any
  std::vector<std::string> origins;  // whose pages may read and change; empty: none
  AddressList proxies;               // whose X-Forwarded-For is believed
  std::vector<AccessToken> tokens;   // who may come in (auth.h); empty: everybody
};

class Exchange {
 public:
  /// `elsewhere` answers what has no endpoint (the viewer's files).
  Exchange(ExchangeRules rules, Service& service, const Handlers& handlers, const Handler& elsewhere, Gate& uploads,
           HttpMetrics& metrics, LogLine log);

  /// Serves one request. True when its bytes were read to the end.
  bool serve(Connection&, std::string_view head, const std::string& peer);
  /// The reply to a connection that never reaches a worker. It is neither counted nor logged.
  std::string refusal_text(const Problem&) const;

 private:
  Reply dispatch(const Endpoint*, const Handler&, Request&);
  Answer<void> check_query(const Head&, const Endpoint&) const;
  Answer<void> check_body(const Head&, const Endpoint&) const;
  Answer<Visitor*> check_token(const Head&, const Endpoint*) const;
  Answer<void> check_origin(const Head&) const;
  Reply take_body(const Handler&, Request&, Visitor*);

  ExchangeRules rules_;
  Service& service_;
  Cors cors_;
  Visitors visitors_;
  Gate& uploads_;
  HttpMetrics& metrics_;
  LogLine log_;
  HttplibServer library_;
};

/// The client's own X-Request-Id if it is a harmless one, else a fresh one.
std::string request_id_of(std::string_view given);

}  // namespace kiln
