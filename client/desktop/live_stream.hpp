// The stream on a thread of its own: connecting, reading, decoding, sending cameras, coming back after a loss. Whoever
// draws looks in once a frame and never waits.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "client/core/connection.hpp"
#include "client/core/scene_model.hpp"
#include "client/core/stream_news.hpp"
#include "client/core/stream_player.hpp"
#include "client/desktop/figures.hpp"
#include "client/desktop/reunion.hpp"

namespace darm::client::desktop {

/// A session was agreed on.
struct Joined {
  View start;  ///< the scene's first camera
  StreamShape shape;
  std::optional<StreamShape> view_shape;  ///< of the private layer, if there is one
};

/// What came since the last look, in this order.
struct Arrivals {
  std::optional<Joined> joined;
  std::unique_ptr<SceneModel> scene;  ///< a new one, without geometry; the old one is void
  std::string scene_name;             ///< of `scene`
  std::vector<Chunk> chunks;          ///< of the newest scene
  StreamNews shared, view;
  std::int64_t answers_us = 0;    ///< when the newest camera that a frame answers was sent, by now_us(); 0: none
  std::uint64_t frame = 0;        ///< newest of the shared stream; 0: none
  std::vector<double> decode_ms;  ///< of each frame applied
};

/// What is known of the view without a new picture.
struct Answer {
  std::optional<double> error;             ///< the newest estimate, of light
  std::optional<double> resolution_error;  ///< beside it: for want of finer texels than the atlas has
  std::optional<double> omitted_error;     ///< beside both: of light that depends on the eye and is not streamed
  std::optional<double> lag_ms;  ///< from a camera sent until the server said that its picture needs no change
};

class LiveStream {
 public:
  /// `wake` is called on the stream's thread when there is something to look at. It must not block.
  LiveStream(ConnectOptions options, std::function<void()> wake);
  ~LiveStream();
  LiveStream(const LiveStream&) = delete;
  LiveStream& operator=(const LiveStream&) = delete;

  /// Where the visitor looks now. The newest is sent, as often as the server wants.
  void look(const View& view);
  /// `frame` was drawn, which took `draw_us`.
  void shown(std::uint64_t frame, std::int64_t draw_us);
  [[nodiscard]] bool has_arrivals() const;
  [[nodiscard]] Arrivals take();
  [[nodiscard]] Answer take_answer();
  /// Counted since the start, over all sessions.
  [[nodiscard]] Traffic traffic() const;
  [[nodiscard]] unsigned joins() const;
  /// There is a session now.
  [[nodiscard]] bool connected() const;
  /// Nobody looks any more: the session is let go once all of the scene is here, since it would come all over again.
  void leave();
  /// Somebody looks again: a session is there soon, and without words.
  void come_back();
  /// The scene is on the screen (Reunion::pictured).
  void pictured();
  /// A passing line (Reunion::say), and what is to be read at `now`, milliseconds of now_us().
  void say(std::string text, double now, double seconds);
  [[nodiscard]] Notice words(double now) const;

 private:
  // What is asked of the stream's thread.
  struct Wishes {
    std::optional<View> view;
    bool view_new = false;
    std::uint64_t shown_frame = 0;
    std::int64_t draw_us = 0;
    bool shown_new = false;
    bool away = false;
  };

  void run(const std::stop_token& stop);
  [[nodiscard]] bool may_let_go() const;
  void wait_for_somebody(const std::stop_token& stop);
  [[nodiscard]] Error visit(const std::stop_token& stop);
  [[nodiscard]] Result<void> join(const wire::Welcome& welcome);
  [[nodiscard]] Result<void> make_players();
  [[nodiscard]] Result<void> handle(const Received& message);
  [[nodiscard]] Result<void> begin_scene(const wire::SceneManifest& manifest);
  [[nodiscard]] Result<void> handle_frame(const Received& message);
  [[nodiscard]] Result<void> handle_view_frame(const wire::StreamFrame& frame);
  struct Errors {
    float light, resolution, omitted;
  };
  // Under the lock.
  void note_answer(const Errors& errors, std::uint64_t answers);
  [[nodiscard]] Result<void> send_due(Connection& connection);
  [[nodiscard]] Result<void> ask_for_keys(Connection& connection, std::int64_t now);
  // Changes the arrivals under the lock, then wakes whoever draws.
  template <class Change>
  void post(Change&& change);

  const ConnectOptions options_;
  const std::function<void()> wake_;

  // Of the stream's thread alone.
  std::optional<SceneModel> scene_;  // its geometry is read here and kept by whoever draws
  std::optional<StreamPlayer> player_, view_player_;
  bool let_go_ = false;  // the last session, since nobody looked
  StreamShape shape_;
  std::optional<StreamShape> view_shape_;
  std::int64_t camera_every_us_ = 50'000, camera_sent_us_ = 0, keys_asked_us_ = 0, decode_us_ = 0;
  std::uint64_t sequence_ = 0, answered_ = 0;
  std::minstd_rand random_{std::random_device{}()};

  mutable std::mutex mutex_;  // of all below
  std::condition_variable_any retry_;
  Wishes wishes_;
  Arrivals arrivals_;
  Answer answer_;
  bool arrived_ = false, connected_ = false;
  Traffic traffic_;
  Reunion reunion_;

  std::jthread thread_;  // last: it starts when all else is there, and is joined first
};

}  // namespace darm::client::desktop
