#include "server/blobs/s3_client.h"

#include <curl/curl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <thread>

#include "server/blobs/blob_io.h"

namespace kiln {
namespace {

constexpr const char* kEmptyHash = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
constexpr std::size_t kMaxList = 8U << 20;  // a page of 1000 keys is some 300 kB

struct FreeList {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

bool worth_another_try(long status) { return status == 0 || status == 408 || status == 429 || status >= 500; }

/// Everything but letters, digits and -._~ , as signatures want it.
std::string encoded(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || std::strchr("-._~", c) != nullptr) {
      out += c;
    } else {
      constexpr const char* kHex = "0123456789ABCDEF";
      const auto byte = static_cast<unsigned char>(c);
      out += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

}  // namespace

struct S3Client::Request {
  const char* method = "GET";
  std::string path;   // "/ab/..." below the bucket
  std::string query;  // sorted and encoded: so libcurl signs it right
  std::string sha256 = kEmptyHash;
  int fd = -1;  // a body from this file
  std::uint64_t bytes = 0;
  std::string range;
  std::function<void()> begin;
  Take take;
};

namespace {

/// What curl's callbacks work on during one try.
struct Transfer {
  CURL* handle;
  int fd;
  std::int64_t sent = 0;
  const S3Client::Take* take;
};

std::size_t send_piece(char* out, std::size_t size, std::size_t count, void* context) {
  auto& transfer = *static_cast<Transfer*>(context);
  const ssize_t got = retry_interrupted([&] { return ::pread(transfer.fd, out, size * count, transfer.sent); });
  if (got < 0) return CURL_READFUNC_ABORT;
  transfer.sent += got;
  return static_cast<std::size_t>(got);
}

int rewind_body(void* context, curl_off_t offset, int origin) {
  if (origin != SEEK_SET) return CURL_SEEKFUNC_CANTSEEK;
  static_cast<Transfer*>(context)->sent = offset;
  return CURL_SEEKFUNC_OK;
}

std::size_t take_piece(char* bytes, std::size_t size, std::size_t count, void* context) {
  const auto& transfer = *static_cast<Transfer*>(context);
  long status = 0;
  curl_easy_getinfo(transfer.handle, CURLINFO_RESPONSE_CODE, &status);
  const bool wanted = status >= 200 && status < 300 && *transfer.take;  // the text of an error is not for us
  if (!wanted) return size * count;
  const bool more = (*transfer.take)({reinterpret_cast<const std::uint8_t*>(bytes), size * count});
  return more ? size * count : 0;
}

}  // namespace

S3Client::S3Client(S3Options options) : options_(std::move(options)) {
  static std::once_flag once;
  std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
}

S3Client::~S3Client() {
  for (void* handle : idle_) curl_easy_cleanup(handle);
}

void* S3Client::take_handle() {
  const std::lock_guard lock(mutex_);
  if (idle_.empty()) return curl_easy_init();
  void* handle = idle_.back();
  idle_.pop_back();
  return handle;
}

void S3Client::keep_handle(void* handle) {
  curl_easy_reset(handle);  // its connections stay
  const std::lock_guard lock(mutex_);
  idle_.push_back(handle);
}

S3Client::Reply S3Client::once(const Request& request, void* handle) {
  const std::string url = options_.endpoint + "/" + options_.bucket + request.path + request.query;
  const std::string signature = "aws:amz:" + options_.region + ":s3";
  const std::unique_ptr<curl_slist, FreeList> fields(
      curl_slist_append(nullptr, ("x-amz-content-sha256: " + request.sha256).c_str()));
  Transfer transfer{handle, request.fd, 0, &request.take};
  const auto set = [&](CURLoption option, auto value) { curl_easy_setopt(handle, option, value); };
  set(CURLOPT_URL, url.c_str());
  set(CURLOPT_AWS_SIGV4, signature.c_str());
  set(CURLOPT_USERNAME, options_.key.c_str());
  set(CURLOPT_PASSWORD, options_.secret.c_str());
  set(CURLOPT_HTTPHEADER, fields.get());
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_FOLLOWLOCATION, 0L);
  set(CURLOPT_PROXY, "");
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(options_.connect_timeout.count()));
  set(CURLOPT_LOW_SPEED_LIMIT, 1024L);
  set(CURLOPT_LOW_SPEED_TIME, static_cast<long>(options_.stall_timeout.count()));
  set(CURLOPT_WRITEFUNCTION, take_piece);
  set(CURLOPT_WRITEDATA, &transfer);
  if (request.fd >= 0) {
    set(CURLOPT_UPLOAD, 1L);
    set(CURLOPT_INFILESIZE_LARGE, static_cast<curl_off_t>(request.bytes));
    set(CURLOPT_READFUNCTION, send_piece);
    set(CURLOPT_READDATA, &transfer);
    set(CURLOPT_SEEKFUNCTION, rewind_body);
    set(CURLOPT_SEEKDATA, &transfer);
  } else if (std::strcmp(request.method, "HEAD") == 0) {
    set(CURLOPT_NOBODY, 1L);
  } else {
    set(CURLOPT_CUSTOMREQUEST, request.method);
  }
  if (!request.range.empty()) set(CURLOPT_RANGE, request.range.c_str());
  if (request.begin) request.begin();
  if (curl_easy_perform(handle) != CURLE_OK) return {};
  Reply reply;
  curl_off_t length = 0;
  curl_easy_getinfo(handle, CURLINFO_RESPONSE_CODE, &reply.status);
  curl_easy_getinfo(handle, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
  reply.length = static_cast<std::uint64_t>(std::max<curl_off_t>(length, 0));
  return reply;
}

Result<S3Client::Reply> S3Client::perform(const Request& request) {
  Reply reply;
  auto pause = options_.first_pause;
  for (int attempt = 0; attempt < options_.tries; ++attempt, pause *= 2) {
    if (attempt > 0) std::this_thread::sleep_for(pause);
    void* handle = take_handle();
    if (handle == nullptr) return fault("io_failed", "the server could not start a transfer");
    reply = once(request, handle);
    keep_handle(handle);
    if (!worth_another_try(reply.status) || reply.status == 507) break;
  }
  if (reply.status >= 200 && reply.status < 300) return reply;
  if (reply.status == 404) return fault("not_found", "there is no such blob");
  if (reply.status == 507) return fault("disk_full", "the blob store has no space left");
  const std::string status = " (status " + std::to_string(reply.status) + ")";
  if (worth_another_try(reply.status)) {
    return fault("blobs_unavailable", "the blob store does not answer as it should" + status);
  }
  return fault("blobs_refused", "the blob store refuses this server's requests" + status);
}

Result<void> S3Client::put(const std::string& key, const std::string& sha256, int fd, std::uint64_t bytes) {
  Request request;
  request.method = "PUT";
  request.path = "/" + key;
  request.sha256 = sha256;
  request.fd = fd;
  request.bytes = bytes;
  KILN_TRY(reply, perform(request));
  static_cast<void>(reply);
  return {};
}

Result<std::uint64_t> S3Client::size_of(const std::string& key) {
  Request request;
  request.method = "HEAD";
  request.path = "/" + key;
  KILN_TRY(reply, perform(request));
  return reply.length;
}

Result<void> S3Client::get(const std::string& key, const std::function<void()>& begin, const Take& take) {
  Request request;
  request.path = "/" + key;
  request.begin = begin;
  request.take = take;
  KILN_TRY(reply, perform(request));
  static_cast<void>(reply);
  return {};
}

Result<void> S3Client::get_range(const std::string& key, std::uint64_t offset, std::span<std::uint8_t> out) {
  std::size_t filled = 0;
  Request request;
  request.path = "/" + key;
  request.range = std::to_string(offset) + "-" + std::to_string(offset + out.size() - 1);
  request.begin = [&] { filled = 0; };
  request.take = [&](std::span<const std::uint8_t> piece) {
    if (piece.size() > out.size() - filled) return false;  // more than was asked for
    std::ranges::copy(piece, out.begin() + static_cast<std::ptrdiff_t>(filled));
    filled += piece.size();
    return true;
  };
  KILN_TRY(reply, perform(request));
  if (reply.status == 206 && filled == out.size()) return {};
  return fault("blobs_unavailable", "the blob store sent another part of a blob than was asked for");
}

Result<void> S3Client::remove(const std::string& key) {
  Request request;
  request.method = "DELETE";
  request.path = "/" + key;
  const auto reply = perform(request);
  if (reply || reply.error().code == "not_found") return {};
  return tl::make_unexpected(reply.error());
}

Result<std::string> S3Client::list(const std::string& token) {
  std::string text;
  Request request;
  request.query = token.empty() ? "?list-type=2&max-keys=1000"
                                : "?continuation-token=" + encoded(token) + "&list-type=2&max-keys=1000";
  request.begin = [&] { text.clear(); };
  request.take = [&](std::span<const std::uint8_t> piece) {
    text.append(reinterpret_cast<const char*>(piece.data()), piece.size());
    return text.size() <= kMaxList;
  };
  KILN_TRY(reply, perform(request));
  static_cast<void>(reply);
  return text;
}

Result<void> S3Client::check() {
  Request request;
  request.method = "HEAD";
  const auto reply = perform(request);
  if (reply) return {};
  if (reply.error().code == "not_found") return fault("blobs_refused", "the blob store has no such bucket");
  return tl::make_unexpected(reply.error());
}

}  // namespace kiln
