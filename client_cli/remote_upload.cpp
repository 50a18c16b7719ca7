// Uploading and submitting.
#include <nlohmann/json.hpp>

#include "client_cli/remote.h"
#include "core/base/sha256.h"

namespace kiln {
namespace {

using nlohmann::json;

constexpr const char* kBytes = "application/octet-stream";
constexpr std::size_t kPutBytes = 16u << 20;  // more goes in pieces
constexpr int kUploadTries = 3;               // an upload that broke goes on where it broke

std::string_view view_of(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A field value inside quotes (RFC 7578 by way of RFC 2183: a backslash escapes).
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c != '\r' && c != '\n') out += c;
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

/// The job document; a scene of one file is uploaded apart, so that a known one is not sent again.
Outcome<std::string> job_document(ServerLink& link, const JobInput& input) {
  json document = json::parse(input.recipe.document);
  if (input.scene.resources.empty()) {
    KILN_TRY(hash, upload_asset(link, input.scene.main, input.scene.name));
    document["scene"] = {{"asset", hash}};
  }
  return document.dump();
}

/// Files that keep their names: a .gltf and what it refers to, and the environment.
Form job_form(const JobInput& input, const std::string& document) {
  Form form{"kiln-" + sha256_hex(input.scene.main), {}, {}};  // a boundary that no content holds by chance
  form.add("job", "", "application/json", document);
  const LoadedRecipe& recipe = input.recipe;
  if (!recipe.environment.empty())
    form.add("environment", recipe.environment_name, kBytes, view_of(recipe.environment));
  if (input.scene.resources.empty()) return form;
  form.add("scene", input.scene.name, kBytes, view_of(input.scene.main));
  for (const auto& [uri, bytes] : input.scene.resources) form.add("resource", uri, kBytes, view_of(bytes));
  return form;
}

Outcome<HttpReply> post_job(ServerLink& link, const std::string& path, const JobInput& input) {
  KILN_TRY(document, job_document(link, input));
  if (input.recipe.environment.empty() && input.scene.resources.empty())
    return link.post(path, headers_of(input), {"application/json", {document}});
  Form form = job_form(input, document);
  return link.post(path, headers_of(input), form.body());
}

}  // namespace

Outcome<std::string> upload_asset(ServerLink& link, std::span<const std::uint8_t> bytes, const std::string& name) {
  const std::string hash = sha256_hex(bytes), path = "/v1/assets/" + hash;
  for (int attempt = 0;; ++attempt) {
    KILN_TRY(known, link.head(path));
    if (known.status == 200) return hash;
    const std::uint64_t start = known.upload_offset < bytes.size() ? known.upload_offset : 0;
    if (bytes.size() > kPutBytes) {
      say("uploading " + name + ", " + human_bytes(static_cast<double>(bytes.size())));
      KILN_TRY(sent, upload_in_pieces(link, bytes, hash));
      if (sent) return hash;
    }
    say((start > 0 ? "going on with " : "uploading ") + name + ", " +
        human_bytes(static_cast<double>(bytes.size() - start)));
    const auto sent =
        link.put(path, {{"Upload-Offset", std::to_string(start)}}, {kBytes, {view_of(bytes.subspan(start))}});
    if (sent) return hash;
    if (sent.error().exit != ExitCode::unreachable || attempt == kUploadTries) return tl::make_unexpected(sent.error());
    if (!sleep_unless_interrupted(1, link.session().interrupt)) return interrupted();
  }
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
