#include "client/load/client_machine.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "proto/limits.hpp"

namespace darm::client::load {
namespace {

constexpr std::int64_t kSecond = 1'000'000;
constexpr std::int64_t kKeyRequestEvery = kSecond / 2;
constexpr std::int64_t kSilence = 30 * kSecond;
constexpr std::int64_t kLateAnswer = kSecond;
constexpr std::size_t kMostReplies = 16;  // a server that pings more than that between two turns is not answered
constexpr std::uint32_t kLargestPhysTex = 4096;

bool fits(std::uint32_t phystex) {
  return phystex >= kSlotSize && phystex <= kLargestPhysTex && phystex % kSlotSize == 0;
}

}  // namespace

ClientMachine::ClientMachine(const ClientPlan& plan, const MachineSettings& settings, const Route& route,
                             Commons& commons, PictureSink* pictures, std::int64_t now_us)
    : plan_(plan),
      settings_(settings),
      route_(route),
      commons_(commons),
      pictures_(pictures),
      reader_(kMostMessageBytes),
      heard_us_(now_us) {
  figures_.begun_us = now_us;
  start_.width = settings.width;
  start_.height = settings.height;
}

View ClientMachine::view(std::int64_t now_us) const {
  const auto key = route_.at(plan_, static_cast<double>(now_us - settings_.epoch_us) / 1e6);
  if (key) return to_view(*key, settings_.width, settings_.height);
  View view = start_;
  view.position += plan_.shift;
  return view;
}

std::vector<std::uint8_t> ClientMachine::hello(std::int64_t now_us) const {
  wire::Envelope envelope;
  auto& hello = *envelope.mutable_hello();
  hello.set_version(proto::kProtocolVersion);
  hello.set_client("darm-load " + std::to_string(plan_.index));
  if (route_.at(plan_, 0)) *hello.mutable_pose() = to_pose(view(now_us));
  hello.set_max_phystex(settings_.max_phystex);
  hello.set_chroma_444(true);
  hello.set_max_view_phystex(settings_.max_view_phystex);
  return proto::frame(envelope);
}

std::vector<std::uint8_t> ClientMachine::goodbye() {
  wire::Envelope envelope;
  envelope.mutable_goodbye()->set_reason(wire::Goodbye::CLIENT_LEAVES);
  return proto::frame(envelope);
}

void ClientMachine::end_by(std::string reason) {
  if (phase_ == Phase::kEnded) return;
  phase_ = Phase::kEnded;
  end_ = std::move(reason);
}

void ClientMachine::receive(std::span<const std::uint8_t> bytes, std::int64_t now_us) {
  if (phase_ == Phase::kEnded) return;
  heard_us_ = now_us;
  if (counting()) figures_.bytes += bytes.size();
  reader_.feed(bytes);
  thread_local wire::Envelope envelope;  // all clients in turn: its memory is taken once
  while (phase_ != Phase::kEnded) {
    const std::size_t before = reader_.buffered();
    const auto got = reader_.next(envelope);
    if (!got) {
      figures_.faults.add(Fault::kMessage);
      return end_by("bad_message");
    }
    if (!*got) return;
    take(envelope, before - reader_.buffered(), now_us);
  }
}

void ClientMachine::take(wire::Envelope& envelope, std::size_t bytes, std::int64_t now_us) {
  using Body = wire::Envelope::BodyCase;
  const auto body = envelope.body_case();
  if (body == Body::kGoodbye) {
    const auto& name = wire::Goodbye::Reason_Name(envelope.goodbye().reason());
    return end_by(name.empty() ? "UNSPECIFIED" : name);
  }
  if (phase_ == Phase::kBegun && body != Body::kWelcome) {
    figures_.faults.add(Fault::kMessage);
    return end_by("bad_message");
  }
  switch (body) {
    case Body::kWelcome:
      return take_welcome(envelope.welcome(), now_us);
    case Body::kPing: {
      wire::Envelope pong;
      pong.mutable_pong()->set_time_us(envelope.ping().time_us());
      if (replies_.size() < kMostReplies) replies_.push_back({false, proto::frame(pong)});
      return;
    }
    case Body::kManifest:
      take_manifest(envelope.manifest());
      break;
    case Body::kGeometry:
      take_geometry(envelope.geometry());
      break;
    case Body::kCoarse:
      take_coarse(envelope.coarse());
      break;
    case Body::kFrame:
      take_frame(envelope.frame(), now_us);
      break;
    case Body::kViewFrame:
      take_view_frame(envelope.view_frame());
      break;
    case Body::kNoChange:
      return take_no_change(envelope.no_change(), now_us);
    default:
      return;  // a newer server may say more
  }
  if (pictures_ != nullptr) pictures_->take(std::move(envelope), bytes);
}

void ClientMachine::take_welcome(const wire::Welcome& welcome, std::int64_t now_us) {
  const bool private_layer = welcome.view_phystex() > 0;
  if (phase_ != Phase::kBegun || welcome.version() != proto::kProtocolVersion || welcome.lossless() ||
      !fits(welcome.phystex_size()) || (private_layer && !fits(welcome.view_phystex()))) {
    figures_.faults.add(Fault::kMessage);
    return end_by("bad_message");
  }
  phase_ = Phase::kWelcomed;
  figures_.welcomed_us = now_us;
  session_ = welcome.session();
  key_ = settings_.udp ? proto::datagram_key(welcome.key()) : std::nullopt;
  udp_port_ = welcome.udp_port() <= 65535 ? welcome.udp_port() : 0;
  shape_ = {welcome.phystex_size(), welcome.chroma_444(), false};
  view_shape_ = {welcome.view_phystex(), welcome.chroma_444(), false};
  if (View start; from_pose(welcome.start(), start)) {
    start.width = settings_.width;
    start.height = settings_.height;
    start_ = start;
  }
  const double rate = std::isfinite(welcome.updates_per_second()) ? double{welcome.updates_per_second()} : 10.0;
  period_us_ = static_cast<std::int64_t>(1e6 / std::clamp(rate, 0.1, 240.0));
  next_camera_us_ = now_us;
  if (pictures_ != nullptr) pictures_->begin(shape_, view_shape_);
}

void ClientMachine::take_manifest(const wire::SceneManifest& manifest) {
  auto scene = scene_ ? fail("a second manifest") : commons_.scenes.of(manifest);
  if (!scene) return figures_.faults.add(Fault::kManifest);
  scene_ = std::move(*scene);
  chunks_.assign(manifest.geometry_chunks(), false);
  stream_.emplace(scene_, shape_);
  if (view_shape_.phystex_size > 0) view_stream_.emplace(scene_, view_shape_);
}

void ClientMachine::take_geometry(const wire::GeometryChunk& chunk) {
  if (chunk.index() >= chunks_.size() || chunks_[chunk.index()]) return figures_.faults.add(Fault::kGeometry);
  chunks_[chunk.index()] = true;
}

void ClientMachine::take_coarse(const wire::CoarseTexture& coarse) {
  if (!scene_) return figures_.faults.add(Fault::kMessage);
  const auto& level = scene_->levels().back();
  if (coarse.width() != level.width || coarse.height() != level.height ||
      picture_start(coarse.h264()) != PictureStart::kKey)
    figures_.faults.add(Fault::kCoarse);
}

void ClientMachine::take_frame(const wire::StreamFrame& frame, std::int64_t now_us) {
  if (!stream_) return figures_.faults.add(Fault::kMessage);
  const auto news = stream_->take(frame, figures_.faults);
  if (counting() && phase_ == Phase::kStreaming) figures_.frames_dropped += news.dropped;
  if (!news.applied) return;
  if (stream_->stream() != 0 && !commons_.tables.agrees(stream_->stream(), stream_->frame_shown(), stream_->table()))
    figures_.faults.add(Fault::kTableDiffers);
  if (figures_.stalled_until_us > 0 && now_us >= figures_.stalled_until_us && figures_.fresh_picture_us == 0)
    figures_.fresh_picture_us = now_us;
  note_answer(frame.answers(), now_us);
  if (counting() && phase_ == Phase::kStreaming) {
    ++figures_.stream_frames;
    figures_.key_frames += frame.key() ? 1 : 0;
  }
  if (phase_ == Phase::kStreaming) return;
  phase_ = Phase::kStreaming;
  figures_.first_frame_us = now_us;
}

void ClientMachine::take_view_frame(const wire::StreamFrame& frame) {
  if (!view_stream_) return figures_.faults.add(Fault::kMessage);
  if (view_stream_->take(frame, figures_.faults).applied && counting()) ++figures_.view_frames;
}

void ClientMachine::take_no_change(const wire::NoChange& answer, std::int64_t now_us) {
  if (!(std::isfinite(answer.error()) && answer.error() >= 0)) figures_.faults.add(Fault::kError);
  note_answer(answer.answers(), now_us);
  if (counting() && phase_ == Phase::kStreaming) ++figures_.no_changes;
}

void ClientMachine::note_answer(std::uint64_t sequence, std::int64_t now_us) {
  const bool counts = counting() && phase_ == Phase::kStreaming;
  switch (answers_.answered(sequence, now_us, counts ? figures_.waits_ms : uncounted_)) {
    case AnswerNews::kAnswer:
      if (sequence_stalled_ > 0 && sequence > sequence_stalled_ && figures_.caught_up_us == 0)
        figures_.caught_up_us = now_us;
      if (counts) ++figures_.answers;
      break;
    case AnswerNews::kBackwards:
      figures_.faults.add(Fault::kAnswerBackwards);
      break;
    case AnswerNews::kUnsent:
      figures_.faults.add(Fault::kAnswerUnsent);
      break;
    case AnswerNews::kNone:
    case AnswerNews::kAgain:
      break;
  }
  uncounted_.clear();
}

void ClientMachine::begin_counting(std::int64_t now_us) { figures_.from_us = now_us; }

void ClientMachine::end_counting(std::int64_t now_us) {
  if (!counting()) return;
  if (phase_ == Phase::kStreaming)
    answers_.still_waiting(std::max(figures_.from_us, figures_.first_frame_us), now_us, kLateAnswer, figures_.waits_ms);
  figures_.to_us = now_us;
}

std::vector<Outgoing> ClientMachine::due(std::int64_t now_us) {
  std::vector<Outgoing> out = std::exchange(replies_, {});
  if (phase_ == Phase::kEnded) return out;
  if (now_us - heard_us_ > kSilence) {
    end_by("silence");
    return out;
  }
  if (phase_ == Phase::kBegun) return out;
  if (now_us >= next_camera_us_) {
    next_camera_us_ = std::max(next_camera_us_ + period_us_, now_us - period_us_ / 2);
    send_camera(now_us, out);
  }
  ask_for_keys(now_us, out);
  return out;
}

Outgoing ClientMachine::sealed(wire::DatagramBody body) {
  if (udp_port() > 0) return {true, proto::seal_datagram(*key_, session_, ++datagrams_, body)};
  wire::Envelope envelope;
  if (body.has_camera()) *envelope.mutable_camera() = std::move(*body.mutable_camera());
  if (body.has_feedback()) *envelope.mutable_feedback() = std::move(*body.mutable_feedback());
  return {false, proto::frame(envelope)};
}

void ClientMachine::send_camera(std::int64_t now_us, std::vector<Outgoing>& out) {
  const View now_seen = view(now_us);
  wire::DatagramBody body;
  auto& camera = *body.mutable_camera();
  camera.set_sequence(++sequence_);
  if (now_us < figures_.stalled_until_us) sequence_stalled_ = sequence_;
  camera.set_client_time_us(now_us);
  *camera.mutable_pose() = to_pose(now_seen);
  out.push_back(sealed(std::move(body)));
  answers_.sent(sequence_, now_us);
  if (counting()) ++figures_.cameras;
  if (pictures_ != nullptr) pictures_->look(now_seen);
  if (!stream_ || stream_->frame_shown() == reported_frame_) return;
  reported_frame_ = stream_->frame_shown();
  wire::DatagramBody shown;
  auto& feedback = *shown.mutable_feedback();
  feedback.set_frame_shown(reported_frame_);
  feedback.set_frames_lost(stream_->frames_lost());
  feedback.set_client_time_us(now_us);
  out.push_back(sealed(std::move(shown)));
}

// By TCP: a request must not get lost.
void ClientMachine::ask_for_keys(std::int64_t now_us, std::vector<Outgoing>& out) {
  const bool shared = stream_ && stream_->key_frame_wanted();
  const bool own = view_stream_ && view_stream_->key_frame_wanted();
  if (!(shared || own) || now_us - asked_us_ < kKeyRequestEvery) return;
  asked_us_ = now_us;
  wire::Envelope envelope;
  auto& feedback = *envelope.mutable_feedback();
  feedback.set_key_frame_wanted(shared);
  feedback.set_view_key_frame_wanted(own);
  feedback.set_client_time_us(now_us);
  out.push_back({false, proto::frame(envelope)});
}

}  // namespace darm::client::load
