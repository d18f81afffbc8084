// The web client that was built with this daemon (client/web).
#pragma once

#include "actors/session/web_files.hpp"

namespace darm {

/// Its files; where it was not built, one page that says so. Defined by a generated file (cmake/embed_web.py).
[[nodiscard]] session::WebFiles web_client_files();

}  // namespace darm
