#include "client/core/video_decoder.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/frame.h>
#include <libavutil/log.h>
#include <libavutil/pixdesc.h>
}

#include <cstring>
#include <string>

namespace darm::client {

struct VideoDecoder::State {
  AVCodecContext* context = nullptr;
  AVPacket* packet = nullptr;
  AVFrame* frame = nullptr;
  std::vector<std::uint8_t> padded;  // libav reads past the end of a packet

  ~State() {
    av_frame_free(&frame);
    av_packet_free(&packet);
    avcodec_free_context(&context);
  }
};

namespace {

std::string av_text(int code) {
  char text[AV_ERROR_MAX_STRING_SIZE] = {};
  av_strerror(code, text, sizeof(text));
  return text;
}

void copy_plane(const AVFrame& frame, int plane, std::uint32_t width, std::uint32_t height,
                std::vector<std::uint8_t>& out) {
  out.resize(std::size_t{width} * height);
  for (std::uint32_t row = 0; row < height; ++row) {
    std::memcpy(out.data() + std::size_t{row} * width,
                frame.data[plane] + static_cast<std::ptrdiff_t>(row) * frame.linesize[plane], width);
  }
}

}  // namespace

VideoDecoder::VideoDecoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
VideoDecoder::VideoDecoder(VideoDecoder&&) noexcept = default;
VideoDecoder& VideoDecoder::operator=(VideoDecoder&&) noexcept = default;
VideoDecoder::~VideoDecoder() = default;

Result<VideoDecoder> VideoDecoder::create(std::uint32_t max_width, std::uint32_t max_height) {
  av_log_set_level(AV_LOG_QUIET);  // damage in a stream is reported as an Error, not on the terminal
  const AVCodec* codec = avcodec_find_decoder(AV_CODEC_ID_H264);
  if (codec == nullptr) return fail("H.264: this libavcodec has no decoder for it");
  auto state = std::make_unique<State>();
  state->context = avcodec_alloc_context3(codec);
  state->packet = av_packet_alloc();
  state->frame = av_frame_alloc();
  if (state->context == nullptr || state->packet == nullptr || state->frame == nullptr)
    return fail("H.264: out of memory");
  auto& c = *state->context;
  c.flags |= AV_CODEC_FLAG_LOW_DELAY;
  c.thread_count = 2;
  c.thread_type = FF_THREAD_SLICE;  // frame threads would hold pictures back
  c.err_recognition = AV_EF_EXPLODE | AV_EF_BITSTREAM | AV_EF_BUFFER;
  // Padded to macroblocks and a margin: cropping hides the rest.
  c.max_pixels = (std::int64_t{max_width} + 64) * (std::int64_t{max_height} + 64);
  if (const int code = avcodec_open2(state->context, codec, nullptr); code < 0)
    return fail("H.264: decoder does not open: " + av_text(code));
  return VideoDecoder(std::move(state));
}

Result<void> VideoDecoder::decode(std::span<const std::uint8_t> bytes, Picture& picture) {
  if (bytes.empty() || bytes.size() > (1u << 30)) return fail("H.264: empty packet");
  State& s = *state_;
  s.padded.assign(bytes.size() + AV_INPUT_BUFFER_PADDING_SIZE, 0);
  std::memcpy(s.padded.data(), bytes.data(), bytes.size());
  s.packet->data = s.padded.data();
  s.packet->size = static_cast<int>(bytes.size());
  int code = avcodec_send_packet(s.context, s.packet);
  if (code < 0) return fail("H.264: packet refused: " + av_text(code));
  code = avcodec_receive_frame(s.context, s.frame);
  if (code == AVERROR(EAGAIN)) return fail("H.264: the packet gave no picture");
  if (code < 0) return fail("H.264: damaged picture: " + av_text(code));
  const AVFrame& f = *s.frame;
  const auto format = static_cast<AVPixelFormat>(f.format);
  const bool is_420 = format == AV_PIX_FMT_YUV420P || format == AV_PIX_FMT_YUVJ420P;
  const bool is_444 = format == AV_PIX_FMT_YUV444P || format == AV_PIX_FMT_YUVJ444P;
  const bool damaged = (f.flags & AV_FRAME_FLAG_CORRUPT) != 0 || f.decode_error_flags != 0;
  if (f.width <= 0 || f.height <= 0 || (!is_420 && !is_444) || damaged) {
    av_frame_unref(s.frame);
    return fail(damaged ? "H.264: damaged picture" : "H.264: picture is not 8-bit 4:2:0 or 4:4:4");
  }
  picture.width = static_cast<std::uint32_t>(f.width);
  picture.height = static_cast<std::uint32_t>(f.height);
  picture.chroma_444 = is_444;
  copy_plane(f, 0, picture.width, picture.height, picture.y);
  copy_plane(f, 1, picture.chroma_width(), picture.chroma_height(), picture.cb);
  copy_plane(f, 2, picture.chroma_width(), picture.chroma_height(), picture.cr);
  av_frame_unref(s.frame);
  return {};
}

void VideoDecoder::reset() { avcodec_flush_buffers(state_->context); }

}  // namespace darm::client
