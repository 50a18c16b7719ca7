#include "server/work/worker_protocol.h"

#include <gtest/gtest.h>

namespace kiln {
namespace {

TEST(WorkerProtocol, EveryLineComesBackAsItWasSent) {
  const auto progress = std::get<ProgressEvent>(parse_line(line_json(ProgressEvent{"read", 1, 2, 0.5})).value());
  EXPECT_EQ(progress.stage, "read");
  EXPECT_EQ(progress.total, 2U);
  EXPECT_EQ(progress.fraction, 0.5);
  const auto artifact = std::get<WorkerArtifact>(parse_line(line_json(WorkerArtifact{"a.glb", "x/y"})).value());
  EXPECT_EQ(artifact.name, "a.glb");
  const auto fault = std::get<Fault>(parse_line(line_json(Fault{"code", "a \"message\"\n", "w"})).value());
  EXPECT_EQ(fault.message, "a \"message\"\n");
  const std::string text = R"({"passes":["\u00e4"]})";
  EXPECT_EQ(std::get<WorkerCheckpoint>(parse_line(line_json(WorkerCheckpoint{text})).value()).text, text);
  EXPECT_TRUE(std::holds_alternative<WorkerDone>(parse_line(line_json(WorkerDone{})).value()));
  const auto share = std::get<WorkerShare>(parse_line(line_json(WorkerShare{3, "rows", 99, {0, 64, 100}})).value());
  EXPECT_EQ(share.loop, 3U);
  EXPECT_EQ(share.name, "rows");
  EXPECT_EQ(share.journal_bytes, 99U);
  EXPECT_EQ(share.cuts, (std::vector<std::uint64_t>{0, 64, 100}));
  EXPECT_EQ(std::get<WorkerNext>(parse_line(line_json(WorkerNext{7})).value()).loop, 7U);
  const auto made = std::get<WorkerMade>(parse_line(line_json(WorkerMade{{1, 2, 3}, "range.1.2"})).value());
  EXPECT_EQ(made.range, (LoopRange{1, 2, 3}));
  EXPECT_EQ(made.file, "range.1.2");
}

TEST(WorkerProtocol, AnswersAndOrdersOfPartsComeBack) {
  const RangeReply reply = parse_reply(reply_json({{1, 2, 3}, "ranges/1"})).value();
  EXPECT_EQ(reply.range, (LoopRange{1, 2, 3}));
  EXPECT_EQ(reply.file, "ranges/1");
  const PartOrder order = parse_part(part_json({{4, 5, 6}, R"({"passes":[]})"})).value();
  EXPECT_EQ(order.range, (LoopRange{4, 5, 6}));
  EXPECT_EQ(order.checkpoint, R"({"passes":[]})");
  EXPECT_FALSE(parse_reply("{}"));
  EXPECT_FALSE(parse_part(R"({"range":{"loop":1,"first":3,"last":3},"checkpoint":""})")) << "an empty range";
}

TEST(WorkerProtocol, BytesThatAreNoUtf8StillMakeALine) {
  EXPECT_TRUE(parse_line(line_json(Fault{"code", "bad \xff byte", ""})));
}

TEST(WorkerProtocol, WhatIsNotExactlyALineIsNothing) {
  for (const char* line :
       {"", "{}", "[]", "null", "{", "{\"done\":1}", "{\"progress\":3}", "{\"other\":true}", "{\"checkpoint\":7}",
        "{\"done\":true,\"fault\":{}}", "{\"progress\":{\"stage\":1}}", "\xff\xfe",
        "{\"share\":{\"loop\":0,\"name\":\"x\",\"journal_bytes\":0,\"cuts\":[0]}}",
        "{\"share\":{\"loop\":0,\"name\":\"x\",\"journal_bytes\":0,\"cuts\":[0,9,9]}}", "{\"next\":-1.5e99}",
        "{\"made\":{\"range\":{\"loop\":0,\"first\":2,\"last\":1},\"file\":\"x\"}}"}) {
    EXPECT_FALSE(parse_line(line)) << line;
  }
}

TEST(WorkerProtocol, AFractionOutsideZeroToOneIsClamped) {
  const auto line = parse_line(R"({"progress":{"stage":"s","done":1,"total":1,"fraction":7}})");
  EXPECT_EQ(std::get<ProgressEvent>(line.value()).fraction, 1);
}

TEST(WorkerProtocol, AnOrderComesBackAsItWasSent) {
  WorkerOrder order;
  order.inputs.scene = {"a \"b\".gltf", std::string(64, 'a')};
  order.inputs.resources = {{"x.bin", std::string(64, 'b')}};
  order.inputs.environment = NamedBlob{"sky.hdr", std::string(64, 'c')};
  order.recipe = R"({"label":"x"})";
  order.mode = WorkerMode::plan;
  order.threads = 3;
  order.parent = 17;
  order.require_sandbox = true;
  order.checkpoint = R"({"a":1})";
  order.sharing = {.least_s = 2.5, .repeats = 3};
  order.known = {{1, 2, 3}, {1, 3, 4}};
  order.range = LoopRange{5, 6, 7};
  order.journal = std::string(64, 'd');
  const WorkerOrder back = parse_order(order_json(order)).value();
  EXPECT_EQ(back.inputs.scene, order.inputs.scene);
  EXPECT_EQ(back.inputs.resources, order.inputs.resources);
  EXPECT_EQ(back.inputs.environment, order.inputs.environment);
  EXPECT_EQ(back.recipe, order.recipe);
  EXPECT_EQ(back.mode, WorkerMode::plan);
  EXPECT_EQ(back.threads, 3);
  EXPECT_EQ(back.parent, 17);
  EXPECT_TRUE(back.require_sandbox);
  EXPECT_EQ(back.checkpoint, order.checkpoint);
  EXPECT_EQ(back.sharing.least_s, 2.5);
  EXPECT_EQ(back.sharing.repeats, 3);
  EXPECT_EQ(back.known, order.known);
  EXPECT_EQ(back.range, order.range);
  EXPECT_EQ(back.journal, order.journal);
}

TEST(WorkerProtocol, ResultNamesCannotLeaveTheirFolder) {
  EXPECT_TRUE(is_artifact_name("scene.glb"));
  EXPECT_TRUE(is_artifact_name("lod-1_b.glb"));
  for (const char* name : {"", ".", "..", ".hidden", "a/b", "../a", "a\\b", "a b", "a\nb", "\xc3\xa4"}) {
    EXPECT_FALSE(is_artifact_name(name)) << name;
  }
  EXPECT_FALSE(is_artifact_name(std::string(65, 'a')));
  EXPECT_FALSE(is_artifact_name(std::string("a\0b", 3)));
}

}  // namespace
}  // namespace kiln
