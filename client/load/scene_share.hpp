// One scene for all clients: they are sent the same, and read it once.
#pragma once

#include <memory>
#include <string>

#include "client/core/result.hpp"
#include "client/core/scene_model.hpp"

namespace darm::client::load {

/// Announced scenes without their geometry. A client that is sent another manifest than the first has a model of its
/// own.
class SceneShare {
 public:
  [[nodiscard]] Result<std::shared_ptr<const SceneModel>> of(const wire::SceneManifest& manifest) {
    std::string bytes = manifest.SerializeAsString();
    if (first_ && bytes == first_bytes_) return first_;
    auto model = SceneModel::from_manifest(manifest);
    if (!model) return std::unexpected(model.error());
    auto shared = std::make_shared<const SceneModel>(std::move(*model));
    if (!first_) {
      first_ = shared;
      first_bytes_ = std::move(bytes);
    }
    return shared;
  }

 private:
  std::shared_ptr<const SceneModel> first_;
  std::string first_bytes_;
};

}  // namespace darm::client::load
