#pragma once
// One try to deliver one message.

#include <atomic>
#include <string>
#include <vector>

#include "server/jobs/job_store.h"

namespace kiln {

struct WebhookPost {
  std::string url;
  std::vector<std::string> fields;  // "name: value"
  std::string body;
  bool private_too = false;  // may go to addresses that are not public
  Millis connect_timeout{5'000}, timeout{15'000};
  const std::atomic<bool>* stop = nullptr;  // once it is true, the try ends within a second
};

/// The status of the answer; 0 when none came: no connection, a refused address, no answer in time. Every address is
/// judged when its socket is made, so a name that resolves to another one the second time gains nothing. Redirects and
/// proxies are not followed; of the answer's body nothing is kept, and no more than 64 KiB are read. Safe from several
/// threads at once.
int post_webhook(const WebhookPost&);

}  // namespace kiln
