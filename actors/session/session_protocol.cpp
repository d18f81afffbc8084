#include "actors/session/session_protocol.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "proto/limits.hpp"

namespace darm::session {
namespace {

// The smallest PhysTex of the protocol, and the largest a 16-bit slot number can name (less the one for "absent").
constexpr std::uint32_t kSmallestPhysTex = 1024;
constexpr std::uint32_t kLargestCoded = 4096;
constexpr std::uint32_t kLargestLossless = 8192;

// A link's rate is told again when it is another by this factor; above the second, bytes a second, it is of no matter.
constexpr double kAnotherRate = 1.25;
constexpr double kFastEnough = 16e6;

constexpr std::size_t kMostControlForPong = 16 * 1024;  // bytes that wait, some hundred pongs

Packet packet_of(const wire::Envelope& envelope) {
  Packet p;
  p.head = proto::frame(envelope);
  return p;
}

Packet packet_of(SharedBytes bytes) {
  Packet p;
  p.body = std::move(bytes);
  return p;
}

Packet ping_packet(std::int64_t number) {
  wire::Envelope envelope;
  envelope.mutable_ping()->set_time_us(number);
  return packet_of(envelope);
}

// What the client can take of what the server offers; 0: no private layer.
std::uint32_t view_size(const wire::Hello& hello, const SessionPolicy& policy) {
  if (policy.view_phystex == 0 || hello.max_view_phystex() < proto::kSmallestViewPhysTex) return 0;
  if (hello.lossless()) return std::min(std::bit_floor(hello.max_view_phystex()), proto::kLargestLosslessViewPhysTex);
  return std::min(std::bit_floor(std::min(hello.max_view_phystex(), policy.view_phystex)), proto::kLargestViewPhysTex);
}

// Printable ASCII only, so that a name cannot forge log lines.
std::string clean_name(const std::string& text) {
  std::string out = text.substr(0, proto::kMaxClientName);
  std::replace_if(out.begin(), out.end(), [](char c) { return c < 0x20 || c > 0x7e; }, '?');
  return out;
}

}  // namespace

SessionProtocol::SessionProtocol(SessionId id, const SessionPolicy& policy, std::string key, std::uint16_t udp_port,
                                 std::shared_ptr<const GeometryStream> scene, std::shared_ptr<FrameBodies> bodies,
                                 Microseconds now)
    : id_(id),
      policy_(policy),
      key_(std::move(key)),
      udp_port_(udp_port),
      scene_(std::move(scene)),
      bodies_(std::move(bodies)),
      reader_(proto::kMaxClientEnvelope),
      queue_(policy.send),
      memory_(policy.memory),
      started_(now),
      heard_(now) {}

Actions SessionProtocol::on_bytes(std::span<const std::uint8_t> bytes, Microseconds now) {
  Actions actions;
  if (state_ == State::kClosing || state_ == State::kClosed) return actions;
  reader_.feed(bytes);
  wire::Envelope envelope;
  while (state_ == State::kAwaitHello || state_ == State::kOpen) {
    const auto got = reader_.next(envelope);
    if (!got) {
      actions.push_back(Noted{"bad_framing"});
      close(wire::Goodbye::PROTOCOL_ERROR, "The stream cannot be read: " + got.error() + ".", now);
      break;
    }
    if (!*got) break;
    heard_ = now;
    on_envelope(envelope, now, actions);
  }
  return actions;
}

void SessionProtocol::on_envelope(const wire::Envelope& envelope, Microseconds now, Actions& actions) {
  using Body = wire::Envelope::BodyCase;
  const auto body = envelope.body_case();
  if (body == Body::kGoodbye) {
    state_ = State::kClosed;
    end_ = "the client left";
    end_reason_ = "left";
    queue_.clear();
    return;
  }
  if (state_ == State::kAwaitHello) {
    if (body == Body::kHello) {
      on_hello(envelope.hello(), now, actions);
    } else {
      close(wire::Goodbye::PROTOCOL_ERROR, "The first message must be Hello.", now);
    }
    return;
  }
  switch (body) {
    case Body::kCamera:
      return on_camera(envelope.camera(), now, actions);
    case Body::kFeedback:
      return on_feedback(envelope.feedback(), actions);
    case Body::kPing:
      return on_ping(envelope.ping(), now);
    case Body::kPong:
      pace_.pong(envelope.pong().time_us(), now);
      return tell_link(now, actions);
    case Body::BODY_NOT_SET:
      return;  // a message of a later minor version: ignored, like unknown fields
    default:
      return fault("unexpected_message", now, actions);
  }
}

std::optional<tile_scheduler::StreamFormat> SessionProtocol::negotiate(const wire::Hello& hello) const {
  const std::uint32_t wanted = hello.max_phystex() == 0 ? policy_.phystex_size : hello.max_phystex();
  if (wanted < kSmallestPhysTex) return std::nullopt;
  tile_scheduler::StreamFormat format;
  format.view_phystex = view_size(hello, policy_);
  if (hello.lossless()) {
    if (!policy_.allow_lossless) return std::nullopt;
    format.lossless_rgb = true;
    format.phystex_size = std::min(std::bit_floor(wanted), kLargestLossless);
    return format;
  }
  format.phystex_size = std::min(std::bit_floor(std::min(wanted, policy_.phystex_size)), kLargestCoded);
  format.chroma_444 = hello.chroma_444() && policy_.allow_chroma_444;
  return format;
}

void SessionProtocol::on_hello(const wire::Hello& hello, Microseconds now, Actions& actions) {
  client_name_ = clean_name(hello.client());
  if (hello.version() != proto::kProtocolVersion) {
    return close(wire::Goodbye::VERSION_UNSUPPORTED,
                 "This server speaks protocol version " + std::to_string(proto::kProtocolVersion) +
                     ", the client asked for " + std::to_string(hello.version()) + ".",
                 now);
  }
  auto format = negotiate(hello);
  if (!format) {
    return close(wire::Goodbye::FORMAT_REFUSED,
                 hello.lossless() && !policy_.allow_lossless
                     ? "This server does not send lossless tiles; ask without, or allow them in its configuration."
                     : "The client cannot take a PhysTex of at least 1024 pixels.",
                 now);
  }
  ParsedPose first{policy_.start, policy_.start_viewport};
  if (hello.has_pose()) {
    if (const auto pose = parse_pose(hello.pose())) {
      first = *pose;
    } else {
      fault("bad_pose", now, actions);
    }
  }
  // The shared light needs no memory of its own; what depends on the eye does.
  if (format->view_phystex > 0 && !memory_.has_room_for_layer(private_layer_bytes(format->view_phystex))) {
    format->view_phystex = 0;
    actions.push_back(Noted{"no_memory_for_layer"});
  }
  layer_bytes_ = private_layer_bytes(format->view_phystex);
  note_memory();
  state_ = State::kOpen;
  const float target = target_error(hello);
  if (hello.known_scene() == scene_->tag()) {
    send_welcome(*format, target, true, 0);
  } else {
    const auto order = scene_->order_for(first.camera, first.viewport);
    send_welcome(*format, target, false, order.in_view);
    send_scene(order);
  }
  actions.push_back(tile_scheduler::SessionOpened(id_, *format, target));
  actions.push_back(encoder::CoarseWanted(id_));
  tell_link(now, actions);
}

// What is not a number above 0 asks for nothing.
float SessionProtocol::target_error(const wire::Hello& hello) const {
  const float wanted = hello.target_error();
  if (!(wanted > 0)) return policy_.target_error;
  return std::clamp(wanted, policy_.least_target_error, 1.0f);
}

void SessionProtocol::send_welcome(const tile_scheduler::StreamFormat& format, float target_error, bool scene_known,
                                   std::uint32_t chunks_in_view) {
  wire::Envelope envelope;
  auto* w = envelope.mutable_welcome();
  w->set_version(proto::kProtocolVersion);
  w->set_session(static_cast<std::uint64_t>(id_));
  w->set_key(key_);
  w->set_udp_port(udp_port_);
  w->set_phystex_size(format.phystex_size);
  w->set_chroma_444(format.chroma_444);
  w->set_lossless(format.lossless_rgb);
  put_pose(policy_.start, policy_.start_viewport, *w->mutable_start());
  w->set_updates_per_second(policy_.updates_per_second);
  w->set_server(policy_.server);
  w->set_view_phystex(format.view_phystex);
  w->set_target_error(target_error);
  w->set_scene_known(scene_known);
  w->set_chunks_in_view(chunks_in_view);
  send(envelope);
}

// What the first picture shows goes before pictures, the rest of the geometry between them.
void SessionProtocol::send_scene(const GeometryStream::Order& order) {
  queue_.push_manifest(packet_of(scene_->manifest()));
  for (std::uint32_t i = 0; i < order.chunks.size(); ++i) {
    auto packet = packet_of(scene_->chunk(order.chunks[i]));
    i < order.in_view ? queue_.push_bulk(std::move(packet)) : queue_.push_background(std::move(packet));
  }
}

void SessionProtocol::on_camera(const wire::CameraUpdate& update, Microseconds now, Actions& actions) {
  const auto pose = parse_pose(update.pose());
  if (!pose) return fault("bad_pose", now, actions);
  if (update.sequence() <= newest_camera_) {
    actions.push_back(Noted{"old_camera"});  // overtaken on the way (UDP and TCP may cross): not the client's fault
    return;
  }
  newest_camera_ = update.sequence();
  FrameStamps stamps;
  stamps.client_sent = update.client_time_us();
  stamps.camera_received = now;
  actions.push_back(tile_scheduler::ViewChanged(id_, newest_camera_, pose->camera, pose->viewport, stamps));
}

void SessionProtocol::on_feedback(const wire::Feedback& feedback, Actions& actions) {
  if (feedback.key_frame_wanted()) {
    queue_.require_key(StreamLayer::kShared);
    actions.push_back(tile_scheduler::KeyFrameWanted(id_));
  }
  if (feedback.view_key_frame_wanted()) {
    queue_.require_key(StreamLayer::kView);
    actions.push_back(tile_scheduler::KeyFrameWanted(id_, StreamLayer::kView));
  }
}

// Who pings without reading what comes back is not answered any more: nobody needs so many.
void SessionProtocol::on_ping(const wire::Ping& ping, Microseconds now) {
  if (queue_.control_bytes() > kMostControlForPong) return;
  wire::Envelope pong;
  pong.mutable_pong()->set_time_us(ping.time_us());
  pong.mutable_pong()->set_server_time_us(now);
  send(pong);
}

void SessionProtocol::fault(std::string_view what, Microseconds now, Actions& actions) {
  actions.push_back(Noted{what});
  if (++faults_ > policy_.max_protocol_errors) {
    close(wire::Goodbye::PROTOCOL_ERROR, "Too many messages that make no sense here.", now);
  }
}

Actions SessionProtocol::on_datagram(const wire::DatagramBody& body, Microseconds now) {
  Actions actions;
  if (state_ != State::kOpen) return actions;
  heard_ = now;
  switch (body.body_case()) {
    case wire::DatagramBody::kCamera:
      on_camera(body.camera(), now, actions);
      break;
    case wire::DatagramBody::kFeedback:
      on_feedback(body.feedback(), actions);
      break;
    case wire::DatagramBody::kPing:
      on_ping(body.ping(), now);
      break;
    case wire::DatagramBody::BODY_NOT_SET:
      break;
  }
  return actions;
}

Actions SessionProtocol::on_frame(const FrameEncoded& event, Microseconds now) {
  Actions actions;
  if (state_ != State::kOpen || !event.frame) return actions;
  note_memory();
  queue_.push_picture(event.frame, event.answer, now, memory_.has_room(event.frame->h264.size()));
  ask_for_keys(now, actions);
  tell_link(now, actions);
  tell_drops(actions);
  return actions;
}

void SessionProtocol::on_no_change(const NoChange& event) {
  if (state_ == State::kOpen) queue_.push_no_change(event);
}

void SessionProtocol::on_coarse(const CoarseUpdated& event) {
  if (state_ != State::kOpen || !event.coarse || event.coarse->version <= coarse_version_) return;
  coarse_version_ = event.coarse->version;
  queue_.push_coarse(packet_of(coarse_message(*event.coarse)));
}

void SessionProtocol::note_memory() { memory_.set(queue_.bytes() + layer_bytes_); }

void SessionProtocol::ask_for_keys(Microseconds now, Actions& actions) {
  if (state_ != State::kOpen || pace_.full(0, now)) return;  // it would only wait
  for (const auto layer : {StreamLayer::kShared, StreamLayer::kView}) {
    if (!queue_.ask_for_key(now, layer)) continue;
    const auto overdue = queue_.overdue();
    const bool behind = overdue > std::exchange(overdue_told_, overdue);
    actions.push_back(tile_scheduler::KeyFrameWanted(id_, layer, behind));
  }
}

// A link that is fast and free is not worth a word.
void SessionProtocol::tell_link(Microseconds now, Actions& actions) {
  using tile_scheduler::LinkState;
  if (state_ != State::kOpen) return;
  const auto state = queue_.loading()                        ? LinkState::kLoading
                     : pace_.full(queue_.media_bytes(), now) ? LinkState::kFull
                                                             : LinkState::kFree;
  const double rate = pace_.bytes_per_second();
  const bool another = rate > rate_told_ * kAnotherRate || rate * kAnotherRate < rate_told_;
  const bool matters = std::min(rate, rate_told_) < kFastEnough;
  if (state == link_told_ && !(another && matters)) return;
  link_told_ = state;
  rate_told_ = rate;
  actions.push_back(tile_scheduler::LinkChanged(id_, state, rate));
}

void SessionProtocol::tell_drops(Actions& actions) {
  for (std::size_t i = 0; i < drops_told_.size(); ++i) {
    const auto count = queue_.drops()[i];
    if (const auto before = std::exchange(drops_told_[i], count); count > before)
      actions.push_back(PicturesDropped{kDropNames[i], count - before});
  }
}

Actions SessionProtocol::on_sent(Microseconds now) {
  Actions actions;
  queue_.sent(now);
  pace_.taken();
  // Pictures were turned away while geometry went out: now there is room.
  if (queue_.any_dropped()) ask_for_keys(now, actions);
  tell_link(now, actions);
  return actions;
}

Actions SessionProtocol::on_tick(Microseconds now) {
  Actions actions;
  if (state_ == State::kAwaitHello && now - started_ > policy_.handshake_timeout) {
    close(wire::Goodbye::TIMED_OUT, "No Hello came in time.", now);
  } else if (state_ == State::kOpen && now - heard_ > policy_.idle_timeout) {
    close(wire::Goodbye::TIMED_OUT, "Nothing was heard from the client for too long.", now);
  } else if (state_ == State::kOpen && queue_.too_slow(now)) {
    close(wire::Goodbye::TOO_SLOW, "The client does not read what it is sent.", now);
  }
  if (queue_.any_dropped()) ask_for_keys(now, actions);
  tell_link(now, actions);
  return actions;
}

void SessionProtocol::close(wire::Goodbye::Reason reason, std::string text, Microseconds now) {
  if (state_ == State::kClosing || state_ == State::kClosed) return;
  state_ = State::kClosing;
  closing_since_ = now;
  text.resize(std::min(text.size(), proto::kMaxGoodbyeText));
  end_reason_ = wire::Goodbye::Reason_Name(reason);
  end_ = end_reason_ + ": " + text;
  queue_.clear();
  wire::Envelope envelope;
  envelope.mutable_goodbye()->set_reason(reason);
  envelope.mutable_goodbye()->set_text(std::move(text));
  send(envelope);
}

void SessionProtocol::send(const wire::Envelope& envelope) { queue_.push_control(packet_of(envelope)); }

Packets SessionProtocol::next_packets(Microseconds now) {
  auto packets = queue_.take(
      now,
      [this](const std::shared_ptr<const EncodedFrame>& frame, const ViewAnswer& answer) {
        return frame_packet(*bodies_, frame, answer);
      },
      [](const NoChange& event) { return packet_of(no_change_message(event)); }, !pace_.full(0, now));
  if (packets.empty() || state_ != State::kOpen) return packets;
  std::size_t bytes = 0;
  for (const auto& packet : packets) bytes += packet.size();
  const auto pings = pace_.write(bytes, now);
  if (pings.in_front) packets.insert(packets.begin(), ping_packet(*pings.in_front));
  if (pings.behind) packets.push_back(ping_packet(*pings.behind));
  return packets;
}

bool SessionProtocol::finished(Microseconds now) const {
  if (state_ == State::kClosed) return true;
  return state_ == State::kClosing && (queue_.idle() || now - closing_since_ > policy_.goodbye_timeout);
}

}  // namespace darm::session
