// The tile scheduler: what each session sees -> what is shaded, who shares a stream, what a stream holds, when its
// frames go out. Handlers are in tile_scheduler_actor.cpp, looks in tile_scheduler_looks.cpp, streams in
// tile_scheduler_streams.cpp, private layers in tile_scheduler_views.cpp.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "actors/encoder/encoder_messages.hpp"
#include "actors/renderer/renderer_messages.hpp"
#include "actors/renderer/view_messages.hpp"
#include "actors/runtime/actor.hpp"
#include "actors/runtime/metrics.hpp"
#include "actors/runtime/registry.hpp"
#include "actors/session/session_messages.hpp"
#include "actors/tile_scheduler/frame_pace.hpp"
#include "actors/tile_scheduler/image_store.hpp"
#include "actors/tile_scheduler/member_link.hpp"
#include "actors/tile_scheduler/private_layer.hpp"
#include "actors/tile_scheduler/shared_set.hpp"
#include "actors/tile_scheduler/slot_waits.hpp"
#include "actors/tile_scheduler/stream_groups.hpp"
#include "actors/tile_scheduler/tile_scheduler_messages.hpp"
#include "actors/tile_scheduler/trace_budget.hpp"
#include "actors/tile_scheduler/view_demand.hpp"
#include "actors/tile_scheduler/view_job.hpp"
#include "actors/tile_scheduler/working_set.hpp"

namespace darm::tile_scheduler {

struct SchedulerOptions {
  double updates_per_second = 10;  ///< 0.1..1000: traces, allocations and frames per session
  int passes_moving = 1;           ///< visibility passes in the first update of a new pose, 1..64
  int passes_still = 1;            ///< and in each further one, until kAllPasses are done
  float lit = 0.8f;                ///< while pictures of less than this share of a view are there,
  int passes_unlit = 2;            ///< passes after these come
  int updates_unlit = 4;           ///< in one of so many updates: the same cores make the pictures
  /// Share of the pool's time that tracing visibility may take before passes of still views wait; those under
  /// `passes_unlit` never do.
  double looking = 0.15;
  /// Of a stream of twice as many members as this, each looks less often while it moves, down to once in
  /// `crowd_updates`: they see much the same, and what they see is shared.
  std::size_t crowd = 4;
  std::size_t crowd_updates = 5;
  double crowd_rays = 24'000;  ///< a second, for all of them together
  double near = 0.02;          ///< but a camera that has moved by this share of the scene's diagonal,
  double near_angle = 0.2;     ///< or turned by so many radians since its last look, is looked at
  double glancing = 0.15;      ///< and that of views that move: where there are many, each look has fewer rays
  double coding = 0.25;        ///< and that composing and encoding shared streams may take, views that move apart
  double coding_views = 0.05;  ///< and private layers
  std::size_t image_bytes = 512u << 20;  ///< pictures of tiles kept, used or not
  /// When a still view that does not fit its slots is weighed anew by what its pictures have come to show; then after
  /// twice that, and so on: slots change hands a few times at first, and then no more.
  Microseconds reweigh_interval = 1'000'000;
  /// How long none of a stream's members has seen something else, nor anybody come who does, until tiles change hands
  /// less readily; and since `lit`, too, until they hardly do. By then losses are measured on pictures of many samples.
  Microseconds rests_after = 1'000'000;
  Microseconds rested_after = 20'000'000;
  /// How long a stream's first frame waits for a first picture: encoding no tiles costs as much as encoding all.
  Microseconds first_frame_wait = 300'000;
  /// Least time between key frames that sessions of a stream ask for: each writes every slot and the whole page table.
  Microseconds key_interval = 500'000;
  /// Least time between key frames for those who come to a stream: whoever comes meanwhile shares the next.
  Microseconds join_interval = 300'000;
  GroupOptions groups;
  LinkOptions link;
  /// Streams are shared by the tiles that make up so much of each view; coarser levels do for the rest.
  double significant = 0.98;
  /// A look of one of many that shows less than this share of what its stream's tiles were chosen for is answered when
  /// they have been chosen again.
  float known = 0.9f;
  double weighing = 0.3;        ///< of one processor: what choosing tiles may take where there are several clients,
  double weighing_views = 0.1;  ///< and choosing private ones
  /// Least time between private layers that are chosen anew, where there are several: each makes light for one eye.
  Microseconds view_interval = 80'000;
  WorkingSetOptions working_set;
  AllocationOptions allocation;
  StreamOptions stream;
  PrivateLayerOptions view;
  Microseconds view_refine_interval = 100'000;  ///< least time between frames of a private layer that only refine it
};

/// The scheduler's neighbours, resolved at each use, so that they may be spawned after it. Every member must be set.
struct Peers {
  std::function<runtime::Ref<renderer::Inbox>()> renderer;
  std::function<runtime::Ref<renderer::ViewInbox>()> view_renderer;  ///< empty: no session has a private layer
  /// Makes the encoder actor of a stream; also called again where the old one no longer takes messages.
  std::function<runtime::Ref<encoder::Inbox>(StreamId, const StreamFormat&)> make_encoder;
  /// Ends the encoder actor that make_encoder gave.
  std::function<void(StreamId, const runtime::Ref<encoder::Inbox>&)> destroy_encoder;
  /// Who gets the frames of a stream; empty before the stream is destroyed.
  std::function<void(StreamId, std::vector<SessionId>)> set_receivers;
  std::shared_ptr<runtime::Registry<SessionId, session::Inbox>> sessions;
};

class TileSchedulerActor : public runtime::Actor<tile_scheduler::Inbox> {
 public:
  /// `rays` must have been built from the scene that `layout` describes. `metrics` must outlive the actor.
  /// `materials`, by instance: without them, or where none has weight, no session has a private layer.
  TileSchedulerActor(runtime::Context<tile_scheduler::Inbox> context, std::shared_ptr<const atlas::Layout> layout,
                     std::shared_ptr<const renderer::trace::RayScene> rays, std::shared_ptr<const Peers> peers,
                     SchedulerOptions options, runtime::MetricSink& metrics = runtime::null_metrics(),
                     std::shared_ptr<const std::vector<scene::ViewMaterial>> materials = nullptr);

