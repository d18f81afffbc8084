#include "actors/renderer/bsdf.hpp"

#include <cmath>
#include <glm/geometric.hpp>

#include "actors/renderer/sampling.hpp"

namespace darm::renderer {
namespace {

constexpr float kGrazing = 1e-4f;         // smallest cosine of a scattered direction
constexpr float kFacing = 1e-3f;          // cosine over which a bent normal faces the eye
constexpr float kLeastScattered = 1e-8f;  // luminance; what scatters less is black

// GGX distribution in a form that does not cancel for small alpha.
float ggx(const glm::vec3& h, float alpha) {
  const float a2 = alpha * alpha;
  const float e = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
  return kInversePi / (a2 * e * e);
}

float smith_lambda(float cosine, float alpha) {
  const float c2 = cosine * cosine;
  return 0.5f * (std::sqrt(1.0f + alpha * alpha * std::max(0.0f, 1.0f - c2) / c2) - 1.0f);
}

}  // namespace

template <bool kSpecular, bool kTransmits>
BasicBsdf<kSpecular, kTransmits>::BasicBsdf(const trace::Surface& surface, const MaterialPoint& material,
                                            const glm::vec3& wo, Lobes lobes)
    : material_(material), normal_(surface.normal), geometric_(surface.geometric_normal) {
  static_assert(kSpecular || !kTransmits, "what transmits also reflects");
  const float base = luminance(material.base);
  if constexpr (!kSpecular) {
    diffuse_probability_ = lobes == Lobes::kAll && base > kLeastScattered ? 1.0f : 0.0f;
    return;
  }
  // A bent normal that faces away from the eye has no microfacets to see: the flat one stands in.
  axis_[2] = glm::dot(normal_, wo) > kFacing ? normal_ : geometric_;
  trace::make_frame(axis_[2], axis_[0], axis_[1]);
  wo_ = to_local(wo);
  wo_.z = std::max(wo_.z, kGrazing);
  if constexpr (kTransmits) {
    const bool refracts = !material.thin && material.transmission > 0;
    eta_ = refracts ? (surface.front ? 1.0f / material.ior : material.ior) : 1.0f;
  }
  const float f = fresnel(wo_.z);
  const float dielectric = (1.0f - material.metallic) * (1.0f - f);
  const float specular = luminance(reflectance(wo_.z));
  const float diffuse = lobes == Lobes::kAll ? dielectric * (1.0f - material.transmission) * base : 0.0f;
  float transmit = 0;
  if constexpr (kTransmits) {
    const bool lobe = material.transmission > 0 && !material.passes_straight();
    // Inside a body the whole surface may reflect totally where its tilted microfacets do not: what they let through
    // needs a chance that grows with their spread.
    const float let_through = (1.0f - material.metallic) * std::max(1.0f - f, std::min(material.ggx_alpha, 0.5f));
    transmit = lobe ? let_through * material.transmission * base : 0.0f;
  }
  const float sum = specular + diffuse + transmit;
  if (!(sum > kLeastScattered)) return;
  specular_probability_ = specular / sum;
  diffuse_probability_ = diffuse / sum;
  transmit_probability_ = transmit / sum;
}

template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::to_local(const glm::vec3& w) const {
  return {glm::dot(w, axis_[0]), glm::dot(w, axis_[1]), glm::dot(w, axis_[2])};
}

template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::to_world(const glm::vec3& w) const {
  return axis_[0] * w.x + axis_[1] * w.y + axis_[2] * w.z;
}

// Schlick over the dielectric; leaving a denser body the cosine is the one outside, and total reflection is total.
template <bool kSpecular, bool kTransmits>
float BasicBsdf<kSpecular, kTransmits>::fresnel(float cosine) const {
  if (kTransmits && eta_ > 1.0f) {
    const float sine2 = eta_ * eta_ * std::max(0.0f, 1.0f - cosine * cosine);
    if (sine2 >= 1.0f) return 1.0f;
    cosine = std::sqrt(1.0f - sine2);
  }
  return material_.fresnel(cosine);
}

template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::reflectance(float cosine) const {
  const float m = std::clamp(1.0f - cosine, 0.0f, 1.0f);
  const float m5 = m * m * m * m * m;
  const glm::vec3 metal = material_.base + (glm::vec3(1.0f) - material_.base) * m5;
  return glm::vec3((1.0f - material_.metallic) * fresnel(cosine)) + metal * material_.metallic;
}

// 1 - F(n.v), not F(v.h) as in appendix B: with v.h a smooth plastic returns up to 1.4 times the light at grazing
// angles. The view average is then exactly MaterialPoint::diffuse_albedo.
template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::diffuse_share() const {
  return material_.base * ((1.0f - material_.metallic) * (1.0f - material_.transmission) * (1.0f - fresnel(wo_.z)));
}

template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::evaluate_reflection(const glm::vec3& wi, const glm::vec3& li,
                                                                float& pdf) const {
  glm::vec3 f(0.0f);
  const float cos_diffuse = glm::dot(normal_, wi);
  if (diffuse_probability_ > 0 && cos_diffuse > 0) {
    f += diffuse_share() * (cos_diffuse * kInversePi);
    pdf += diffuse_probability_ * cos_diffuse * kInversePi;
  }
  if constexpr (!kSpecular) return f;
  if (li.z > kGrazing && specular_probability_ > 0) {
    const glm::vec3 h = glm::normalize(wo_ + li);
    const float cos_half = glm::clamp(glm::dot(wo_, h), 0.0f, 1.0f);
    const float lambda_o = smith_lambda(wo_.z, material_.ggx_alpha);
    const float d_over = ggx(h, material_.ggx_alpha) / (4.0f * wo_.z);
    f += reflectance(cos_half) * (d_over / (1.0f + lambda_o + smith_lambda(li.z, material_.ggx_alpha)));
    pdf += specular_probability_ * d_over / (1.0f + lambda_o);
  }
  return f;
}

// The reflection lobe, mirrored to the far side.
template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::evaluate_thin(const glm::vec3& li, float& pdf) const {
  const glm::vec3 mirrored(li.x, li.y, -li.z);
  if (mirrored.z <= kGrazing) return glm::vec3(0.0f);
  const glm::vec3 h = glm::normalize(wo_ + mirrored);
  const float cos_half = glm::clamp(glm::dot(wo_, h), 0.0f, 1.0f);
  const float lambda_o = smith_lambda(wo_.z, material_.ggx_alpha);
  const float d_over = ggx(h, material_.ggx_alpha) / (4.0f * wo_.z);
  pdf += transmit_probability_ * d_over / (1.0f + lambda_o);
  const float share = (1.0f - material_.metallic) * material_.transmission * (1.0f - fresnel(cos_half));
  return material_.base * (share * d_over / (1.0f + lambda_o + smith_lambda(mirrored.z, material_.ggx_alpha)));
}

template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::evaluate_refraction(const glm::vec3& li, float& pdf) const {
  if (std::abs(eta_ - 1.0f) < 1e-4f) return glm::vec3(0.0f);  // see sample_refraction
  glm::vec3 h = wo_ * eta_ + li;                              // eta_ = n_o / n_i
  const float length2 = glm::dot(h, h);
  if (length2 < 1e-12f || li.z >= -kGrazing) return glm::vec3(0.0f);
  h *= 1.0f / std::sqrt(length2);
  if (h.z < 0) h = -h;
  const float o_h = glm::dot(wo_, h);
  const float i_h = glm::dot(li, h);
  if (o_h <= 0 || i_h >= 0) return glm::vec3(0.0f);
  const float root = eta_ * o_h + i_h;
  const float jacobian = std::abs(i_h) / std::max(root * root, 1e-20f);
  const float lambda_o = smith_lambda(wo_.z, material_.ggx_alpha);
  const float d = ggx(h, material_.ggx_alpha) * o_h / wo_.z * jacobian;
  pdf += transmit_probability_ * d / (1.0f + lambda_o);
  const float share = (1.0f - material_.metallic) * material_.transmission * (1.0f - fresnel(o_h));
  // Radiance is not scaled by eta^2: paths enter and leave, and cameras stand in air.
  return material_.base * (share * d / (1.0f + lambda_o + smith_lambda(-li.z, material_.ggx_alpha)));
}

template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::evaluate(const glm::vec3& wi, float& pdf) const {
  pdf = 0;
  const bool reflects = glm::dot(geometric_, wi) > 0;
  if constexpr (!kSpecular) return reflects ? evaluate_reflection(wi, wi, pdf) : glm::vec3(0.0f);
  const glm::vec3 li = to_local(wi);
  if (reflects) return evaluate_reflection(wi, li, pdf);
  if (!transmits()) return glm::vec3(0.0f);
  return material_.thin ? evaluate_thin(li, pdf) : evaluate_refraction(li, pdf);
}

template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::sample_refraction(const glm::vec2& xi) const {
  const glm::vec3 h = sample_visible_normal(wo_, material_.ggx_alpha, xi);
  const float o_h = glm::dot(wo_, h);
  const float square = 1.0f - eta_ * eta_ * (1.0f - o_h * o_h);
  if (square <= 0) return glm::vec3(0.0f);  // total reflection: its energy is in the reflection lobe
  return glm::normalize(h * (eta_ * o_h - std::sqrt(square)) - wo_ * eta_);
}

template <bool kSpecular, bool kTransmits>
glm::vec3 BasicBsdf<kSpecular, kTransmits>::sample_transmission(const glm::vec2& xi) const {
  if (!material_.thin) return sample_refraction(xi);
  const glm::vec3 h = sample_visible_normal(wo_, material_.ggx_alpha, xi);
  glm::vec3 d = h * (2.0f * glm::dot(wo_, h)) - wo_;
  d.z = -d.z;
  return d;
}

template <bool kSpecular, bool kTransmits>
BsdfSample BasicBsdf<kSpecular, kTransmits>::sample(Sampler& sampler) const {
  BsdfSample made;
  const float pick = sampler.next_1d();
  const glm::vec2 xi = sampler.next_2d();
  if (pick < diffuse_probability_) {
    glm::vec3 t, b;
    trace::make_frame(normal_, t, b);
    const glm::vec3 d = sample_cosine(xi);
    made.direction = glm::normalize(t * d.x + b * d.y + normal_ * d.z);
    if (glm::dot(geometric_, made.direction) <= 0) return made;
  } else if (kSpecular && pick < diffuse_probability_ + specular_probability_) {
    const glm::vec3 h = sample_visible_normal(wo_, material_.ggx_alpha, xi);
    const glm::vec3 d = h * (2.0f * glm::dot(wo_, h)) - wo_;
    if (d.z <= kGrazing) return made;
    made.direction = glm::normalize(to_world(d));
    if (glm::dot(geometric_, made.direction) <= 0) return made;
  } else if (transmits()) {
    const glm::vec3 d = sample_transmission(xi);
    if (d.z >= -kGrazing) return made;
    made.direction = glm::normalize(to_world(d));
    if (glm::dot(geometric_, made.direction) >= 0) return made;
  } else {
    return made;
  }
  float pdf = 0;
  const glm::vec3 f = evaluate(made.direction, pdf);
  if (!(pdf > 0) || !std::isfinite(pdf)) return made;
  made.weight = f / pdf;
  made.pdf = pdf;
  return made;
}

template class BasicBsdf<false, false>;
template class BasicBsdf<true, false>;
template class BasicBsdf<true, true>;

}  // namespace darm::renderer
