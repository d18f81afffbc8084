// An x264 stream for tests, made on the spot: flat-coloured slots on a square picture.
#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/opt.h>
}

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace darm::client::synthetic {

class H264Stream {
 public:
  H264Stream(int width, int height, bool chroma_444) {
    const AVCodec* codec = avcodec_find_encoder_by_name("libx264");
    if (codec == nullptr) throw std::runtime_error("no libx264");
    context_ = avcodec_alloc_context3(codec);
    context_->width = width;
    context_->height = height;
    context_->pix_fmt = chroma_444 ? AV_PIX_FMT_YUV444P : AV_PIX_FMT_YUV420P;
    context_->time_base = {1, 30};
    context_->gop_size = 1000;
    context_->max_b_frames = 0;
    context_->color_range = AVCOL_RANGE_JPEG;
    context_->colorspace = AVCOL_SPC_BT709;
    av_opt_set(context_->priv_data, "preset", "superfast", 0);
    av_opt_set(context_->priv_data, "tune", "zerolatency", 0);
    av_opt_set(context_->priv_data, "crf", "12", 0);
    if (avcodec_open2(context_, codec, nullptr) < 0) throw std::runtime_error("libx264 does not open");
    frame_ = av_frame_alloc();
    frame_->format = context_->pix_fmt;
    frame_->width = width;
    frame_->height = height;
    av_frame_get_buffer(frame_, 0);
    packet_ = av_packet_alloc();
  }
  ~H264Stream() {
    av_packet_free(&packet_);
    av_frame_free(&frame_);
    avcodec_free_context(&context_);
  }
  H264Stream(const H264Stream&) = delete;
  H264Stream& operator=(const H264Stream&) = delete;

  using Plane = std::function<std::uint8_t(int plane, int x, int y)>;  // plane coordinates
  std::string encode(const Plane& plane, bool key) {
    av_frame_make_writable(frame_);
    for (int p = 0; p < 3; ++p) {
      const int shift = p > 0 && context_->pix_fmt == AV_PIX_FMT_YUV420P ? 1 : 0;
      for (int y = 0; y < context_->height >> shift; ++y) {
        for (int x = 0; x < context_->width >> shift; ++x)
          frame_->data[p][y * frame_->linesize[p] + x] = plane(p, x, y);
      }
    }
    frame_->pts = next_++;
    frame_->pict_type = key ? AV_PICTURE_TYPE_I : AV_PICTURE_TYPE_NONE;
    if (avcodec_send_frame(context_, frame_) < 0 || avcodec_receive_packet(context_, packet_) < 0)
      throw std::runtime_error("libx264 gave nothing");
    std::string bytes(reinterpret_cast<const char*>(packet_->data), static_cast<std::size_t>(packet_->size));
    av_packet_unref(packet_);
    return bytes;
  }

 private:
  AVCodecContext* context_ = nullptr;
  AVFrame* frame_ = nullptr;
  AVPacket* packet_ = nullptr;
  std::int64_t next_ = 0;
};

}  // namespace darm::client::synthetic