  void on_start() override;
  void on(SessionOpened&& message);
  void on(SessionClosed&& message);
  void on(ViewChanged&& message);
  void on(KeyFrameWanted&& message);
  void on(LinkChanged&& message);
  void on(TilesShaded&& message);
  void on(ViewTilesShaded&& message);
  void on(CoarsePictured&& message);
  void on(FrameDone&& message);
  void on(ViewTraced&& message);
  void on(Tick&& message);

 private:
  struct Stream;
  // One client: what it looks at, what it needs, what it has not been told yet.
  struct Session {
    SessionId id{};
    StreamFormat format;
    float target_error = 0;
    float light_error = 1;           // estimated, of the shared light that its view has
    encoder::ViewError told{{}, 1};  // with that of its private layer, and what stands beside
    std::optional<Microseconds> error_at;
    Stream* stream = nullptr;  // from its first look on
    bool awaits_key = false;   // it came to the stream after that's last key frame
    bool unchosen = false;     // it sees what the stream's tiles have not been chosen for yet
    WorkingSet set;
    Microseconds grouped_at = 0;  // when groups_ heard of its set
    bool ungrouped = false;       // which has changed since then
    MemberLink link;
    std::optional<ViewAnswer> answer;  // due with the stream's next frame
    std::optional<ViewChanged> view;   // newest camera
    std::optional<ViewChanged> posed;  // the camera of the working set's pose
    CameraSequence taken_up = 0;       // newest sequence that a trace or an answer includes
    std::shared_ptr<ViewJob> job;      // under way
    Microseconds last_start = 0;
    std::optional<Microseconds> moved_at;  // its newest camera, looked at or not, was another than the one before
    int updates_waited = 0;
    std::optional<PrivateLayer> view_layer;  // what depends on its eye
    std::optional<ViewChanged> view_posed;   // the camera of what the layer holds
    Microseconds view_weighed_at = 0;        // when its tiles were chosen
    bool view_unweighed = false;             // it has seen more since then
    StreamId view_stream_id{};
    runtime::Ref<encoder::Inbox> view_encoder;  // made with its first frame
    std::optional<Microseconds> view_key_forced_at;
    bool view_key_put_off = false;
    Session(StreamFormat f, const SchedulerOptions& o) : format(f), set(o.working_set), link(o.link) {}
    ~Session() {
      if (job) job->cancel();  // it goes with the session, and with the scheduler
    }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;
  };
  // One PhysTex and its encoder, for all who look at much the same.
  struct Stream {
    StreamId id{};
    StreamFormat format;
    runtime::Ref<encoder::Inbox> encoder;
    StreamState state;
    SlotWaits waits;
    Microseconds waits_at = 0;      // when they were looked at
    std::vector<Session*> members;  // by id
    SharedSet together;             // what they see, while there are several
    ViewDemand demand;              // as slots were chosen last
    ChainIndex known;               // numbers of its chains
    Microseconds weighed_at = 0;    // when that was
    Microseconds choose_after = 0;  // the next time they are chosen, at the earliest
    bool unchosen = false;          // there is more to see
    bool ungranted = false;         // pictures have come since then
    bool pictures_since = false;    // and since slots were chosen
    bool untold = false;            // errors have changed since the frame that is under way was made
    Microseconds changed_at = 0;    // when one of its members, or one that came, last saw something else
    Microseconds unlit_at = 0;      // when slots were last chosen for less than `lit`
    int reweighed = 0;              // times that they were chosen for nothing but that, since somebody saw more
    Microseconds asked_at = 0;      // for the first pictures
    std::optional<Microseconds> key_at;
    std::optional<Microseconds> key_forced_at;
    bool key_put_off = false;  // asked for again too soon after that
    Stream(StreamId number, const StreamFormat& f, const StreamOptions& o) : id(number), format(f), state(f, o) {}
    [[nodiscard]] bool shared() const { return members.size() > 1; }
    /// Its frames go out as its members' links have room for them.
    [[nodiscard]] bool follows_links() const { return !shared() || format.lane > 0; }
  };

