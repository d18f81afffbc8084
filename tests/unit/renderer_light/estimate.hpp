// Means of light samples with their standard errors, for tests that compare them with the truth.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>

#include "actors/renderer/light_transport.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer {

struct Estimate {
  double mean = 0;
  double error = 0;  // standard error of the mean
};

inline Estimate estimate(std::uint32_t samples, const std::function<double(Sampler&)>& draw, std::uint64_t seed = 1) {
  double mean = 0, m2 = 0;
  for (std::uint32_t i = 0; i < samples; ++i) {
    // A pixel of its own for every 64 samples: independent runs, whose spread is an honest error.
    Sampler sampler(seed, hash_pair(i / 64, 3), i % 64);
    const double x = draw(sampler);
    EXPECT_TRUE(std::isfinite(x)) << "sample " << i;
    const double delta = x - mean;
    mean += delta / (i + 1);
    m2 += delta * (x - mean);
  }
  return {mean, std::sqrt(m2 / samples / samples)};
}

// Five standard errors: a correct estimator fails with a probability of 6e-7.
inline void expect_agrees(const Estimate& e, double truth, double slack = 1e-4) {
  EXPECT_NEAR(e.mean, truth, 5 * e.error + slack * std::abs(truth));
}

inline LightTransport transport_of(const test::HandScene& hand, TransportOptions options = {}) {
  const auto scene = hand.share();
  return {scene, trace::RayScene::build(scene, 1).value(), options};
}

}  // namespace darm::renderer
