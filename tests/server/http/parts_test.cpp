// The pieces below the routes: heads, escapes, forms, the queue of those who wait.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <thread>

#include "core/base/random.h"
#include "server/http/multipart.h"
#include "server/http/parse_head.h"
#include "server/http/work_queue.h"

namespace kiln {
namespace {

class Text : public BodySource {
 public:
  Text(std::string text, std::size_t piece) : text_(std::move(text)), piece_(piece) {}
  std::uint64_t length() const override { return text_.size(); }
  std::uint64_t taken() const override { return at_; }
  Answer<std::size_t> read(std::span<std::uint8_t> out) override {
    const std::size_t count = std::min({piece_, out.size(), text_.size() - at_});
    std::copy_n(text_.data() + at_, count, out.data());
    at_ += count;
    return count;
  }

 private:
  std::string text_;
  std::size_t piece_, at_ = 0;
};

Head form_head(const std::string& type) {
  Head head;
  head.fields.push_back({"content-type", type});
  return head;
}

TEST(ParseHead, DecodesPathAndQuery) {
  const auto head = parse_head("GET /a%20b/%C3%A9?x=1+2&y=%26&z HTTP/1.1\r\nHost: h\r\nAccept:  a \r\n\r\n");
  ASSERT_TRUE(head.has_value());
  EXPECT_EQ(head->path, "/a b/\xC3\xA9");
  EXPECT_EQ(head->params, (QueryParams{{"x", "1 2"}, {"y", "&"}, {"z", ""}}));
  EXPECT_EQ(field_of(*head, "accept"), "a");
}

TEST(ParseHead, WhateverIsAcceptedHasOnePathOneLengthAndNoControlBytes) {
  const std::string good =
      "PUT /v1/jobs?preset=prt&label=%C3%A9 HTTP/1.1\r\nHost: a\r\nContent-Length: 12\r\nX-Y: z%20\r\nRange: "
      "bytes=0-1\r\n\r\n";
  const std::string spice = std::string("\r\n\0\t %:?&=/#\x7f\xff\xc3", 16) + "0aAhH";
  int accepted = 0;
  for (std::uint64_t round = 0; round < 50'000; ++round) {
    Random random(1, round);
    std::string text = good;
    const int changes = 1 + static_cast<int>(random.next() % 4);
    for (int i = 0; i < changes; ++i) {
      const std::size_t at = random.next() % text.size();
      const char c = spice[random.next() % spice.size()];
      if (random.next() % 3 == 0)
        text.insert(at, 1, c);
      else if (random.next() % 2 == 0)
        text.erase(at, 1 + random.next() % 3);
      else
        text[at] = c;
      if (text.empty()) text = "x";
    }
    const auto head = parse_head(text);
    if (!head) continue;
    ++accepted;
    const auto clean = [](const std::string& value) {
      return std::none_of(value.begin(), value.end(),
                          [](char c) { return (c >= 0 && c < ' ' && c != '\t') || c == 0x7f; });
    };
    ASSERT_TRUE(head->path.starts_with('/') && clean(head->path)) << text;
    for (const auto& [name, value] : head->params) ASSERT_TRUE(clean(name) && clean(value)) << text;
    for (const Field& field : head->fields)
      ASSERT_TRUE(!field.name.empty() && clean(field.name) && clean(field.value)) << text;
    ASSERT_LE(count_fields(*head, "content-length"), 1U) << text;
    ASSERT_EQ(count_fields(*head, "transfer-encoding"), 0U) << text;
  }
  EXPECT_GT(accepted, 1000);  // the loop looked at something
}

TEST(PercentDecode, RefusesBrokenEscapesControlBytesAndFalseUtf8) {
  for (const char* bad : {"%", "%4", "%4g", "%00", "%0A", "%7f", "%ff", "%c0%af", "%ed%a0%80", "%f5%80%80%80", "a\x01"})
    EXPECT_FALSE(percent_decode(bad).has_value()) << bad;
  EXPECT_EQ(percent_decode("%41%e2%82%ac"), "A\xe2\x82\xac");
}

TEST(Multipart, IsTheSameHoweverItsBytesArrive) {
  const std::string form =
      "preamble\r\n--b1\r\ncontent-disposition: form-data; name=a\r\n\r\n1\r\n--b\r\n2\r\n"
      "--b1\r\nX: y\r\nContent-Disposition: form-data; name=\"f\"; "
      "filename=\"q\\\"r.bin\"\r\n\r\n\r\n--b1--\r\nepilogue";
  for (const std::size_t piece : {1UL, 2UL, 3UL, 7UL, 1000UL}) {
    SCOPED_TRACE(piece);
    Text body(form, piece);
    auto reader = MultipartReader::open(form_head("multipart/form-data; boundary=b1"), body);
    ASSERT_TRUE(reader.has_value());
    auto first = reader->next();
    ASSERT_TRUE(first.has_value() && first->has_value());
    EXPECT_EQ((*first)->name, "a");
    EXPECT_EQ(read_part_text(*reader, 100).value(), "1\r\n--b\r\n2");
    auto second = reader->next();
    ASSERT_TRUE(second.has_value() && second->has_value());
    EXPECT_EQ((*second)->filename, "q\"r.bin");
    EXPECT_EQ(read_part_text(*reader, 100).value(), "");
    auto end = reader->next();
    ASSERT_TRUE(end.has_value());
    EXPECT_FALSE(end->has_value());
  }
}

TEST(Multipart, CutAnywhereItIsRefusedAndNeverRead) {
  const std::string form = "--b\r\nContent-Disposition: form-data; name=\"a\"\r\n\r\nvalue\r\n--b--";
  for (std::size_t length = 0; length < form.size(); ++length) {
    Text body(form.substr(0, length), 5);
    auto reader = MultipartReader::open(form_head("multipart/form-data; boundary=b"), body);
    bool refused = false;
    for (int i = 0; i < 3 && !refused; ++i) {
      auto part = reader->next();
      refused = !part || (part->has_value() && !read_part_text(*reader, 100));
    }
    EXPECT_TRUE(refused) << length;
  }
}

TEST(Multipart, SkipsPartsThatNobodyReads) {
  Text body("--b\r\nContent-Disposition: form-data; name=a\r\n\r\n" + std::string(200'000, 'x') +
                "\r\n--b\r\nContent-Disposition: form-data; name=z\r\n\r\n1\r\n--b--",
            4096);
  auto reader = MultipartReader::open(form_head("multipart/form-data; boundary=b"), body);
  ASSERT_TRUE(reader->next().has_value());
  EXPECT_EQ(reader->next().value()->name, "z");
}

TEST(Multipart, NeedsABoundary) {
  Text body("", 1);
  for (const char* type : {"multipart/form-data", "multipart/form-data; boundary=", "multipart/form-data; boundary=\"",
                           "multipart/form-data; boundary=\"a b\""})
    EXPECT_FALSE(MultipartReader::open(form_head(type), body).has_value()) << type;
}

HeadJob job_number(int number) {
  HeadJob job;
  job.fd = number;
  return job;
}

TEST(WorkQueue, WakesWhoFellAsleepLast) {
  WorkQueue queue(10);
  std::array<int, 3> taken{};
  std::vector<std::thread> threads;
  const auto wait_for_sleepers = [&queue](std::size_t count) {
    while (queue.sleepers() != count) std::this_thread::yield();
  };
  for (std::size_t i = 0; i < taken.size(); ++i) {
    threads.emplace_back([&, i] {
      while (queue.pop()) ++taken[i];
    });
    wait_for_sleepers(i + 1);
  }
  for (int i = 0; i < 20; ++i) {
    HeadJob job = job_number(i);
    ASSERT_TRUE(queue.push(job));
    wait_for_sleepers(taken.size());
  }
  queue.close();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(taken, (std::array<int, 3>{0, 0, 20}));
}

TEST(WorkQueue, GivesEachJobToOneOfMany) {
  constexpr int kPushers = 4, kEach = 2000;
  WorkQueue queue(100);
  std::vector<std::atomic<int>> taken(kPushers * kEach);
  std::vector<std::thread> takers, pushers;
  for (int i = 0; i < 8; ++i) {
    takers.emplace_back([&] {
      while (auto job = queue.pop()) ++taken[static_cast<std::size_t>(job->fd)];
    });
  }
  for (int pusher = 0; pusher < kPushers; ++pusher) {
    pushers.emplace_back([&, pusher] {
      for (int i = 0; i < kEach; ++i) {
        HeadJob job = job_number(pusher * kEach + i);
        while (!queue.push(job)) std::this_thread::yield();  // full
      }
    });
  }
  for (std::thread& thread : pushers) thread.join();
  queue.close();
  for (std::thread& thread : takers) thread.join();
  for (const std::atomic<int>& count : taken) EXPECT_EQ(count, 1);
  HeadJob late = job_number(0);
  EXPECT_FALSE(queue.push(late)) << "closed";
}

TEST(WorkQueue, RefusesWhatItHasNoRoomFor) {
  WorkQueue queue(2);
  for (const bool taken : {true, true, false}) {
    HeadJob job = job_number(1);
    EXPECT_EQ(queue.push(job), taken);
  }
  EXPECT_EQ(queue.size(), 2U);
}

}  // namespace
}  // namespace kiln
