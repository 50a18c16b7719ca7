// Uploads in pieces (tus 1.0), and S3 of reliability.md 3.4, against a service with real blobs.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/base64.h"
#include "core/base/sha256.h"
#include "server/api/upload_fields.h"
#include "server/blobs/file_blobs.h"
#include "server/blobs/partial_upload.h"
#include "tests/server/http/raw_client.h"

namespace kiln {
namespace {

using nlohmann::json;

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}
std::string sha_of(const std::string& text) { return sha256_hex(bytes_of(text)); }
std::string base64_of(const std::string& text) { return base64_encode(bytes_of(text)); }
std::string checksum_of(DigestKind kind, const std::string& text) {
  Digest digest(kind);
  digest.update(bytes_of(text));
  return base64_encode(digest.bytes());
}

const std::string kTus = "Tus-Resumable: 1.0.0";
const std::string kText = "a scene that comes in pieces";

class Uploads : public ::testing::Test {
 protected:
  RawReply begin(std::vector<std::string> lines) {
    lines.push_back(kTus);
    lines.emplace_back("Content-Length: 0");
    return server_.raw(request_text("POST", "/v1/uploads", lines));
  }
  std::string begin() { return begin({"Upload-Length: " + std::to_string(kText.size())}).fields.at("location"); }
  RawReply patch(const std::string& upload, std::size_t offset, const std::string& bytes,
                 std::vector<std::string> lines = {}) {
    lines.insert(lines.end(),
                 {kTus, "Upload-Offset: " + std::to_string(offset), "Content-Type: application/offset+octet-stream"});
    return server_.raw(request_text("PATCH", upload, lines, bytes));
  }
  RawReply head(const std::string& upload) { return server_.raw(request_text("HEAD", upload, {kTus})); }
  RunningServer server_;
};

TEST_F(Uploads, TheServerSaysWhatItSpeaks) {
  RawReply reply = server_.raw(request_text("OPTIONS", "/v1/uploads"));
  EXPECT_EQ(reply.status, 204);
  EXPECT_EQ(reply.fields["tus-resumable"], "1.0.0");
  EXPECT_EQ(reply.fields["tus-version"], "1.0.0");
  EXPECT_EQ(reply.fields["tus-extension"], "creation,checksum,expiration,termination");
  EXPECT_EQ(reply.fields["tus-checksum-algorithm"], "sha256,sha1");
  EXPECT_EQ(reply.fields["tus-max-size"], std::to_string(few_threads().max_upload_bytes));
}

TEST_F(Uploads, AFileInPiecesBecomesAnAsset) {
  RawReply begun = begin({"Upload-Length: 28", "Upload-Metadata: filename " + base64_of("a.glb")});
  ASSERT_EQ(begun.status, 201) << begun.all;
  EXPECT_EQ(begun.fields["upload-offset"], "0");
  EXPECT_EQ(begun.fields["upload-expires"].size(), 29U);
  const std::string upload = begun.fields["location"];
  RawReply first = patch(upload, 0, kText.substr(0, 10));
  EXPECT_EQ(first.status, 204) << first.all;
  EXPECT_EQ(first.fields["upload-offset"], "10");
  EXPECT_EQ(first.fields["tus-resumable"], "1.0.0");
  RawReply known = head(upload);
  EXPECT_EQ(known.status, 200);
  EXPECT_EQ(known.fields["upload-offset"], "10");
  EXPECT_EQ(known.fields["upload-length"], "28");
  EXPECT_EQ(known.fields["upload-metadata"], "filename " + base64_of("a.glb"));
  EXPECT_EQ(known.fields["cache-control"], "no-store");
  RawReply last = patch(upload, 10, kText.substr(10));
  EXPECT_EQ(last.status, 204);
  EXPECT_EQ(last.fields["upload-asset"], sha_of(kText));
  EXPECT_EQ(server_.get("/v1/assets/" + sha_of(kText)).body, kText);
  const json shown = json::parse(server_.get(upload).body);
  EXPECT_EQ(shown["asset"], sha_of(kText));
  EXPECT_EQ(shown["offset"], 28);
  EXPECT_EQ(head(upload).fields["upload-offset"], "28") << "a client that missed the last answer asks";
}

TEST_F(Uploads, S3AnOffsetThatDoesNotFitIs409AndAPieceBeyondTheEnd413) {
  const std::string upload = begin();
  ASSERT_EQ(patch(upload, 0, "a scene").status, 204);
  EXPECT_EQ(patch(upload, 0, "a scene").status, 409);
  EXPECT_EQ(patch(upload, 8, "x").status, 409);
  EXPECT_EQ(patch(upload, 7, kText).status, 413);
  EXPECT_EQ(head(upload).fields["upload-offset"], "7");
}

TEST_F(Uploads, S3OtherBytesThanAnnouncedAreRefusedAndNoBlobStays) {
  const auto begun = begin({"Upload-Length: 28", "Upload-Metadata: sha256 " + base64_of(sha_of("something else"))});
  const std::string upload = begun.fields.at("location");
  EXPECT_EQ(patch(upload, 0, kText).status, 422);
  EXPECT_EQ(server_.get("/v1/assets/" + sha_of(kText)).status, 404);
  EXPECT_EQ(head(upload).status, 404);
}

TEST_F(Uploads, APieceWithAWrongChecksumDoesNotCount) {
  const std::string upload = begin();
  for (const auto& [name, kind] : {std::pair{"sha1", DigestKind::sha1}, std::pair{"sha256", DigestKind::sha256}}) {
    const std::string field = std::string("Upload-Checksum: ") + name + " ";
    RawReply wrong = patch(upload, 0, "a scene", {field + checksum_of(kind, "a screen")});
    EXPECT_EQ(wrong.status, 460);
    EXPECT_EQ(head(upload).fields["upload-offset"], "0");
    EXPECT_EQ(patch(upload, 0, "a scene", {field + "AAAA"}).status, 400);
  }
  EXPECT_EQ(patch(upload, 0, "a scene", {"Upload-Checksum: md5 AAAA"}).status, 400);
  EXPECT_EQ(patch(upload, 0, "a scene", {"Upload-Checksum: sha1 " + checksum_of(DigestKind::sha1, "a scene")}).status,
            204);
  EXPECT_EQ(head(upload).fields["upload-offset"], "7");
}

TEST_F(Uploads, ACutPieceCountsAsFarAsItCameUnlessItHasAChecksum) {
  for (const bool checked : {false, true}) {
    const std::string upload = begin();
    RawConnection cut(server_.port());
    cut.send("PATCH " + upload + " HTTP/1.1\r\nHost: 127.0.0.1\r\n" + kTus +
             "\r\nUpload-Offset: 0\r\nContent-Type: application/offset+octet-stream\r\nContent-Length: 28\r\n" +
             (checked ? "Upload-Checksum: sha256 " + checksum_of(DigestKind::sha256, kText) + "\r\n" : "") +
             "\r\na scene");
    cut.shut();
    EXPECT_EQ(cut.read_reply().status, 400);
    EXPECT_EQ(head(upload).fields["upload-offset"], checked ? "0" : "7");
  }
}

TEST_F(Uploads, S3TwoWritersAtOnceAreOneTooMany) {
  const std::string upload = begin();
  RawConnection first(server_.port());
  first.send("PATCH " + upload + " HTTP/1.1\r\nHost: 127.0.0.1\r\n" + kTus +
             "\r\nUpload-Offset: 0\r\nContent-Type: application/offset+octet-stream\r\nContent-Length: 28\r\n"
             "Expect: 100-continue\r\n\r\n");
  first.read_until("100 Continue");
  EXPECT_EQ(patch(upload, 0, kText).status, 409);
  EXPECT_EQ(server_.raw(request_text("DELETE", upload, {kTus})).status, 409);
  first.send(kText);
  EXPECT_NE(first.read_until("204").find("204"), std::string::npos);
}

TEST_F(Uploads, AreGivenUpByDelete) {
  const std::string upload = begin();
  patch(upload, 0, "a scene");
  EXPECT_EQ(server_.raw(request_text("DELETE", upload, {kTus})).status, 204);
  EXPECT_EQ(head(upload).status, 404);
  EXPECT_EQ(patch(upload, 7, "x").status, 404);
  EXPECT_EQ(server_.raw(request_text("DELETE", upload, {kTus})).status, 404);
}

TEST_F(Uploads, AskedForAgainWithTheSameHashGoOn) {
  const std::vector<std::string> lines{"Upload-Length: 28", "Upload-Metadata: sha256 " + base64_of(sha_of(kText))};
  const std::string upload = begin(lines).fields.at("location");
  patch(upload, 0, "a scene");
  RawReply again = begin(lines);
  EXPECT_EQ(again.status, 201);
  EXPECT_EQ(again.fields["location"], upload);
  EXPECT_EQ(again.fields["upload-offset"], "7");
}

TEST_F(Uploads, ARequestWithoutTheVersionIs412) {
  const std::string upload = begin();
  RawReply reply = server_.raw(request_text("POST", "/v1/uploads", {"Upload-Length: 9", "Content-Length: 0"}));
  EXPECT_EQ(reply.status, 412);
  EXPECT_EQ(reply.fields["tus-version"], "1.0.0");
  for (const char* method : {"HEAD", "DELETE"}) {
    EXPECT_EQ(server_.raw(request_text(method, upload, {"Tus-Resumable: 0.2.2"})).status, 412) << method;
  }
  EXPECT_EQ(server_.get(upload).status, 200) << "a person with curl may look";
}

TEST_F(Uploads, LengthAndMetadataHaveBounds) {
  const auto status = [&](const std::string& line, const std::string& length = "28") {
    return begin({"Upload-Length: " + length, line}).status;
  };
  EXPECT_EQ(begin({}).status, 400);
  EXPECT_EQ(status("Upload-Defer-Length: 1", "x"), 400);
  EXPECT_EQ(status("Upload-Metadata: ", "0"), 422);
  EXPECT_EQ(status("Upload-Metadata: ", "-1"), 400);
  EXPECT_EQ(status("Upload-Metadata: ", "999999999999999999"), 413);
  EXPECT_EQ(status("Upload-Metadata: filename " + base64_of(std::string(3000, 'x'))), 201);
  EXPECT_EQ(status("Upload-Metadata: filename " + base64_of(std::string(4000, 'x'))), 400);
  EXPECT_EQ(status("Upload-Metadata: filename !!!!"), 400);
  EXPECT_EQ(status("Upload-Metadata: a AAAA,a AAAA"), 400);
  EXPECT_EQ(status("Upload-Metadata: sha256 AAAA"), 400);
  EXPECT_EQ(status("Upload-Metadata: is_confidential, filename AAAA"), 201) << "a value may be missing";
  std::string many = "Upload-Metadata: a0";
  for (int i = 1; i < 17; ++i) many += ",a" + std::to_string(i);
  EXPECT_EQ(status(many), 400);
  const std::string upload = begin();
  EXPECT_EQ(
      server_.raw(request_text("PATCH", upload, {kTus, "Upload-Offset: 0", "Content-Type: text/plain"}, "x")).status,
      415);
}

TEST_F(Uploads, S4AHundredUnfinishedOnesAreEnough) {
  for (int i = 0; i < UploadDesk::kMostUnfinished; ++i) ASSERT_EQ(begin({"Upload-Length: 28"}).status, 201) << i;
  RawReply refused = begin({"Upload-Length: 28"});
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(refused.fields.count("retry-after"), 1U);
}

TEST_F(Uploads, WhileSomebodyMakesAnAssetOfItAnUploadIsWholeAndNotBusy) {
  const std::string upload = begin(), id = upload.substr(upload.rfind('/') + 1);
  const auto blobs = open_file_blobs(server_.service().folder()).value();
  PartialUploads uploads(*blobs);  // another server with the same spool, which dies before it makes the asset
  {
    auto writer = uploads.append(uploads.find(id, "").value(), 0).value();
    ASSERT_TRUE(writer.write(bytes_of(kText)));
    ASSERT_TRUE(writer.keep());
  }
  {
    const auto holder = uploads.append(uploads.find(id, "").value(), kText.size());
    ASSERT_TRUE(holder);
    RawReply whole = head(upload);
    EXPECT_EQ(whole.status, 200);
    EXPECT_EQ(whole.fields["upload-offset"], std::to_string(kText.size()));
    EXPECT_FALSE(whole.fields.contains("upload-asset"));
    EXPECT_EQ(patch(upload, kText.size(), "", {"Content-Length: 0"}).status, 409) << "one writer at a time";
  }
  EXPECT_EQ(head(upload).fields["upload-asset"], sha_of(kText));
}

TEST(UploadFields, ADateIsTheOneOfHttp) {
  EXPECT_EQ(http_date(784111777), "Sun, 06 Nov 1994 08:49:37 GMT");  // RFC 9110 5.6.7
}

TEST(UploadTenants, SeeTheirOwnAlone) {
  const std::string ours(43, 'o'), theirs(43, 't');
  HttpOptions options = few_threads();
  for (const auto& [token, tenant] : {std::pair{ours, "ours"}, std::pair{theirs, "theirs"}}) {
    AccessToken one;
    one.hash = sha_of(token);
    one.tenant = tenant;
    one.admin = false;
    options.tokens.push_back(one);
  }
  RunningServer server(options);
  const auto ask = [&](const char* method, const std::string& path, const std::string& token) {
    return server.raw(request_text(method, path,
                                   {kTus, "Authorization: Bearer " + token, "Upload-Length: 28", "Upload-Offset: 0",
                                    "Content-Length: 0", "Content-Type: application/offset+octet-stream"}));
  };
  const std::string upload = ask("POST", "/v1/uploads", ours).fields.at("location");
  EXPECT_EQ(ask("HEAD", upload, ours).status, 200);
  EXPECT_EQ(ask("PATCH", upload, ours).status, 204);
  for (const char* method : {"HEAD", "GET", "PATCH", "DELETE"}) EXPECT_EQ(ask(method, upload, theirs).status, 404);
}

}  // namespace
}  // namespace kiln
