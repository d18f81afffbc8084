// One simulated client without socket, clock or thread: bytes and the time go in, messages and figures come out.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/core/view.hpp"
#include "client/load/answer_log.hpp"
#include "client/load/client_figures.hpp"
#include "client/load/crowd.hpp"
#include "client/load/nal_units.hpp"
#include "client/load/picture_sink.hpp"
#include "client/load/route.hpp"
#include "client/load/scene_share.hpp"
#include "client/load/stream_check.hpp"
#include "client/load/table_witness.hpp"
#include "proto/darm.pb.h"
#include "proto/datagram.hpp"
#include "proto/framing.hpp"

namespace darm::client::load {

struct MachineSettings {
  std::uint32_t width = 1280, height = 720;  ///< of every view
  std::uint32_t max_phystex = 2048;
  std::uint32_t max_view_phystex = 1024;  ///< of the private layer; 0: none
  bool udp = true;                        ///< cameras by UDP where the server offers it
  std::int64_t epoch_us = 0;              ///< when walkthroughs began, for all clients
};

/// To be sent by UDP or, framed, by TCP.
struct Outgoing {
  bool datagram = false;
  std::vector<std::uint8_t> bytes;
};

/// What is shared by all clients of a run.
struct Commons {
  SceneShare scenes;
  TableWitness tables;
};

/// From Hello on. Cameras go out at the server's rate from Welcome on; every message that comes is checked. What comes
/// is bounded: a message by kMostMessageBytes, tables by the limits of SceneModel.
class ClientMachine {
 public:
  static constexpr std::size_t kMostMessageBytes = std::size_t{64} << 20;
  enum class Phase : std::uint8_t { kBegun, kWelcomed, kStreaming, kEnded };

  /// References must outlive it; `pictures` may be null.
  ClientMachine(const ClientPlan& plan, const MachineSettings& settings, const Route& route, Commons& commons,
                PictureSink* pictures, std::int64_t now_us);

  /// The first bytes to send.
  [[nodiscard]] std::vector<std::uint8_t> hello(std::int64_t now_us) const;
  void receive(std::span<const std::uint8_t> bytes, std::int64_t now_us);
  /// What is to be sent by now: cameras, feedback, requests for key frames, pongs.
  [[nodiscard]] std::vector<Outgoing> due(std::int64_t now_us);
  /// The last bytes to send.
  [[nodiscard]] static std::vector<std::uint8_t> goodbye();

  /// Its line carries nothing until then.
  void stalls(std::int64_t until_us) { figures_.stalled_until_us = until_us; }

  /// Figures count from here to end_counting(), but not before the client's first frame.
  void begin_counting(std::int64_t now_us);
  /// Cameras of the counted time that have waited a second or more for their answer count with what they have waited.
  void end_counting(std::int64_t now_us);

  [[nodiscard]] Phase phase() const { return phase_; }
  /// Why it ended: the goodbye's reason, or bad_message, silence; empty while it goes on.
  [[nodiscard]] const std::string& end() const { return end_; }
  [[nodiscard]] const ClientPlan& plan() const { return plan_; }
  [[nodiscard]] const ClientFigures& figures() const { return figures_; }
  /// Where datagrams go; 0: nowhere.
  [[nodiscard]] std::uint32_t udp_port() const { return key_ ? udp_port_ : 0; }

 private:
  [[nodiscard]] View view(std::int64_t now_us) const;
  [[nodiscard]] bool counting() const { return figures_.from_us > 0 && figures_.to_us == 0; }
  void take(wire::Envelope& envelope, std::size_t bytes, std::int64_t now_us);
  void take_welcome(const wire::Welcome& welcome, std::int64_t now_us);
  void take_manifest(const wire::SceneManifest& manifest);
  void take_geometry(const wire::GeometryChunk& chunk);
  void take_coarse(const wire::CoarseTexture& coarse);
  void take_frame(const wire::StreamFrame& frame, std::int64_t now_us);
  void take_view_frame(const wire::StreamFrame& frame);
  void take_no_change(const wire::NoChange& answer, std::int64_t now_us);
  void note_answer(std::uint64_t sequence, std::int64_t now_us);
  void end_by(std::string reason);
  [[nodiscard]] Outgoing sealed(wire::DatagramBody body);
  void send_camera(std::int64_t now_us, std::vector<Outgoing>& out);
  void ask_for_keys(std::int64_t now_us, std::vector<Outgoing>& out);

  ClientPlan plan_;
  MachineSettings settings_;
  const Route& route_;
  Commons& commons_;
  PictureSink* pictures_;
  proto::FrameReader reader_;
  Phase phase_ = Phase::kBegun;
  std::string end_;
  ClientFigures figures_;

  std::uint64_t session_ = 0;
  std::optional<proto::SipKey> key_;
  std::uint32_t udp_port_ = 0;
  std::uint64_t datagrams_ = 0;
  View start_;
  StreamShape shape_, view_shape_;
  std::shared_ptr<const SceneModel> scene_;
  std::vector<bool> chunks_;  // that have come
  std::optional<StreamCheck> stream_, view_stream_;

  AnswerLog answers_;
  std::vector<float> uncounted_;
  std::uint64_t sequence_ = 0;
  std::uint64_t sequence_stalled_ = 0;  // of the last camera before its line went on
  std::int64_t period_us_ = 100'000;
  std::int64_t next_camera_us_ = 0;
  std::int64_t heard_us_ = 0;
  std::int64_t asked_us_ = 0;
  std::uint64_t reported_frame_ = 0;
  std::vector<Outgoing> replies_;
};

}  // namespace darm::client::load
