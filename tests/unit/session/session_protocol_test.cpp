#include "actors/session/session_protocol.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <limits>

#include "proto/limits.hpp"
#include "tests/unit/session/small_scene.hpp"

namespace darm::session {
namespace {

constexpr Microseconds kSecond = 1'000'000;

std::shared_ptr<const GeometryStream> scene() {
  static const auto stream = [] {
    const auto [s, l] = testing::grid(100);
    return GeometryStream::build(s, l, 1.0f, 1).value();
  }();
  return stream;
}

class SessionProtocolTest : public ::testing::Test {
 protected:
  void start(const SessionPolicy& policy = {}) {
    protocol = std::make_unique<SessionProtocol>(SessionId{3}, policy, std::string(32, 'k'), std::uint16_t{777},
                                                 scene(), std::make_shared<FrameBodies>(), 0);
  }
  Actions say(const wire::Envelope& e, Microseconds now = 1) { return protocol->on_bytes(proto::frame(e), now); }
  static wire::Envelope hello() {
    wire::Envelope e;
    e.mutable_hello()->set_version(proto::kProtocolVersion);
    e.mutable_hello()->set_client("test");
    e.mutable_hello()->set_max_phystex(2048);
    return e;
  }
  static wire::Envelope camera(std::uint64_t sequence, float fovy = 0.8f) {
    wire::Envelope e;
    auto* c = e.mutable_camera();
    c->set_sequence(sequence);
    c->set_client_time_us(99);
    put_pose(Camera{}, Viewport{}, *c->mutable_pose());
    c->mutable_pose()->set_fovy(fovy);
    return e;
  }
  /// Everything the session wants to send, as messages.
  std::vector<wire::Envelope> heard(Microseconds now = 1) {
    proto::FrameReader reader(proto::kMaxServerEnvelope);
    std::vector<wire::Envelope> out;
    for (auto packets = protocol->next_packets(now); !packets.empty(); packets = protocol->next_packets(now)) {
      for (const auto& packet : packets) {
        reader.feed(packet.head);
        if (packet.body) reader.feed(*packet.body);
        reader.feed(packet.tail);
      }
      (void)protocol->on_sent(now);
    }
    wire::Envelope e;
    while (reader.next(e).value()) {
      if (e.has_ping())
        pings.push_back(e.ping().time_us());
      else
        out.push_back(e);
    }
    return out;
  }
  template <class M>
  static int count(const Actions& actions) {
    int n = 0;
    for (const auto& a : actions) n += std::holds_alternative<M>(a);
    return n;
  }
  void expect_goodbye(wire::Goodbye::Reason reason) {
    const auto out = heard();
    ASSERT_FALSE(out.empty());
    ASSERT_TRUE(out.back().has_goodbye());
    EXPECT_EQ(out.back().goodbye().reason(), reason);
    EXPECT_FALSE(out.back().goodbye().text().empty());
    EXPECT_TRUE(protocol->finished(1));
    EXPECT_FALSE(protocol->end().empty());
  }

  // As a client does.
  Actions answer_pings(Microseconds now) {
    Actions actions;
    for (const auto number : std::exchange(pings, {})) {
      wire::Envelope pong;
      pong.mutable_pong()->set_time_us(number);
      for (auto& action : say(pong, now)) actions.push_back(action);
    }
    return actions;
  }

