// The certificate that clients are shown.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "actors/types/error.hpp"

namespace boost::asio::ssl {
class context;
}

namespace darm::session {

struct TlsFiles {
  std::filesystem::path certificate;  ///< PEM, the server's own first, then its chain
  std::filesystem::path key;          ///< PEM, without a password
};

/// TLS 1.2 and later, server side. Errors name the file at fault. Thread-safe once made.
[[nodiscard]] Result<std::shared_ptr<boost::asio::ssl::context>> make_tls_context(const TlsFiles& files);

/// `folder`/certificate.pem and key.pem (mode 0600), made at the first call: for a LAN, where nobody else vouches. They
/// stay the same from start to start, since people tell their browsers to trust them, and are made anew when they end
/// within a week, cannot be read, or lack one of `names`.
/// The certificate is for localhost, this machine's name (bare and under .local), its addresses, and `names` (host
/// names or IP addresses). ECDSA P-256, 825 days.
[[nodiscard]] Result<TlsFiles> self_signed_in(const std::filesystem::path& folder,
                                              const std::vector<std::string>& names);

/// SHA-256 of the certificate as browsers show it ("AB:CD:..."), so that a person can compare.
[[nodiscard]] Result<std::string> fingerprint(const std::filesystem::path& certificate);

}  // namespace darm::session
