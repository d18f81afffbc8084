#include "actors/session/session_actor.hpp"

#include <sys/random.h>

#include <stdexcept>
#include <type_traits>

#include "actors/runtime/system.hpp"
#include "proto/limits.hpp"

namespace darm::session {
namespace {

constexpr std::chrono::milliseconds kTickEvery{500};
constexpr std::chrono::milliseconds kTellAgainAfter{50};

std::string random_key() {
  std::string key(proto::kSessionKeyBytes, '\0');
  if (getrandom(key.data(), key.size(), 0) != static_cast<ssize_t>(key.size())) {
    throw std::runtime_error("getrandom: the kernel gave no random bytes for a session key");
  }
  return key;
}

// SessionClosed must arrive, or the scheduler works for a ghost: a full mailbox is tried again until it takes it.
void tell_closed(runtime::Executor& executor, const runtime::Ref<tile_scheduler::Inbox>& scheduler, SessionId id,
                 int tries = 200) {
  if (scheduler.tell(tile_scheduler::SessionClosed(id)) || tries == 0 || !scheduler) return;
  executor.after(kTellAgainAfter,
                 [&executor, scheduler, id, tries] { tell_closed(executor, scheduler, id, tries - 1); });
}

}  // namespace

SessionActor::SessionActor(runtime::Context<Inbox> context, SessionId id,
                           std::shared_ptr<SessionSurroundings> surroundings, std::shared_ptr<Connection> connection,
                           std::shared_ptr<AddressPlaces::Place> place)
    : Actor(std::move(context)),
      id_(id),
      around_(std::move(surroundings)),
      connection_(std::move(connection)),
      place_(std::move(place)) {
  ++*around_->live;
}

SessionActor::~SessionActor() {
  finish("the session ended");
  protocol_.reset();  // holds nothing any more
  tell_memory();
  --*around_->live;
}

void SessionActor::on_start() {
  auto key = random_key();
  around_->datagrams->add(id_, *proto::datagram_key(key));
  around_->sessions->add(id_, self());
  protocol_ = std::make_unique<SessionProtocol>(id_, around_->policy, std::move(key), around_->udp_port, around_->scene,
                                                around_->bodies, now_us());
  connection_->attach(self());
  connection_->read();
  tick_later();
}

void SessionActor::tell_memory() const {
  around_->metrics->set("darm_session_memory_bytes", double(around_->policy.memory->held()));
}

void SessionActor::act(Actions&& actions) {
  for (auto& action : actions) {
    std::visit(
        [this](auto& a) {
          using A = std::decay_t<decltype(a)>;
          if constexpr (std::is_same_v<A, Noted>) {
            around_->metrics->count("darm_session_events_total", 1, {{"what", a.what}});
          } else if constexpr (std::is_same_v<A, PicturesDropped>) {
            around_->metrics->count("darm_session_pictures_dropped_total", double(a.count), {{"reason", a.why}});
          } else if constexpr (std::is_same_v<A, encoder::CoarseWanted>) {
            around_->coarse.tell(a);
          } else if constexpr (std::is_same_v<A, tile_scheduler::SessionOpened>) {
            opened_ = around_->scheduler.tell(a);
            if (!opened_) {
              protocol_->close(wire::Goodbye::SERVER_FULL, "The server is too busy for one more client.", now_us());
            } else {
              around_->log(id_, "opened: " + protocol_->client_name() + (place_ ? ", from " + place_->address() : ""));
            }
          } else {
            around_->scheduler.tell(a);
          }
        },
        action);
  }
  pump();
}

void SessionActor::pump() {
  if (finished_) return;
  protocol_->note_memory();
  if (auto packets = protocol_->next_packets(now_us()); !packets.empty()) {
    connection_->write(std::move(packets));
  } else if (protocol_->finished(now_us())) {
    finish(protocol_->end());
  }
}

void SessionActor::on(FrameEncoded&& event) {
  if (!finished_) act(protocol_->on_frame(event, now_us()));
}

void SessionActor::on(NoChange&& event) {
  protocol_->on_no_change(event);
  pump();
}

void SessionActor::on(CoarseUpdated&& event) {
  protocol_->on_coarse(event);
  pump();
}

void SessionActor::on(CloseSession&& command) {
  const auto reason = wire::Goodbye::Reason_IsValid(static_cast<int>(command.code))
                          ? static_cast<wire::Goodbye::Reason>(command.code)
                          : wire::Goodbye::UNSPECIFIED;
  protocol_->close(reason, reason == wire::Goodbye::SERVER_STOPS ? "The server stops." : "The server ends the session.",
                   now_us());
  pump();
}

void SessionActor::on(BytesReceived&& event) {
  if (finished_) return;
  act(protocol_->on_bytes(event.bytes, now_us()));
  if (!finished_) connection_->read();
}

void SessionActor::on(BytesSent&& event) {
  if (finished_) return;
  around_->metrics->count("darm_session_bytes_sent_total", static_cast<double>(event.count));
  act(protocol_->on_sent(now_us()));
}

void SessionActor::on(SocketClosed&& event) { finish("the connection is gone: " + event.why); }

void SessionActor::on(DatagramReceived&& event) {
  if (!finished_) act(protocol_->on_datagram(*event.body, now_us()));
}

void SessionActor::on(Tick&&) {
  if (finished_) return;
  act(protocol_->on_tick(now_us()));
  tell_memory();
  if (finished_) return;
  if (protocol_->finished(now_us())) return finish(protocol_->end());
  tick_later();
}

void SessionActor::tick_later() {
  executor().after(kTickEvery, [me = self()] { me.tell(Tick()); });
}

void SessionActor::finish(const std::string& why) {
  if (finished_) return;
  finished_ = true;
  around_->sessions->remove(id_);
  around_->datagrams->remove(id_);
  connection_->close();
  if (opened_) tell_closed(executor(), around_->scheduler, id_);
  const auto& reason = protocol_->end_reason();
  around_->metrics->count("darm_sessions_closed_total", 1, {{"reason", reason.empty() ? "connection_lost" : reason}});
  // Of who came and went without a word the counter is enough: there may be thousands.
  if (opened_ || !reason.empty()) around_->log(id_, "closed: " + why);
  system().stop(self());
}

}  // namespace darm::session
