// Uploading and submitting.
#include <nlohmann/json.hpp>

#include "client_cli/remote.h"
#include "core/base/sha256.h"

namespace kiln {
namespace {

using nlohmann::json;

constexpr const char* kBytes = "application/octet-stream";

std::string_view view_of(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A field value inside quotes, as browsers write it.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"')
      out += "%22";
    else if (c == '\r')
      out += "%0D";
    else if (c == '\n')
      out += "%0A";
    else
      out += c;
  }
  return out + "\"";
}

/// A multipart/form-data body. Heads are kept here, contents stay with their owners.
struct Form {
  std::string boundary;
  std::vector<std::string> heads;
  std::vector<std::string_view> contents;

  void add(const std::string& name, const std::string& file, const std::string& type, std::string_view content) {
    std::string head =
        (heads.empty() ? "--" : "\r\n--") + boundary + "\r\nContent-Disposition: form-data; name=" + quoted(name);
    if (!file.empty()) head += "; filename=" + quoted(file);
    heads.push_back(head + "\r\nContent-Type: " + type + "\r\n\r\n");
    contents.push_back(content);
  }
  HttpBody body() {
    heads.push_back("\r\n--" + boundary + "--\r\n");
    HttpBody out{"multipart/form-data; boundary=" + boundary, {}};
    for (std::size_t i = 0; i < contents.size(); ++i) {
      out.pieces.push_back(heads[i]);
      out.pieces.push_back(contents[i]);
    }
    out.pieces.push_back(heads.back());
    return out;
  }
};

HttpHeaders headers_of(const JobInput& input) {
  if (input.idempotency_key.empty()) return {};
  return {{"Idempotency-Key", input.idempotency_key}};
}

/// The scene as an asset, the recipe as JSON.
Outcome<HttpReply> post_with_asset(ServerLink& link, const std::string& path, const JobInput& input) {
  KILN_TRY(hash, upload_asset(link, input.scene.main, input.scene.name));
  json document = json::parse(input.recipe.document);
  document["scene"] = {{"asset", hash}};
  const std::string text = document.dump();
  return link.post(path, headers_of(input), {"application/json", {text}});
}

/// Everything in one form: a .gltf and the files that it names.
Outcome<HttpReply> post_form(ServerLink& link, const std::string& path, const JobInput& input) {
  Form form{"kiln-" + sha256_hex(input.scene.main), {}, {}};  // a boundary that no content holds by chance
  form.add("job", "", "application/json", input.recipe.document);
  form.add("scene", input.scene.name, kBytes, view_of(input.scene.main));
  for (const auto& [uri, bytes] : input.scene.resources) form.add("resource", uri, kBytes, view_of(bytes));
  return link.post(path, headers_of(input), form.body());
}

Outcome<HttpReply> post_job(ServerLink& link, const std::string& path, const JobInput& input) {
  if (!input.recipe.environment.empty()) {
    const auto sent = upload_asset(link, input.recipe.environment, input.recipe.environment_name);
    if (!sent) return tl::make_unexpected(sent.error());
  }
  return input.scene.resources.empty() ? post_with_asset(link, path, input) : post_form(link, path, input);
}

}  // namespace

Outcome<std::string> upload_asset(ServerLink& link, std::span<const std::uint8_t> bytes, const std::string& name) {
  const std::string hash = sha256_hex(bytes);
  KILN_TRY(known, link.head("/v1/assets/" + hash));
  if (known == 200) return hash;
  say("uploading " + name + ", " + human_bytes(static_cast<double>(bytes.size())));
  const auto sent = link.put("/v1/assets/" + hash, {}, {kBytes, {view_of(bytes)}});
  if (!sent) return tl::make_unexpected(sent.error());
  return hash;
}

Outcome<JobReply> submit_job(ServerLink& link, const JobInput& input) {
  KILN_TRY(reply, post_job(link, "/v1/jobs", input));
  return or_failure(parse_job(reply.body));
}

Outcome<std::string> request_plan(ServerLink& link, const JobInput& input) {
  KILN_TRY(reply, post_job(link, "/v1/plan", input));
  return reply.body;
}

}  // namespace kiln
