#include "actors/encoder/h264_encoder.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/error.h>
#include <libavutil/frame.h>
#include <libavutil/log.h>
#include <libavutil/opt.h>
}

#include <algorithm>
#include <cmath>

namespace darm::encoder {
namespace {

struct ContextDeleter {
  void operator()(AVCodecContext* c) const { avcodec_free_context(&c); }
};
struct FrameDeleter {
  void operator()(AVFrame* f) const { av_frame_free(&f); }
};
struct PacketDeleter {
  void operator()(AVPacket* p) const { av_packet_free(&p); }
};
using ContextPtr = std::unique_ptr<AVCodecContext, ContextDeleter>;

std::string av_text(int code) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(code, text, sizeof text);
  return text;
}

void set_common(AVCodecContext& c, const H264Settings& s) {
  c.width = static_cast<int>(s.width);
  c.height = static_cast<int>(s.height);
  c.pix_fmt = s.chroma_444 ? AV_PIX_FMT_YUV444P : AV_PIX_FMT_YUV420P;
  c.time_base = AVRational{1000, static_cast<int>(std::lround(s.frames_per_second * 1000.0f))};
  c.framerate = AVRational{c.time_base.den, c.time_base.num};
  c.max_b_frames = 0;
  c.thread_count = static_cast<int>(s.threads);
  c.color_range = AVCOL_RANGE_JPEG;
  c.colorspace = AVCOL_SPC_BT709;
  c.color_primaries = AVCOL_PRI_BT709;
  c.color_trc = AVCOL_TRC_IEC61966_2_1;
  if (!s.chroma_444) c.chroma_sample_location = AVCHROMA_LOC_CENTER;
}

bool set_option(AVCodecContext& c, const char* name, const std::string& value) {
  return av_opt_set(c.priv_data, name, value.c_str(), 0) >= 0;
}

// False: an option does not exist or its value is not taken.
bool set_x264(AVCodecContext& c, const H264Settings& s) {
  return set_option(c, "preset", s.preset) && set_option(c, "tune", "zerolatency") &&
         set_option(c, "profile", s.chroma_444 ? "high444" : "high") && set_option(c, "forced-idr", "1") &&
         set_option(c, "crf", std::to_string(s.crf)) &&
         set_option(c, "x264-params",
                    "keyint=infinite:scenecut=0:bframes=0:fullrange=on:colorprim=bt709:colormatrix=bt709:"
                    "transfer=iec61966-2-1");
}

bool set_nvenc(AVCodecContext& c, const H264Settings& s) {
  c.gop_size = 1'000'000'000;
  return set_option(c, "preset", "p4") && set_option(c, "tune", "ull") && set_option(c, "zerolatency", "1") &&
         set_option(c, "delay", "0") && set_option(c, "forced-idr", "1") && set_option(c, "rc", "vbr") &&
         set_option(c, "cq", std::to_string(s.crf)) && set_option(c, "no-scenecut", "1") &&
         set_option(c, "profile", s.chroma_444 ? "high444p" : "high");
}

Result<ContextPtr> open(const std::string& name, const H264Settings& s) {
  const AVCodec* codec = avcodec_find_encoder_by_name(name.c_str());
  if (codec == nullptr) return fail(name + ": libavcodec has no such encoder; use libx264");
  ContextPtr context(avcodec_alloc_context3(codec));
  if (!context) return fail(name + ": out of memory");
  set_common(*context, s);
  const bool known = name == "libx264" || name == "h264_nvenc";
  if (!known) return fail(name + ": not an encoder we know how to drive; use libx264 or h264_nvenc");
  if (!(name == "libx264" ? set_x264(*context, s) : set_nvenc(*context, s))) {
    return fail(name + ": does not take our options; check the preset '" + s.preset + "'");
  }
  if (const int code = avcodec_open2(context.get(), codec, nullptr); code < 0) {
    return fail(name + ": cannot open at " + std::to_string(s.width) + "x" + std::to_string(s.height) + ": " +
                av_text(code) + "; check preset and size");
  }
  return context;
}

Result<void> check(const H264Settings& s) {
  const auto bad_side = [](std::uint32_t n) { return n < 16 || n > 8192 || n % 2 != 0; };
  if (bad_side(s.width) || bad_side(s.height)) {
    return fail("encoder: size " + std::to_string(s.width) + "x" + std::to_string(s.height) +
                " must be even and within 16..8192");
  }
  if (!(s.crf >= 0 && s.crf <= 51)) return fail("encoder: crf must be within 0..51");
  if (!(s.frames_per_second >= 0.1f && s.frames_per_second <= 1000)) {
    return fail("encoder: frames per second must be within 0.1..1000");
  }
  if (s.threads < 1 || s.threads > 64) return fail("encoder: threads must be within 1..64");
  return {};
}

}  // namespace

