#include "client_cli/sse.h"

#include <gtest/gtest.h>

#include <vector>

namespace kiln {
namespace {

const std::string kStream =
    ": heartbeat\n\nid: 7\nevent: progress\ndata: {\"a\":\ndata: 1}\n\r\n"
    "data:plain\r\rid: 8\nevent: done\ndata: end\n\nevent: empty\n\n";

std::vector<ServerEvent> events_of(SseParser& parser, const std::string& text, std::size_t piece) {
  std::vector<ServerEvent> events;
  for (std::size_t i = 0; i < text.size(); i += piece) {
    parser.feed(std::string_view(text).substr(i, piece), [&](const ServerEvent& event) {
      events.push_back(event);
      return true;
    });
  }
  return events;
}

TEST(ServerSentEvents, ReadTheSameHoweverTheStreamIsCut) {
  for (const std::size_t piece : {std::size_t{1}, std::size_t{2}, std::size_t{7}, kStream.size()}) {
    SseParser parser;
    const auto events = events_of(parser, kStream, piece);
    ASSERT_EQ(events.size(), 3U) << "pieces of " << piece;
    EXPECT_EQ(events[0].type, "progress");
    EXPECT_EQ(events[0].data, "{\"a\":\n1}");
    EXPECT_EQ(events[0].id, "7");
    EXPECT_EQ(events[1].type, "message");
    EXPECT_EQ(events[1].data, "plain");
    EXPECT_EQ(events[2].type, "done");
    EXPECT_EQ(parser.last_id(), "8");
  }
}

TEST(ServerSentEvents, AConnectionThatBreaksLosesHalfAnEventAndKeepsTheLastId) {
  SseParser parser;
  events_of(parser, "id: 3\ndata: whole\n\nevent: state\ndata: hal", 100);
  parser.reset();
  const auto events = events_of(parser, "data: next\n\n", 100);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].type, "message");
  EXPECT_EQ(events[0].data, "next");
  EXPECT_EQ(parser.last_id(), "3");
}

TEST(ServerSentEvents, AListenerMayStopThem) {
  SseParser parser;
  int seen = 0;
  EXPECT_FALSE(parser.feed(kStream, [&](const ServerEvent&) { return ++seen < 2; }));
  EXPECT_EQ(seen, 2);
}

}  // namespace
}  // namespace kiln
