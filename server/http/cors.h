#pragma once
// Pages of other origins, as far as an exact list allows them (https://fetch.spec.whatwg.org/#http-cors-protocol).
// Without a list there is no CORS at all. Cookies are not used here, so credentials are never allowed.

#include <string>
#include <vector>

#include "server/http/message.h"

namespace kiln {

/// "https://studio.example" or "http://localhost:5173": scheme, host and port in lower case, as a browser sends it.
bool is_origin(const std::string&);

class Cors {
 public:
  explicit Cors(std::vector<std::string> origins) : origins_(std::move(origins)) {}
  /// The request comes from a page of a listed origin.
  bool allows(const Head&) const;
  /// A browser asks whether such a page may send what it wants to send.
  bool is_preflight(const Head&) const;
  /// The answer to that; `reply` is the one to OPTIONS and names the methods in Allow.
  static Reply preflight(const Reply& reply);
  /// Lets the page read the reply, and tells caches that others may not.
  void open(Reply&, const Head&) const;

 private:
  std::vector<std::string> origins_;
};

}  // namespace kiln
