#include "daemon/observe/metric_help.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace darm::observe {
namespace {

using Entry = std::pair<std::string_view, std::string_view>;

// Sorted by name.
constexpr auto kHelp = std::to_array<Entry>({
    {"darm_actor_drops_total", "Messages dropped by reason: full, oldest (made room), replaced (by a newer), stopped"},
    {"darm_actor_failures_total", "Handlers that threw, by kind of actor"},
    {"darm_actor_handled_total", "Messages handled, by kind of actor and message"},
    {"darm_actor_handling_seconds", "Time in a handler, by kind of actor"},
    {"darm_actor_mailbox_depth", "Messages waiting in the mailbox that was looked at last, by kind of actor"},
    {"darm_actor_processor_seconds_total", "Processor time of turns, by kind of actor"},
    {"darm_actors", "Actors alive, by kind"},
    {"darm_allocation_seconds", "Time to choose what a view's slots hold"},
    {"darm_build_info", "1, with the version as a label"},
    {"darm_coarse_bytes", "Size of the newest still of the coarse level"},
    {"darm_coarse_failures_total", "Stills of the coarse level that could not be coded"},
    {"darm_coarse_stills_total", "Stills of the coarse level that were coded"},
    {"darm_datagrams_dropped_total", "Datagrams dropped, by reason"},
    {"darm_encoder_bytes_total", "Bytes of H.264 that shared streams were coded to, before they are sent to anyone"},
    {"darm_encoder_compose_seconds", "Time to write a frame's tiles into the picture"},
    {"darm_encoder_encode_seconds", "Time in the codec, per frame of a shared stream"},
    {"darm_encoder_failures_total", "Frames that could not be coded; a key frame follows each"},
    {"darm_encoder_frames_refused_total", "Frames refused because too many waited for the encoder"},
    {"darm_encoder_frames_total", "Frames of shared streams coded"},
    {"darm_encoder_key_frames_total", "Those of them that were key frames"},
    {"darm_encoder_processor_seconds_total", "Processor time of composing and coding shared streams"},
    {"darm_frame_edits", "Edits of the page table per frame"},
    {"darm_frame_plan_seconds", "Time to decide on a frame"},
    {"darm_frame_writes", "Slots written per frame"},
    {"darm_key_frames_put_off_total", "Key frames asked for too soon after one, and made later"},
    {"darm_look_processor_seconds_total", "Processor time of tracing what views see"},
    {"darm_metric_series_dropped_total", "Measurements of series over the limit"},
    {"darm_ready", "1 while clients can connect"},
    {"darm_regroup_seconds", "Time to decide which sessions share streams, and to move them"},
    {"darm_renderer_bright_texels", "Texels of stored light that paths aim at; 0 where light is even enough"},
    {"darm_renderer_effect", "1 for an effect of light that the scene calls for, 0 for one it does not"},
    {"darm_renderer_effect_runs_total", "How often the code of an effect ran"},
    {"darm_renderer_images_total", "Pictures of tiles handed to the scheduler"},
    {"darm_renderer_phase_seconds", "Time of a round of the renderer, by phase: shading, pictures"},
    {"darm_renderer_pictures_refused_total", "Pictures of tiles that the scheduler had no room for; they come again"},
    {"darm_renderer_quarantined_samples_total", "Samples that were not finite: never stored"},
    {"darm_renderer_quarantined_tiles_total", "Tiles given up because their samples were not finite"},
    {"darm_renderer_texel_samples_total", "Samples of light taken, summed over texels"},
    {"darm_renderer_tiles_shaded_total", "Tiles that got samples"},
    {"darm_session_bytes_sent_total", "Bytes written to clients"},
    {"darm_session_events_total", "Faults and refusals of sessions, by what happened"},
    {"darm_session_memory_bytes",
     "What waits to be sent and private layers, of all sessions, against max_memory_bytes"},
    {"darm_session_pictures_dropped_total", "Pictures not sent to a client, by reason"},
    {"darm_sessions_closed_total",
     "Sessions that have ended, by reason: left, connection_lost, or the server's goodbye"},
    {"darm_sessions_set_apart_total", "Sessions that did not keep up and went to a stream of such sessions"},
    {"darm_sessions_slow", "Sessions on streams of those that do not keep up, now"},
    {"darm_sessions_taken_back_total", "Sessions that kept up again and came back"},
    {"darm_slot_evictions_total", "Tiles that lost their slot of a shared stream to another, key frames left out"},
    {"darm_slot_wait_seconds", "Time that a tile waited for its slot and picture, where it was not there at once"},
    {"darm_slots_used", "Slots of shared streams that hold a tile"},
    {"darm_store_bytes", "Bytes of the radiance store"},
    {"darm_store_refused_updates", "Updates that the store refused because it is full"},
    {"darm_store_tiles", "Tiles in the radiance store"},
    {"darm_store_torn_tiles", "Tiles dropped at start because they were written in part"},
    {"darm_stream_gather_seconds", "Time to gather anew what the sessions of a stream see"},
    {"darm_stream_joins_total", "Sessions that came to a stream of others"},
    {"darm_stream_sessions", "Sessions on a shared stream, once a stream and update"},
    {"darm_stream_splits_total", "Sessions taken from a stream that they no longer fitted"},
    {"darm_streams", "Shared streams"},
    {"darm_view_allocation_seconds", "Time to choose what a private layer's slots hold"},
    {"darm_view_bytes_total", "Bytes of H.264 of private layers"},
    {"darm_view_encode_seconds", "Time to compose and code a frame of a private layer"},
    {"darm_view_error", "Estimated RMS display error (0..1) of a view, once a view and update"},
    {"darm_view_error_worst", "Estimated RMS display error (0..1) of the worst view now"},
    {"darm_view_failed_tiles_total", "Tiles of private layers that could not be shaded"},
    {"darm_view_frame_writes", "Slots written per frame of a private layer"},
    {"darm_view_frames_total", "Frames of private layers coded"},
    {"darm_view_key_frames_put_off_total", "Key frames of private layers asked for too soon, and made later"},
    {"darm_view_omitted_error",
     "Expected RMS display error (0..1) of a view for want of light that depends on its eye"},
    {"darm_view_pictures_total", "Pictures of tiles of private layers"},
    {"darm_view_private_tiles", "Tiles that a view's private layer should have"},
    {"darm_view_resolution_error",
     "Estimated RMS display error (0..1) of a view for want of finer texels than the atlas has"},
    {"darm_view_samples_total", "Samples of light that depends on the eye"},
    {"darm_view_sessions", "Sessions with a private layer"},
    {"darm_view_shade_seconds_total", "Time in shading for private layers"},
    {"darm_view_slots_used", "Slots of private layers that hold a tile"},
    {"darm_view_tiles", "Tiles that a view should have"},
    {"darm_view_tiles_held", "Tiles kept for private layers"},
    {"darm_view_tiles_refused_total", "Tiles of private layers refused because too many were held"},
    {"darm_view_trace_seconds", "Time from a camera to what it sees"},
    {"darm_views_on_target", "Views whose estimated error has reached their target"},
    {"darm_web_requests_total", "HTTP requests, by status"},
});
static_assert(std::ranges::is_sorted(kHelp, {}, &Entry::first));

}  // namespace

std::string_view metric_help(std::string_view name) {
  const auto it = std::ranges::lower_bound(kHelp, name, {}, &Entry::first);
  return it != kHelp.end() && it->first == name ? it->second : std::string_view();
}

}  // namespace darm::observe
