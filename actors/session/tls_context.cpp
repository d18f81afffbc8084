#include "actors/session/tls_context.hpp"

#include <openssl/pem.h>
#include <openssl/x509.h>

#include <array>
#include <boost/asio/ssl/context.hpp>
#include <cstdio>

namespace darm::session {

namespace ssl = boost::asio::ssl;

Result<std::shared_ptr<ssl::context>> make_tls_context(const TlsFiles& files) {
  auto context = std::make_shared<ssl::context>(ssl::context::tls_server);
  boost::system::error_code ec;
  context->set_options(ssl::context::default_workarounds | ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1 |
                           ssl::context::no_compression,
                       ec);
  if (ec) return fail("tls: " + ec.message());
  // A key with a password would make OpenSSL ask at the terminal.
  context->set_password_callback([](std::size_t, ssl::context::password_purpose) { return std::string(); }, ec);
  context->use_certificate_chain_file(files.certificate.string(), ec);
  if (ec)
    return fail(files.certificate.string() + ": no certificate in PEM form that can be read (" + ec.message() +
                "); set tls.certificate");
  context->use_private_key_file(files.key.string(), ssl::context::pem, ec);
  if (ec)
    return fail(files.key.string() + ": no private key in PEM form, without a password, that fits " +
                files.certificate.string() + " (" + ec.message() + "); set tls.key");
  if (SSL_CTX_check_private_key(context->native_handle()) != 1)
    return fail(files.key.string() + ": is not the key of " + files.certificate.string());
  return context;
}

Result<std::string> fingerprint(const std::filesystem::path& certificate) {
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(certificate.c_str(), "r"), &std::fclose);
  if (!file) return fail(certificate.string() + ": cannot be read");
  const std::unique_ptr<X509, void (*)(X509*)> x509(PEM_read_X509(file.get(), nullptr, nullptr, nullptr), &X509_free);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (!x509 || X509_digest(x509.get(), EVP_sha256(), digest.data(), &size) != 1)
    return fail(certificate.string() + ": no certificate in PEM form");
  std::string text;
  for (unsigned i = 0; i < size; ++i) {
    std::array<char, 4> byte{};
    std::snprintf(byte.data(), byte.size(), "%s%02X", i == 0 ? "" : ":", digest[i]);
    text += byte.data();
  }
  return text;
}

}  // namespace darm::session
