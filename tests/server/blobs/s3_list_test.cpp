#include "server/blobs/s3_list.h"

#include <gtest/gtest.h>

namespace kiln {
namespace {

std::string page(const std::string& inside) {
  return "<?xml version='1.0'?><ListBucketResult><Name>b</Name>" + inside + "</ListBucketResult>";
}

const std::string kOne =
    "<Contents><Key>ab/x&amp;y</Key><LastModified>2026-11-22T10:20:30.000Z</LastModified><Size>12</Size></Contents>";

TEST(S3List, HoldsItsObjectsAndTheTokenOfTheNextPage) {
  const auto read =
      read_s3_list(
          page("<IsTruncated>true</IsTruncated><NextContinuationToken>t&lt;1</NextContinuationToken>" + kOne + kOne))
          .value();
  ASSERT_EQ(read.objects.size(), 2U);
  EXPECT_EQ(read.objects[0].key, "ab/x&y");
  EXPECT_EQ(read.objects[0].bytes, 12U);
  EXPECT_EQ(read.objects[0].modified_s, 1795342830);  // date -u -d 2026-11-22T10:20:30 +%s
  EXPECT_EQ(read.next_token, "t<1");
  EXPECT_EQ(read_s3_list(page("<IsTruncated>false</IsTruncated>"))->objects.size(), 0U);
}

TEST(S3List, WhatIsNoListIsRefusedAndNotReadAsAnEmptyOne) {
  for (const std::string& text :
       {std::string(), std::string("<html>proxy error</html>"), page(""), page("<IsTruncated>true</IsTruncated>"),
        page("<IsTruncated>false</IsTruncated><Contents><Key>a</Key>"),
        page("<IsTruncated>false</IsTruncated><Contents><Key>a</Key><Size>x</Size></Contents>")}) {
    EXPECT_EQ(read_s3_list(text).error().code, "blobs_refused") << text;
  }
}

TEST(S3List, EveryPrefixOfAListIsAListOrRefused) {
  const std::string whole = page("<IsTruncated>false</IsTruncated>" + kOne);
  for (std::size_t length = 0; length < whole.size(); ++length)
    static_cast<void>(read_s3_list(whole.substr(0, length)));
  EXPECT_TRUE(read_s3_list(whole));
}

}  // namespace
}  // namespace kiln
