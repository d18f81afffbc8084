#include "daemon/accuracy/result_key.hpp"

#include <cstdio>
#include <sstream>

namespace darm::accuracy {

std::string result_key(const KeyParts& p, const Variant& v) {
  std::ostringstream text;
  text.precision(17);
  const auto& accuracy = v.config.accuracy;
  const auto& stream = v.config.stream;
  const auto& q = p.camera.orientation;
  text << kMethodVersion << '|' << p.scene_hash << '|' << p.exposure << '|' << p.camera.position.x << ' '
       << p.camera.position.y << ' ' << p.camera.position.z << ' ' << q.w << ' ' << q.x << ' ' << q.y << ' ' << q.z
       << ' ' << p.camera.fovy << '|' << p.viewport.width << 'x' << p.viewport.height << '|' << p.threads << '|'
       << p.reference_psnr << '|' << name_of(v.group) << '|' << v.name << '|' << static_cast<int>(v.method) << '|'
       << v.seconds << '|' << v.config.scene.q << '|' << accuracy.target << ' ' << accuracy.indirect << ' '
       << accuracy.filter_samples << '|' << v.config.render.max_samples << ' ' << v.config.render.slice_ms << '|'
       << stream.updates_per_second << ' ' << stream.phystex << ' ' << stream.view_phystex << ' ' << stream.max_writes
       << ' ' << stream.crf << ' ' << stream.crf_finest << ' ' << stream.preset << ' ' << stream.chroma_444 << '|'
       << v.private_layer << ' ' << v.crf;
  if (v.method == Method::kCodec) text << '|' << kCodecMethodVersion;
  std::uint64_t hash = 0xcbf29ce484222325ull;  // FNV-1a
  for (const char c : text.str()) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  char out[17];
  std::snprintf(out, sizeof out, "%016llx", static_cast<unsigned long long>(hash));
  return out;
}

}  // namespace darm::accuracy
