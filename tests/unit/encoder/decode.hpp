// Decodes H.264 with libavcodec, so that the encoder is judged by what comes back.
#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/pixdesc.h>
}

#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace darm::encoder::testing {

struct DecodedPicture {
  int width = 0;
  int height = 0;
  std::string format;
  bool key = false;
  AVColorRange range = AVCOL_RANGE_UNSPECIFIED;
  AVColorSpace matrix = AVCOL_SPC_UNSPECIFIED;
  AVColorPrimaries primaries = AVCOL_PRI_UNSPECIFIED;
  AVColorTransferCharacteristic transfer = AVCOL_TRC_UNSPECIFIED;
  AVChromaLocation chroma_location = AVCHROMA_LOC_UNSPECIFIED;
  int profile = 0;
  int level = 0;
  std::vector<std::uint8_t> plane[3];
  int plane_width[3] = {0, 0, 0};
  int plane_height[3] = {0, 0, 0};
};

class Decoder {
 public:
  Decoder() : context_(avcodec_alloc_context3(avcodec_find_decoder(AV_CODEC_ID_H264))) {
    context_->flags |= AV_CODEC_FLAG_LOW_DELAY;
    context_->thread_count = 1;
    if (avcodec_open2(context_, nullptr, nullptr) < 0) throw std::runtime_error("no decoder");
  }
  ~Decoder() { avcodec_free_context(&context_); }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  /// Throws if the bytes do not give exactly one picture at once.
  DecodedPicture decode(const std::vector<std::uint8_t>& bytes) {
    auto padded = bytes;
    padded.resize(bytes.size() + AV_INPUT_BUFFER_PADDING_SIZE);
    AVPacket* packet = av_packet_alloc();
    packet->data = padded.data();
    packet->size = static_cast<int>(bytes.size());
    const int sent = avcodec_send_packet(context_, packet);
    av_packet_free(&packet);
    AVFrame* frame = av_frame_alloc();
    const int got = sent < 0 ? sent : avcodec_receive_frame(context_, frame);
    DecodedPicture out;
    if (got >= 0) out = copy(*frame);
    av_frame_free(&frame);
    if (got < 0) throw std::runtime_error("no picture");
    return out;
  }

 private:
  DecodedPicture copy(const AVFrame& f) {
    DecodedPicture p;
    p.width = f.width;
    p.height = f.height;
    const auto* d = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(f.format));
    p.format = d->name;
    p.key = f.key_frame != 0;
    p.range = f.color_range;
    p.matrix = f.colorspace;
    p.primaries = f.color_primaries;
    p.transfer = f.color_trc;
    p.chroma_location = f.chroma_location;
    p.profile = context_->profile;
    p.level = context_->level;
    for (int i = 0; i < 3; ++i) {
      p.plane_width[i] = i > 0 ? f.width >> d->log2_chroma_w : f.width;
      p.plane_height[i] = i > 0 ? f.height >> d->log2_chroma_h : f.height;
      for (int y = 0; y < p.plane_height[i]; ++y) {
        const auto* row = f.data[i] + y * f.linesize[i];
        p.plane[i].insert(p.plane[i].end(), row, row + p.plane_width[i]);
      }
    }
    return p;
  }

  AVCodecContext* context_;
};

}  // namespace darm::encoder::testing
