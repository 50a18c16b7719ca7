#include "server/http/visitors.h"

#include <algorithm>
#include <limits>

namespace kiln {

bool RateLimit::take(std::chrono::steady_clock::time_point now) {
  if (per_second_ <= 0) return true;
  const std::lock_guard lock(mutex_);
  left_ = std::min(10 * per_second_, left_ + per_second_ * std::chrono::duration<double>(now - last_).count());
  last_ = now;
  if (left_ < 1) return false;
  left_ -= 1;
  return true;
}

Visitor::Visitor(const AccessToken& given, Service& all)
    : token(given),
      own(given.admin ? nullptr : std::make_unique<TenantService>(all, given.tenant, given.max_jobs)),
      service(own ? static_cast<Service&>(*own) : all),
      uploads(given.max_uploads > 0 ? given.max_uploads : std::numeric_limits<int>::max()),
      rate(given.rate) {}

Visitors::Visitors(const std::vector<AccessToken>& tokens, Service& all) : tokens_(tokens) {
  for (const AccessToken& token : tokens) visitors_.push_back(std::make_unique<Visitor>(token, all));
}

Visitor* Visitors::find(const Head& head) const {
  const auto place = carried_token(head, tokens_);
  return place ? visitors_[*place].get() : nullptr;
}

}  // namespace kiln
