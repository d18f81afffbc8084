#include "actors/tile_scheduler/shared_set.hpp"

#include <algorithm>
#include <utility>

namespace darm::tile_scheduler {

std::vector<MemberLook> join_same_views(std::span<const MemberLook> looks) {
  std::vector<MemberLook> out;
  for (const auto& look : looks) {
    const auto same = std::ranges::find_if(out, [&](const MemberLook& other) {
      return other.view != nullptr && look.view != nullptr && same_view(*other.view, *look.view);
    });
    if (same == out.end()) {
      out.push_back(look);
      continue;
    }
    if (look.samples->samples() > same->samples->samples()) same->samples = look.samples;
    same->looks += look.looks;
  }
  return out;
}

void SharedSet::add(const VisibleSet& samples, float looks) {
  if (samples.samples() <= 0) return;
  newest_.merge(samples, static_cast<float>(double{looks} / samples.samples()), kMaxTaps);
}

void SharedSet::renew(Microseconds now) {
  older_ = std::exchange(newest_, VisibleSet());
  if (!changed_) older_.clear();
  changed_ = false;
  renew_at_ = now + kKeep;
  newest_.reserve(older_.chains().size(), older_.tiles().size());
}

void SharedSet::renewed(Microseconds took, Microseconds now) {
  renew_at_ = std::max(renew_at_, now + std::min(10 * took, kLongestKeep));
}

Seen SharedSet::seen(bool rests) const {
  Seen out{{{&newest_, 1.0f}}, rests};
  const double all = newest_.samples() + older_.samples();
  if (older_.samples() <= 0) return out;
  out.parts.push_back({&older_, static_cast<float>(older_.samples() / all)});
  out.parts.front().weight = static_cast<float>(newest_.samples() / all);
  return out;
}

}  // namespace darm::tile_scheduler
