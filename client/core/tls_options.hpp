// For command lines of clients: whether and how the connection is encrypted.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "client/core/byte_stream.hpp"

namespace darm::client {

struct TlsOptions {
  bool tls = false, insecure = false;
  std::string authority;

  /// `this` must outlive the parsing of `app`.
  void declare(CLI::App& app) {
    app.add_flag("--tls", tls, "speak TLS; the certificate must be vouched for");
    app.add_option("--authority", authority, "PEM file that vouches too, e.g. darmd's STATE-DIR/tls/certificate.pem")
        ->check(CLI::ExistingFile);
    app.add_flag("--insecure", insecure, "speak TLS with whoever answers");
  }
  /// Each of the three options asks for TLS.
  [[nodiscard]] Tls wanted() const {
    if (insecure) return Tls::kUnverified;
    return tls || !authority.empty() ? Tls::kVerified : Tls::kNone;
  }
};

}  // namespace darm::client
