#include "server/webhooks/receivers.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include "server/webhooks/signature.h"

namespace kiln {
namespace {

constexpr std::size_t kMostReceivers = 64;  // a thread each

bool is_receiver_url(std::string_view url, bool private_too) {
  const std::size_t scheme = url.starts_with("https://") ? 8 : private_too && url.starts_with("http://") ? 7 : 0;
  if (scheme == 0 || url.size() > 2000) return false;
  const std::string_view host = url.substr(scheme, url.find_first_of("/?", scheme) - scheme);
  const bool plain = std::ranges::all_of(url, [](unsigned char c) { return c > 0x20 && c < 0x7F; });
  return plain && !host.empty() && host.find('@') == std::string_view::npos && url.find('#') == std::string_view::npos;
}

std::optional<WebhookReceiver> receiver_of_line(const std::string& line, bool private_too) {
  std::istringstream words(line);
  std::string url, secret, tenant, more;
  words >> url >> secret >> tenant;
  auto key = read_webhook_secret(secret);
  if (!is_receiver_url(url, private_too) || !key || words >> more) return std::nullopt;
  WebhookReceiver receiver{std::move(url), std::move(*key), std::nullopt};
  if (tenant.empty()) return receiver;
  constexpr std::string_view kTenant = "tenant=";
  if (!tenant.starts_with(kTenant) || tenant.size() == kTenant.size()) return std::nullopt;
  receiver.tenant = tenant.substr(kTenant.size());
  return receiver;
}

}  // namespace

Result<std::vector<WebhookReceiver>> read_webhook_receivers(const std::string& file, bool private_too) {
  std::ifstream lines(file);
  if (!lines) return fault("bad_webhook_file", "the file of webhooks cannot be read");
  std::vector<WebhookReceiver> receivers;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty() || line.starts_with('#')) continue;
    auto receiver = receiver_of_line(line, private_too);
    const std::string where = "line " + std::to_string(number);
    if (!receiver) {
      return fault("bad_webhook_file",
                   "a line is https://address, whsec_SECRET, and tenant=NAME if wanted (http:// with private addresses "
                   "alone), which line " +
                       std::to_string(number) + " is not",
                   where);
    }
    if (std::ranges::find(receivers, receiver->url, &WebhookReceiver::url) != receivers.end()) {
      return fault("bad_webhook_file", where + " names a receiver again", where);
    }
    receivers.push_back(std::move(*receiver));
  }
  if (receivers.empty()) return fault("bad_webhook_file", "the file of webhooks names no receiver");
  if (receivers.size() > kMostReceivers) return fault("bad_webhook_file", "the file of webhooks names more than 64");
  return receivers;
}

}  // namespace kiln