struct H264Encoder::State {
  H264Settings settings;
  std::string codec_name;
  ContextPtr context;
  std::unique_ptr<AVFrame, FrameDeleter> frame{av_frame_alloc()};
  std::unique_ptr<AVPacket, PacketDeleter> packet{av_packet_alloc()};
  std::int64_t next_pts = 0;
};

H264Encoder::H264Encoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
H264Encoder::~H264Encoder() = default;

Result<std::unique_ptr<H264Encoder>> H264Encoder::create(const H264Settings& settings) {
  if (auto ok = check(settings); !ok) return std::unexpected(ok.error());
  av_log_set_level(AV_LOG_FATAL);  // libav writes to stderr by itself; what matters comes back as a code
  auto state = std::make_unique<State>();
  if (!state->frame || !state->packet) return fail("encoder: out of memory");
  state->settings = settings;
  state->codec_name = settings.codec;
  auto context = open(settings.codec, settings);
  if (!context && settings.codec != "libx264") {
    state->codec_name = "libx264";
    context = open("libx264", settings);
  }
  if (!context) return std::unexpected(context.error());
  state->context = std::move(*context);
  return std::unique_ptr<H264Encoder>(new H264Encoder(std::move(state)));
}

Result<std::vector<std::uint8_t>> H264Encoder::encode(const PlanarPicture& picture, bool key) {
  auto& s = *state_;
  if (picture.width != s.settings.width || picture.height != s.settings.height ||
      picture.chroma_444 != s.settings.chroma_444) {
    return fail("encoder: picture does not have the size and chroma of its stream");
  }
  AVFrame& f = *s.frame;
  av_frame_unref(&f);
  f.format = s.context->pix_fmt;
  f.width = s.context->width;
  f.height = s.context->height;
  f.color_range = s.context->color_range;
  f.colorspace = s.context->colorspace;
  f.color_primaries = s.context->color_primaries;
  f.color_trc = s.context->color_trc;
  f.chroma_location = s.context->chroma_sample_location;
  f.pts = s.next_pts++;
  f.pict_type = key ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;
  // The planes are lent, not copied: the encoder has no frame of delay, so none is held after the packet is out. The
  // buffers own nothing; libav only wants them to be there.
  const std::uint32_t chroma_rows = picture.chroma_444 ? picture.height : (picture.height + 1) / 2;
  for (int i = 0; i < 3; ++i) {
    f.data[i] = const_cast<std::uint8_t*>(picture.plane[i]);
    f.linesize[i] = static_cast<int>(picture.stride[i]);
    f.buf[i] = av_buffer_create(
        f.data[i], picture.stride[i] * (i == 0 ? picture.height : chroma_rows), [](void*, std::uint8_t*) {}, nullptr,
        AV_BUFFER_FLAG_READONLY);
    if (f.buf[i] == nullptr) return fail("encoder: out of memory");
  }
  int code = avcodec_send_frame(s.context.get(), &f);
  av_frame_unref(&f);
  if (code < 0) return fail("encoder: " + s.codec_name + " refused a picture: " + av_text(code));
  code = avcodec_receive_packet(s.context.get(), s.packet.get());
  if (code < 0) return fail("encoder: " + s.codec_name + " gave no packet: " + av_text(code));
  std::vector<std::uint8_t> bytes(s.packet->data, s.packet->data + s.packet->size);
  av_packet_unref(s.packet.get());
  return bytes;
}

void H264Encoder::set_crf(float crf) {
  if (state_->codec_name == "libx264" && crf >= 0 && crf <= 51) {
    av_opt_set_double(state_->context->priv_data, "crf", static_cast<double>(crf), 0);
  }
}

const std::string& H264Encoder::codec_name() const { return state_->codec_name; }

}  // namespace darm::encoder
