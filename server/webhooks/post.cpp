#include "server/webhooks/post.h"

#include <curl/curl.h>
#include <sys/socket.h>

#include <memory>
#include <mutex>

#include "server/webhooks/address.h"

namespace kiln {
namespace {

constexpr std::size_t kMostAnswer = 64U << 10;

struct EndHandle {
  void operator()(CURL* handle) const { curl_easy_cleanup(handle); }
};
struct EndList {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

/// Called with the very address that the connection goes to.
curl_socket_t open_socket(void* private_too, curlsocktype, curl_sockaddr* to) {
  if (private_too == nullptr && !is_public_address(to->addr)) return CURL_SOCKET_BAD;
  return ::socket(to->family, to->socktype | SOCK_CLOEXEC, to->protocol);
}

int end_when_stopped(void* stop, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<const std::atomic<bool>*>(stop)->load() ? 1 : 0;
}

std::size_t pass_over(char*, std::size_t size, std::size_t count, void* read) {
  std::size_t& bytes = *static_cast<std::size_t*>(read);
  bytes += size * count;
  return bytes <= kMostAnswer ? size * count : 0;
}

}  // namespace

int post_webhook(const WebhookPost& post) {
  static std::once_flag once;
  std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
  const std::unique_ptr<CURL, EndHandle> handle(curl_easy_init());
  if (!handle) return 0;
  std::unique_ptr<curl_slist, EndList> fields;
  for (const std::string& field : post.fields) {
    curl_slist* longer = curl_slist_append(fields.get(), field.c_str());
    if (longer == nullptr) return 0;
    static_cast<void>(fields.release());
    fields.reset(longer);
  }
  bool allowed = true;
  std::size_t answer_bytes = 0;
  const auto set = [&](CURLoption option, auto value) { curl_easy_setopt(handle.get(), option, value); };
  set(CURLOPT_URL, post.url.c_str());
  set(CURLOPT_PROTOCOLS_STR, post.private_too ? "http,https" : "https");
  set(CURLOPT_FOLLOWLOCATION, 0L);
  set(CURLOPT_PROXY, "");
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_QUICK_EXIT, 1L);  // a try that is over does not wait for a name server that is silent
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(post.connect_timeout.count()));
  set(CURLOPT_TIMEOUT_MS, static_cast<long>(post.timeout.count()));
  set(CURLOPT_OPENSOCKETFUNCTION, open_socket);
  set(CURLOPT_OPENSOCKETDATA, post.private_too ? &allowed : nullptr);
  set(CURLOPT_POST, 1L);
  set(CURLOPT_POSTFIELDS, post.body.c_str());
  set(CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(post.body.size()));
  set(CURLOPT_HTTPHEADER, fields.get());
  set(CURLOPT_WRITEFUNCTION, pass_over);
  set(CURLOPT_WRITEDATA, &answer_bytes);
  if (post.stop != nullptr) {
    set(CURLOPT_NOPROGRESS, 0L);
    set(CURLOPT_XFERINFOFUNCTION, end_when_stopped);
    set(CURLOPT_XFERINFODATA, post.stop);
  }
  const CURLcode done = curl_easy_perform(handle.get());
  if (done != CURLE_OK && done != CURLE_WRITE_ERROR) return 0;
  long status = 0;
  curl_easy_getinfo(handle.get(), CURLINFO_RESPONSE_CODE, &status);
  return static_cast<int>(status);
}

}  // namespace kiln