  std::unique_ptr<SessionProtocol> protocol;
  std::vector<std::int64_t> pings;
};

TEST_F(SessionProtocolTest, a_hello_is_answered_in_the_agreed_order) {
  SessionPolicy policy;
  policy.start = look_at({60, 20, 0}, {60, 6, 60}, 60.0);
  start(policy);
  const auto actions = say(hello());
  EXPECT_EQ(count<tile_scheduler::SessionOpened>(actions), 1);
  EXPECT_EQ(count<encoder::CoarseWanted>(actions), 1);
  auto texture = std::make_shared<CoarseTexture>();
  texture->version = 1;
  texture->h264 = {1, 2, 3};
  protocol->on_coarse(CoarseUpdated(texture));
  const auto out = heard();
  ASSERT_EQ(out.size(), 3 + scene()->chunk_count());
  ASSERT_TRUE(out[0].has_welcome());
  EXPECT_EQ(out[0].welcome().session(), 3u);
  EXPECT_EQ(out[0].welcome().key().size(), 32u);
  EXPECT_EQ(out[0].welcome().udp_port(), 777u);
  EXPECT_EQ(out[0].welcome().phystex_size(), 2048u);
  EXPECT_GT(out[0].welcome().chunks_in_view(), 0u);
  EXPECT_TRUE(out[1].has_manifest());
  EXPECT_TRUE(out[2].has_coarse()) << "overtakes the geometry that waits, so that it can be drawn lit";
  for (std::size_t i = 0; i < scene()->chunk_count(); ++i) EXPECT_TRUE(out[3 + i].has_geometry());
}

TEST_F(SessionProtocolTest, a_client_that_has_the_scene_is_not_sent_it_again) {
  start();
  (void)say(hello());
  const auto first = heard();
  ASSERT_GT(first.size(), 2u);
  EXPECT_FALSE(first[0].welcome().scene_known());
  const auto tag = first[1].manifest().tag();
  EXPECT_NE(tag, 0u);
  for (const bool same : {true, false}) {
    start();
    auto again = hello();
    again.mutable_hello()->set_known_scene(same ? tag : tag + 1);
    (void)say(again);
    const auto out = heard();
    ASSERT_FALSE(out.empty());
    EXPECT_EQ(out[0].welcome().scene_known(), same);
    EXPECT_EQ(out.size(), same ? 1u : first.size());
  }
}

TEST_F(SessionProtocolTest, pictures_come_once_all_that_is_in_view_is_there_not_all_there_is) {
  start();
  auto away = hello();
  put_pose(look_at({5, 8, 7}, {5, 900, 7}, 40.0), Viewport{}, *away.mutable_hello()->mutable_pose());
  (void)say(away);
  const auto first = protocol->next_packets(1);
  ASSERT_GE(first.size(), 2u);
  ASSERT_LE(first.size(), 3u) << "welcome, manifest, a ping";
  wire::Envelope welcome;
  ASSERT_TRUE(welcome.ParseFromArray(first[0].head.data() + 4, static_cast<int>(first[0].head.size() - 4)));
  EXPECT_EQ(welcome.welcome().chunks_in_view(), 0u);
  (void)protocol->on_sent(1);
  auto frame = std::make_shared<EncodedFrame>();
  frame->frame = 1;
  frame->key = true;
  (void)protocol->on_frame(FrameEncoded(frame, {}), 1);
  const auto out = heard();
  ASSERT_EQ(out.size(), 1 + scene()->chunk_count());
  EXPECT_TRUE(out[0].has_frame());
  EXPECT_TRUE(out[1].has_geometry());
}

TEST_F(SessionProtocolTest, formats_are_what_both_sides_can_do) {
  SessionPolicy policy;
  policy.phystex_size = 2048;
  const auto format = [&](std::uint32_t max, bool c444, bool lossless, bool allow) {
    policy.allow_lossless = allow;
    start(policy);
    auto e = hello();
    e.mutable_hello()->set_max_phystex(max);
    e.mutable_hello()->set_chroma_444(c444);
    e.mutable_hello()->set_lossless(lossless);
    for (const auto& a : say(e)) {
      if (const auto* o = std::get_if<tile_scheduler::SessionOpened>(&a)) return o->format;
    }
    tile_scheduler::StreamFormat none;
    none.phystex_size = 0;
    return none;
  };
  EXPECT_EQ(format(4096, false, false, false).phystex_size, 2048u);
  EXPECT_EQ(format(1500, false, false, false).phystex_size, 1024u);
  EXPECT_EQ(format(0, false, false, false).phystex_size, 2048u);
  EXPECT_EQ(format(512, false, false, false).phystex_size, 0u);
  EXPECT_TRUE(format(2048, true, false, false).chroma_444);
  EXPECT_EQ(format(16384, false, true, false).phystex_size, 0u);
  EXPECT_EQ(format(16384, false, true, true).phystex_size, 8192u);
  EXPECT_TRUE(format(16384, false, true, true).lossless_rgb);
}

TEST_F(SessionProtocolTest, a_private_layer_is_agreed_on_only_where_both_sides_have_one) {
  const auto agreed = [&](std::uint32_t offered, std::uint32_t wanted, bool lossless) {
    SessionPolicy policy;
    policy.view_phystex = offered;
    policy.allow_lossless = true;
    start(policy);
    auto e = hello();
    e.mutable_hello()->set_max_view_phystex(wanted);
    e.mutable_hello()->set_lossless(lossless);
    std::uint32_t size = 0;
    for (const auto& a : say(e))
      if (const auto* o = std::get_if<tile_scheduler::SessionOpened>(&a)) size = o->format.view_phystex;
    EXPECT_EQ(heard()[0].welcome().view_phystex(), size);
    return size;
  };
  EXPECT_EQ(agreed(1024, 1024, false), 1024u);
  EXPECT_EQ(agreed(1024, 700, false), 512u);
  EXPECT_EQ(agreed(512, 0xffffffffu, false), 512u);
  EXPECT_EQ(agreed(1024, 0, false), 0u) << "a client of before";
  EXPECT_EQ(agreed(1024, 256, false), 0u);
  EXPECT_EQ(agreed(0, 1024, false), 0u) << "nothing calls for it";
  EXPECT_EQ(agreed(1024, 8192, true), 2048u);
}

TEST_F(SessionProtocolTest, a_client_may_ask_for_its_own_target_error_within_limits) {
  const auto agreed = [&](float wanted) {
    SessionPolicy policy;
    policy.target_error = 0.002f;
    policy.least_target_error = 0.0005f;
    start(policy);
    auto e = hello();
    e.mutable_hello()->set_target_error(wanted);
    float target = -1;
    for (const auto& a : say(e))
      if (const auto* o = std::get_if<tile_scheduler::SessionOpened>(&a)) target = o->target_error;
    EXPECT_EQ(heard()[0].welcome().target_error(), target);
    return target;
  };
  EXPECT_EQ(agreed(0), 0.002f) << "a client that does not ask";
  EXPECT_EQ(agreed(0.02f), 0.02f);
  EXPECT_EQ(agreed(0.001f), 0.001f);
  EXPECT_EQ(agreed(1e-30f), 0.0005f);
  EXPECT_EQ(agreed(1e30f), 1.0f);
  for (const float nothing : {-1.0f, std::numeric_limits<float>::quiet_NaN()}) EXPECT_EQ(agreed(nothing), 0.002f);
}

TEST_F(SessionProtocolTest, a_client_may_ask_for_a_key_frame_of_either_layer) {
  start();
  static_cast<void>(say(hello()));
  wire::Envelope e;
  e.mutable_feedback()->set_view_key_frame_wanted(true);
  const auto actions = say(e);
  ASSERT_EQ(count<tile_scheduler::KeyFrameWanted>(actions), 1);
  EXPECT_EQ(std::get<tile_scheduler::KeyFrameWanted>(actions[0]).layer, StreamLayer::kView);
}

TEST_F(SessionProtocolTest, unknown_versions_are_refused_with_a_reason) {
  start();
  auto e = hello();
  e.mutable_hello()->set_version(proto::kProtocolVersion + 1);
  EXPECT_EQ(count<tile_scheduler::SessionOpened>(say(e)), 0);
  expect_goodbye(wire::Goodbye::VERSION_UNSUPPORTED);
}

TEST_F(SessionProtocolTest, the_first_message_must_be_hello) {
  start();
  (void)say(camera(1));
  expect_goodbye(wire::Goodbye::PROTOCOL_ERROR);
}

TEST_F(SessionProtocolTest, a_silent_client_is_let_go) {
  start();
  (void)protocol->on_tick(4 * kSecond);
  EXPECT_TRUE(protocol->next_packets(4 * kSecond).empty());
  (void)protocol->on_tick(6 * kSecond);
  expect_goodbye(wire::Goodbye::TIMED_OUT);
  start();
  (void)say(hello());
  (void)heard();
  (void)protocol->on_tick(29 * kSecond);
  EXPECT_TRUE(protocol->open());
  wire::Envelope ping;
  ping.mutable_ping()->set_time_us(5);
  (void)say(ping, 29 * kSecond);
  const auto pong = heard();
  ASSERT_EQ(pong.size(), 1u);
  EXPECT_EQ(pong[0].pong().time_us(), 5);
  EXPECT_EQ(pong[0].pong().server_time_us(), 29 * kSecond);
  (void)protocol->on_tick(58 * kSecond);
  EXPECT_TRUE(protocol->open());
  (void)protocol->on_tick(60 * kSecond);
  expect_goodbye(wire::Goodbye::TIMED_OUT);
}

TEST_F(SessionProtocolTest, a_client_that_never_reads_is_too_slow) {
  start();
  (void)say(hello());
  ASSERT_FALSE(protocol->next_packets(0).empty());  // under way for ever
  (void)protocol->on_tick(16 * kSecond);
  EXPECT_NE(protocol->end().find("TOO_SLOW"), std::string::npos);
  EXPECT_FALSE(protocol->finished(16 * kSecond));
  EXPECT_TRUE(protocol->finished(19 * kSecond));  // the goodbye cannot leave: closed all the same
}

TEST_F(SessionProtocolTest, the_newest_camera_wins_over_tcp_and_udp) {
  start();
  (void)say(hello());
  auto actions = say(camera(5), 77);
  ASSERT_EQ(count<tile_scheduler::ViewChanged>(actions), 1);
  const auto& view = std::get<tile_scheduler::ViewChanged>(actions[0]);
  EXPECT_EQ(view.sequence, 5u);
  EXPECT_EQ(view.stamps.client_sent, 99);
  EXPECT_EQ(view.stamps.camera_received, 77);
  wire::DatagramBody body;
  *body.mutable_camera() = camera(4).camera();
  EXPECT_EQ(count<tile_scheduler::ViewChanged>(protocol->on_datagram(body, 2)), 0);
  *body.mutable_camera() = camera(6).camera();
  EXPECT_EQ(count<tile_scheduler::ViewChanged>(protocol->on_datagram(body, 2)), 1);
  EXPECT_EQ(count<tile_scheduler::ViewChanged>(say(camera(6))), 0);
}

TEST_F(SessionProtocolTest, poses_that_make_no_sense_are_refused_then_the_client) {
  start();
  (void)say(hello());
  for (unsigned i = 0; i < 16; ++i) {
    EXPECT_EQ(count<tile_scheduler::ViewChanged>(say(camera(i + 1, std::nanf("")))), 0);
  }
  EXPECT_TRUE(protocol->open());
  EXPECT_EQ(count<tile_scheduler::ViewChanged>(say(camera(100))), 1);
  (void)say(camera(101, -1.0f));
  expect_goodbye(wire::Goodbye::PROTOCOL_ERROR);
}

TEST_F(SessionProtocolTest, a_long_message_ends_the_session) {
  start();
  const std::vector<std::uint8_t> huge{0x7f, 0xff, 0xff, 0xff};
  (void)protocol->on_bytes(huge, 1);
  expect_goodbye(wire::Goodbye::PROTOCOL_ERROR);
}

TEST_F(SessionProtocolTest, frames_carry_picture_table_answer_and_stamps) {
  start();
  (void)say(hello());
  (void)heard();
  auto frame = std::make_shared<EncodedFrame>();
  frame->frame = 12;
  frame->key = true;
  frame->h264 = {9, 8, 7};
  frame->stream = StreamId{7};
  frame->error = 0.25f;  // of all who share the stream
  auto coverage = std::make_shared<CoverageTile>();
  coverage->fill(200);
  frame->edits.push_back({TileId(2, 34), 56, coverage, nullptr});
  ViewAnswer answer;
  answer.sequence = 4;
  answer.error = 0.5f;
  answer.stamps.camera_received = 11;
  answer.stamps.encoded = 22;
  (void)protocol->on_frame(FrameEncoded(frame, answer), 30);
  const auto out = heard(33);
  ASSERT_EQ(out.size(), 1u);
  const auto& f = out[0].frame();
  EXPECT_EQ(f.frame(), 12u);
  EXPECT_TRUE(f.key());
  EXPECT_EQ(f.h264(), std::string("\x09\x08\x07"));
  EXPECT_EQ(f.answers(), 4u);
  EXPECT_EQ(f.stream(), 7u);
  EXPECT_FLOAT_EQ(f.error(), 0.5f) << "of this view";
  EXPECT_EQ(f.stamps().camera_received(), 11);
  EXPECT_EQ(f.stamps().encoded(), 22);
  EXPECT_EQ(f.stamps().sent(), 33);
  ASSERT_EQ(f.page_edits_size(), 1);
  EXPECT_EQ(f.page_edits(0).slot(), 56u);
  CoverageTile back;
  uLongf size = back.size();
  const auto& packed = f.page_edits(0).coverage();
  ASSERT_EQ(uncompress(back.data(), &size, reinterpret_cast<const Bytef*>(packed.data()), packed.size()), Z_OK);
  EXPECT_EQ(back, *coverage);
}

TEST_F(SessionProtocolTest, lost_frames_are_answered_with_a_key_frame) {
  start();
  (void)say(hello());
  (void)heard();
  auto frame = std::make_shared<EncodedFrame>();
  frame->frame = 2;
  EXPECT_EQ(count<tile_scheduler::KeyFrameWanted>(protocol->on_frame(FrameEncoded(frame, {}), 1)), 1);
  wire::Envelope feedback;
  feedback.mutable_feedback()->set_key_frame_wanted(true);
  EXPECT_EQ(count<tile_scheduler::KeyFrameWanted>(say(feedback)), 1);
  EXPECT_TRUE(heard().empty());
}

TEST_F(SessionProtocolTest, a_goodbye_ends_it_without_an_answer) {
  start();
  (void)say(hello());
  wire::Envelope bye;
  bye.mutable_goodbye()->set_reason(wire::Goodbye::CLIENT_LEAVES);
  (void)say(bye);
  EXPECT_TRUE(protocol->finished(1));
  EXPECT_TRUE(heard().empty());
}

TEST(FrameBodies, sessions_of_a_stream_share_the_bytes) {
  FrameBodies bodies;
  const auto frame = std::make_shared<EncodedFrame>();
  EXPECT_EQ(bodies.body_of(frame), bodies.body_of(frame));
  EXPECT_NE(bodies.body_of(frame), bodies.body_of(std::make_shared<EncodedFrame>()));
}

tile_scheduler::LinkState link_of(const Actions& actions) {
  const auto is_link = [](const Action& a) { return std::holds_alternative<tile_scheduler::LinkChanged>(a); };
  const auto it = std::ranges::find_if(actions, is_link);
  EXPECT_NE(it, actions.end());
  return it == actions.end() ? tile_scheduler::LinkState::kFree : std::get<tile_scheduler::LinkChanged>(*it).state;
}

TEST_F(SessionProtocolTest, who_pings_without_reading_is_answered_some_hundred_times) {
  start();
  (void)say(hello());
  (void)heard();
  wire::Envelope ping;
  ping.mutable_ping()->set_time_us(5);
  for (int i = 0; i < 20'000; ++i) (void)say(ping);
  const auto pongs = heard().size();
  EXPECT_GT(pongs, 100u);
  EXPECT_LT(pongs, 5'000u);
  (void)say(ping);
  EXPECT_EQ(heard().size(), 1u) << "who reads again is answered again";
}

TEST_F(SessionProtocolTest, the_scheduler_hears_when_the_link_is_full_and_when_it_is_free_again) {
  using tile_scheduler::LinkState;
  start();
  EXPECT_EQ(link_of(say(hello())), LinkState::kLoading);
  (void)heard(10);
  EXPECT_FALSE(pings.empty());
  (void)answer_pings(kSecond);  // all of the scene took a second
  const auto picture = [](FrameNumber number, bool key, std::size_t size) {
    auto f = std::make_shared<EncodedFrame>();
    f->frame = number;
    f->key = key;
    f->h264.resize(size);
    return FrameEncoded(f, {});
  };
  (void)protocol->on_frame(picture(1, true, 400'000), 4 * kSecond);
  (void)heard(4 * kSecond);
  ASSERT_FALSE(pings.empty());
  EXPECT_EQ(link_of(protocol->on_tick(7 * kSecond)), LinkState::kFull);
  EXPECT_EQ(link_of(answer_pings(8 * kSecond)), LinkState::kFree);
  EXPECT_TRUE(protocol->on_tick(8 * kSecond).empty()) << "nothing is told twice";
}

TEST_F(SessionProtocolTest, a_client_has_no_private_layer_where_there_is_no_memory_for_one) {
  SessionPolicy policy;
  policy.view_phystex = 1024;
  policy.memory = std::make_shared<SessionMemory>(private_layer_bytes(1024) / 3 * 4 + (4u << 20));
  const auto offered = [&](const SessionPolicy& p, Actions* actions) {
    start(p);
    auto e = hello();
    e.mutable_hello()->set_max_view_phystex(1024);
    *actions = say(e);
    return heard().front().welcome().view_phystex();
  };
  Actions actions;
  EXPECT_EQ(offered(policy, &actions), 1024u);
  const auto first = std::move(protocol);
  EXPECT_GE(policy.memory->held(), private_layer_bytes(1024));
  EXPECT_EQ(offered(policy, &actions), 0u);
  EXPECT_EQ(count<Noted>(actions), 1) << "counted, by what happened";
  EXPECT_EQ(count<tile_scheduler::SessionOpened>(actions), 1) << "the shared light it has all the same";
}

TEST_F(SessionProtocolTest, pictures_do_not_wait_where_sessions_hold_as_much_as_they_may) {
  SessionPolicy policy;
  policy.memory = std::make_shared<SessionMemory>(1'000'000);
  start(policy);
  (void)say(hello());
  (void)heard();
  const auto frame = [](FrameNumber number, bool key) {
    auto f = std::make_shared<EncodedFrame>();
    f->stream = StreamId{1};
    f->frame = number;
    f->key = key;
    f->h264.resize(300'000);
    return FrameEncoded(f, {});
  };
  (void)protocol->on_frame(frame(1, true), 2);
  EXPECT_FALSE(protocol->next_packets(2).empty());  // under way, and what follows waits
  Actions actions = protocol->on_frame(frame(2, false), 3);
  EXPECT_EQ(count<PicturesDropped>(actions), 0);
  {
    SessionMemory::Share others(policy.memory);
    others.set(900'000);
    actions = protocol->on_frame(frame(3, false), 4);
  }
  ASSERT_GE(count<PicturesDropped>(actions), 1);
  bool said = false;
  for (const auto& a : actions)
    if (const auto* dropped = std::get_if<PicturesDropped>(&a)) said = said || dropped->why == "memory";
  EXPECT_TRUE(said);
  protocol->note_memory();
  EXPECT_LT(policy.memory->held(), 100'000u);
}

}  // namespace
}  // namespace darm::session
