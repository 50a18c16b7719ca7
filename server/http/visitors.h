#pragma once
// Those who carry a token: what each may see, and how much of it at a time.

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "server/http/auth.h"
#include "server/http/gate.h"
#include "server/work/tenant_service.h"

namespace kiln {

/// So many requests a second, and ten seconds' worth of them at once. In this server alone: a fleet of n lets n times
/// as many through.
class RateLimit {
 public:
  explicit RateLimit(double per_second) : per_second_(per_second), left_(10 * per_second) {}
  /// Takes one; false when there is none. Without a rate there always is.
  bool take(std::chrono::steady_clock::time_point now);

 private:
  const double per_second_;
  std::mutex mutex_;
  double left_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

struct Visitor {
  Visitor(const AccessToken& token, Service& all);
  AccessToken token;
  std::unique_ptr<TenantService> own;  // null for those who see everything
  Service& service;
  Gate uploads;
  RateLimit rate;
};

class Visitors {
 public:
  /// Without tokens nobody is asked.
  Visitors(const std::vector<AccessToken>& tokens, Service& all);
  bool anyone() const { return tokens_.empty(); }
  /// Who carries a token of ours; null for a stranger.
  Visitor* find(const Head&) const;

 private:
  std::vector<AccessToken> tokens_;
  std::vector<std::unique_ptr<Visitor>> visitors_;  // beside tokens_
};

}  // namespace kiln