  [[nodiscard]] ImageLookup images() const;
  [[nodiscard]] Session* find(SessionId id);
  void schedule_tick();
  [[nodiscard]] std::vector<Session*> by_last_look();
  void update(Session& session);
  void send_work();
  void send_work_soon();

  // What views are told of their errors.
  void estimate_errors(Stream& stream, Microseconds apart = kErrorApart);
  void estimate_error(const Stream& stream, Session& session) const;
  [[nodiscard]] static float light_error(const Stream& stream);
  void tell_no_change(const ViewAnswer& answer);
  void tell_errors(Stream& stream);
  void record_errors();

  // Looks.
  void start_view(Session& session);
  bool look_with_another(Session& session);
  [[nodiscard]] int passes_due(Session& session, bool moved);
  [[nodiscard]] std::uint32_t rays_due(const Session& session, bool moved);
  [[nodiscard]] std::uint32_t enough_rays(const Session& session, Microseconds interval) const;
  [[nodiscard]] Microseconds look_interval(const Session& session) const;
  [[nodiscard]] bool seen_by_others(const Session& session) const;
  void answer_without_look(Session& session);
  [[nodiscard]] std::shared_ptr<ViewJob> make_job(Session& session, bool moved, int done, int count);
  void post_slices(const std::shared_ptr<ViewJob>& job);
  void finish_view(Session& session);
  void know_view(Session& session, ViewAnswer answer);
  void count_moving();

  // Streams.
  void place(Session& session);
  void enter(Session& session, StreamId id);
  void leave(Session& session);
  void settle_link(Session& session);
  [[nodiscard]] bool held(const Stream& stream) const;
  [[nodiscard]] std::size_t most_bytes(const Stream& stream, bool key) const;
  [[nodiscard]] Microseconds frame_interval(const Stream& stream, bool moving) const;
  void note_sent(Stream& stream, const FrameDone& done);
  void note_slots(Stream& stream, const StreamStep& step);
  void regroup();
  void settle(Stream& stream);
  void group(Session& session);
  void gather(Stream& stream);
  [[nodiscard]] static MemberLook look_of(const Session& session);
  void note_seen(Session& session);
  [[nodiscard]] Moves moves_of(const Stream& stream) const;
  void choose_if_due(Stream& stream);
  void choose(Stream& stream);
  void set_targets(Stream& stream) const;
  void grant(Stream& stream);
  void note_chosen(Stream& stream, std::chrono::microseconds started);
  void force_key(Stream& stream);
  void admit(Stream& stream, Microseconds now);
  void compose(Stream& stream);
  void answer_meanwhile(Stream& stream);
  void send_frame(Stream& stream, encoder::ComposeFrame frame);

  // Private layers.
  void open_view(Session& session);
  void name_view(Session& session);
  void close_view(Session& session);
  [[nodiscard]] bool view_due(const Session& session) const;
  void see_own(Session& session, const ViewJob& job);
  void reallocate_view(Session& session);
  void send_view_work(const Session& session);
  void force_view_key(Session& session);
  void compose_view(Session& session);

  static constexpr Microseconds kWaitsEvery = 100'000;
  static constexpr Microseconds kErrorApart = 30'000;  // of one session, for each other on its stream
  static constexpr int kMostReweighed = 20;            // by then a doubled pause is days
  static constexpr double kUsualKey = 1e6;             // bytes, until one was made

  std::shared_ptr<const atlas::Layout> layout_;
  std::shared_ptr<const renderer::trace::RayScene> rays_;
  std::shared_ptr<const Peers> peers_;
  SchedulerOptions options_;
  runtime::MetricSink& metrics_;
  std::shared_ptr<const std::vector<scene::ViewMaterial>> materials_;  // by instance; null: not known
  bool view_layers_ = false;                                           // there is something for private layers
  Microseconds period_;
  double near_;  // options_.near, in metres
  TraceBudget looking_;
  FramePace pace_;
  FramePace view_pace_;
  double view_weighing_us_ = 5'000;  // what choosing a private layer's tiles is expected to take
  std::size_t moving_ = 0;           // views that move
  std::size_t view_streams_ = 0;     // private layers in use
  double key_bytes_ = kUsualKey;     // of streams of those that keep up
  ImageStore images_;
  std::shared_ptr<const CoarseLuma> coarse_;  // null: none yet
  std::map<SessionId, std::unique_ptr<Session>> sessions_;
  std::map<StreamId, std::unique_ptr<Stream>> streams_;
  StreamGroups groups_;
  std::uint64_t next_job_ = 1;
  std::uint64_t next_working_set_ = 1;
  std::uint32_t next_stream_ = 1;
  bool pictures_came_ = false;   // since the last tick
  bool work_changed_ = false;    // since it was sent
  Microseconds work_after_ = 0;  // it is not sent again before
};

}  // namespace darm::tile_scheduler
