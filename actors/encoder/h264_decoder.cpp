#include "actors/encoder/h264_decoder.hpp"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/frame.h>
}

#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace darm::encoder {

struct H264Decoder::State {
  AVCodecContext* context = nullptr;
  AVPacket* packet = nullptr;
  AVFrame* frame = nullptr;
  std::vector<std::uint8_t> padded;  // libav reads past the end of a packet

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    av_frame_free(&frame);
    av_packet_free(&packet);
    avcodec_free_context(&context);
  }
};

H264Decoder::H264Decoder(std::unique_ptr<State> state) : state_(std::move(state)) {}
H264Decoder::~H264Decoder() = default;

Result<std::unique_ptr<H264Decoder>> H264Decoder::create() {
  const AVCodec* codec = avcodec_find_decoder(AV_CODEC_ID_H264);
  if (codec == nullptr) return fail("H.264: this libavcodec has no decoder for it");
  auto state = std::make_unique<State>();
  state->context = avcodec_alloc_context3(codec);
  state->packet = av_packet_alloc();
  state->frame = av_frame_alloc();
  if (state->context == nullptr || state->packet == nullptr || state->frame == nullptr)
    return fail("H.264: out of memory");
  state->context->flags |= AV_CODEC_FLAG_LOW_DELAY;
  state->context->thread_count = 1;
  state->context->err_recognition = AV_EF_EXPLODE;
  if (avcodec_open2(state->context, codec, nullptr) < 0) return fail("H.264: the decoder does not open");
  return std::unique_ptr<H264Decoder>(new H264Decoder(std::move(state)));
}

Result<PlanarPicture> H264Decoder::decode(std::span<const std::uint8_t> packet) {
  if (packet.empty() || packet.size() > (1u << 30)) return fail("H.264: empty packet");
  State& s = *state_;
  s.padded.assign(packet.size() + AV_INPUT_BUFFER_PADDING_SIZE, 0);
  std::memcpy(s.padded.data(), packet.data(), packet.size());
  s.packet->data = s.padded.data();
  s.packet->size = static_cast<int>(packet.size());
  av_frame_unref(s.frame);
  if (avcodec_send_packet(s.context, s.packet) < 0) return fail("H.264: the packet is damaged");
  if (avcodec_receive_frame(s.context, s.frame) < 0) return fail("H.264: the packet gives no picture");
  const AVFrame& f = *s.frame;
  const bool is_420 = f.format == AV_PIX_FMT_YUV420P || f.format == AV_PIX_FMT_YUVJ420P;
  const bool is_444 = f.format == AV_PIX_FMT_YUV444P || f.format == AV_PIX_FMT_YUVJ444P;
  if (!is_420 && !is_444) return fail("H.264: the picture is not 8-bit 4:2:0 or 4:4:4");
  PlanarPicture out;
  out.width = static_cast<std::uint32_t>(f.width);
  out.height = static_cast<std::uint32_t>(f.height);
  out.chroma_444 = is_444;
  for (int i = 0; i < 3; ++i) {
    if (f.linesize[i] <= 0) return fail("H.264: the picture lies upside down");
    out.plane[i] = f.data[i];
    out.stride[i] = static_cast<std::size_t>(f.linesize[i]);
  }
  return out;
}

}  // namespace darm::encoder
