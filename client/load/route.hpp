// Where each client looks from at which time. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "client/core/camera_path.hpp"
#include "client/load/crowd.hpp"

namespace darm::client::load {

/// With a walkthrough clients walk it to and fro: each group begins where the walkthrough passes its place, or, without
/// places, each client at a point of its own. Without a walkthrough they stand still at the places.
class Route {
 public:
  /// Both may be empty: then the server's first camera is the place.
  Route(std::vector<CameraKey> walkthrough, std::vector<CameraKey> places, std::uint32_t clients);

  /// `seconds` since the client began; nothing if only the server knows a camera.
  [[nodiscard]] std::optional<CameraKey> at(const ClientPlan& plan, double seconds) const;
  [[nodiscard]] std::uint32_t places() const {
    return places_.empty() ? 1 : static_cast<std::uint32_t>(places_.size());
  }

 private:
  [[nodiscard]] CameraKey walked(double seconds) const;
  [[nodiscard]] CameraKey elsewhere(std::uint64_t seed, std::uint64_t jump) const;
  [[nodiscard]] double length() const { return walkthrough_.back().t - walkthrough_.front().t; }

  std::vector<CameraKey> walkthrough_, places_;
  std::vector<double> starts_;  // of each place, seconds of the walkthrough
  std::uint32_t clients_;
};

}  // namespace darm::client::load
