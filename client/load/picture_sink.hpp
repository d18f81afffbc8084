// Where messages go that are to be decoded or drawn, besides being checked.
#pragma once

#include <cstddef>

#include "client/core/stream_player.hpp"
#include "client/core/view.hpp"
#include "proto/darm.pb.h"

namespace darm::client::load {

class PictureSink {
 public:
  PictureSink() = default;
  virtual ~PictureSink() = default;
  PictureSink(const PictureSink&) = delete;
  PictureSink& operator=(const PictureSink&) = delete;

  /// What Welcome settled; a private layer of 0 pixels: none.
  virtual void begin(const StreamShape& shape, const StreamShape& view_shape) = 0;
  virtual void look(const View& view) = 0;
  /// `envelope` came as `bytes` bytes.
  virtual void take(wire::Envelope envelope, std::size_t bytes) = 0;
};

}  // namespace darm::client::load
