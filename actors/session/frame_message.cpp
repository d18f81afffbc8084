#include "actors/session/frame_message.hpp"

#include <cmath>

#include "actors/session/deflate.hpp"
#include "proto/framing.hpp"
#include "proto/limits.hpp"

namespace darm::session {
namespace {

std::string packed(std::span<const std::uint8_t> tile) {
  const auto bytes = deflate(tile, Effort::kEachFrame);
  return {bytes.begin(), bytes.end()};
}

SharedBytes serialize_body(const EncodedFrame& frame) {
  wire::StreamFrame m;
  m.set_frame(frame.frame);
  m.set_key(frame.key);
  m.set_stream(static_cast<std::uint32_t>(frame.stream));
  m.set_h264(frame.h264.data(), frame.h264.size());
  for (const auto& e : frame.edits) {
    auto* edit = m.add_page_edits();
    edit->set_tile(e.tile.packed);
    edit->set_slot(e.slot);
    if (e.coverage) edit->set_coverage(packed(*e.coverage));
    if (e.through) edit->set_through(packed(*e.through));
  }
  for (const auto& w : frame.lossless) {
    if (!w.image) continue;
    auto* pixels = m.add_pixels();
    pixels->set_slot(w.slot);
    pixels->set_rgb(w.image->rgb.data(), w.image->rgb.size());
  }
  auto bytes = std::make_shared<Bytes>(m.ByteSizeLong());
  m.SerializeWithCachedSizesToArray(bytes->data());
  return bytes;
}

void put_stamps(const FrameStamps& s, wire::Stamps& out) {
  out.set_client_sent(s.client_sent);
  out.set_camera_received(s.camera_received);
  out.set_view_started(s.view_started);
  out.set_view_ready(s.view_ready);
  out.set_composed(s.composed);
  out.set_encode_started(s.encode_started);
  out.set_picture_composed(s.picture_composed);
  out.set_encoded(s.encoded);
  out.set_sent(s.sent);
}

}  // namespace

SharedBytes FrameBodies::body_of(const std::shared_ptr<const EncodedFrame>& frame) {
  const std::lock_guard lock(mutex_);
  for (const auto& e : entries_) {
    if (e.body && e.frame.lock() == frame) return e.body;
  }
  auto body = serialize_body(*frame);
  entries_[next_] = {frame, body};
  next_ = (next_ + 1) % entries_.size();
  return body;
}

Packet frame_packet(FrameBodies& bodies, const std::shared_ptr<const EncodedFrame>& frame, const ViewAnswer& answer) {
  Packet packet;
  packet.body = bodies.body_of(frame);
  wire::StreamFrame own;
  own.set_answers(answer.sequence);
  own.set_error(answer.error);
  own.set_resolution_error(answer.resolution_error);
  own.set_omitted_error(answer.omitted_error);
  put_stamps(answer.stamps, *own.mutable_stamps());
  packet.tail.resize(own.ByteSizeLong());
  own.SerializeWithCachedSizesToArray(packet.tail.data());
  // Envelope.frame or view_frame by hand: tag (field number, wire type 2) and length of body and tail together.
  packet.head.resize(proto::kLengthBytes);
  const int field =
      frame->layer == StreamLayer::kView ? wire::Envelope::kViewFrameFieldNumber : wire::Envelope::kFrameFieldNumber;
  packet.head.push_back(static_cast<std::uint8_t>((field << 3) | 2));
  std::size_t length = packet.body->size() + packet.tail.size();
  const std::size_t message = length;
  for (; length >= 0x80; length >>= 7) packet.head.push_back(static_cast<std::uint8_t>(length | 0x80));
  packet.head.push_back(static_cast<std::uint8_t>(length));
  proto::put_length(static_cast<std::uint32_t>(packet.head.size() - proto::kLengthBytes + message), packet.head.data());
  return packet;
}

wire::Envelope no_change_message(const NoChange& event) {
  wire::Envelope envelope;
  auto* m = envelope.mutable_no_change();
  m->set_answers(event.answer.sequence);
  m->set_error(event.error);
  m->set_resolution_error(event.answer.resolution_error);
  m->set_omitted_error(event.answer.omitted_error);
  put_stamps(event.answer.stamps, *m->mutable_stamps());
  return envelope;
}

SharedBytes coarse_message(const CoarseTexture& texture) {
  wire::Envelope envelope;
  auto* m = envelope.mutable_coarse();
  m->set_version(texture.version);
  m->set_width(texture.width);
  m->set_height(texture.height);
  m->set_h264(texture.h264.data(), texture.h264.size());
  return std::make_shared<const Bytes>(proto::frame(envelope));
}

std::optional<ParsedPose> parse_pose(const wire::Pose& pose) {
  ParsedPose p;
  p.camera.position = {pose.position().x(), pose.position().y(), pose.position().z()};
  const double norm = std::sqrt(double(pose.qw()) * pose.qw() + double(pose.qx()) * pose.qx() +
                                double(pose.qy()) * pose.qy() + double(pose.qz()) * pose.qz());
  if (!(std::isfinite(norm) && norm > 1e-3)) return std::nullopt;
  const auto unit = [&](float v) { return static_cast<float>(double(v) / norm); };
  p.camera.orientation.w = unit(pose.qw());
  p.camera.orientation.x = unit(pose.qx());
  p.camera.orientation.y = unit(pose.qy());
  p.camera.orientation.z = unit(pose.qz());
  p.camera.fovy = pose.fovy();
  p.viewport = {pose.width(), pose.height()};
  if (!is_valid(p.camera) || !is_valid(p.viewport)) return std::nullopt;
  return p;
}

void put_pose(const Camera& camera, const Viewport& viewport, wire::Pose& out) {
  out.mutable_position()->set_x(camera.position.x);
  out.mutable_position()->set_y(camera.position.y);
  out.mutable_position()->set_z(camera.position.z);
  out.set_qw(camera.orientation.w);
  out.set_qx(camera.orientation.x);
  out.set_qy(camera.orientation.y);
  out.set_qz(camera.orientation.z);
  out.set_fovy(camera.fovy);
  out.set_width(viewport.width);
  out.set_height(viewport.height);
}

}  // namespace darm::session
