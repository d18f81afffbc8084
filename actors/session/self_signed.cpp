// self_signed_in() of tls_context.hpp: a certificate of our own by OpenSSL.
#include <arpa/inet.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <set>
#include <system_error>

#include "actors/session/tls_context.hpp"

namespace darm::session {
namespace {

// What Apple's browsers take at most of any certificate.
constexpr long kValidSeconds = 825L * 24 * 3600;
constexpr long kRenewSeconds = 7L * 24 * 3600;

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* p) const {
    Free(p);
  }
};
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using File = std::unique_ptr<FILE, Freed<std::fclose>>;

bool is_ip(const std::string& name) {
  std::array<unsigned char, sizeof(in6_addr)> out{};
  return inet_pton(AF_INET, name.c_str(), out.data()) == 1 || inet_pton(AF_INET6, name.c_str(), out.data()) == 1;
}

// Letters, digits, dots and hyphens: what goes into OpenSSL's extension syntax must not be able to say anything else.
bool is_host_name(const std::string& name) {
  return !name.empty() && name.size() <= 253 && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-' ||
           c == '*';
  });
}

std::set<std::string> addresses_of_this_machine() {
  std::set<std::string> found;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return found;
  for (const ifaddrs* a = list; a != nullptr; a = a->ifa_next) {
    if (a->ifa_addr == nullptr || (a->ifa_flags & IFF_UP) == 0) continue;
    std::array<char, INET6_ADDRSTRLEN> text{};
    if (a->ifa_addr->sa_family == AF_INET) {
      inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(a->ifa_addr)->sin_addr, text.data(), text.size());
    } else if (a->ifa_addr->sa_family == AF_INET6) {
      const auto* in6 = reinterpret_cast<const sockaddr_in6*>(a->ifa_addr);
      if (IN6_IS_ADDR_LINKLOCAL(&in6->sin6_addr)) continue;  // no browser can be told such an address
      inet_ntop(AF_INET6, &in6->sin6_addr, text.data(), text.size());
    }
    if (text[0] != '\0') found.insert(text.data());
  }
  freeifaddrs(list);
  return found;
}

// OpenSSL's subjectAltName: "DNS:localhost,IP:127.0.0.1".
std::string alternative_names(const std::vector<std::string>& more) {
  std::set<std::string> names{"localhost", "127.0.0.1", "::1"};
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) == 0 && is_host_name(host.data())) {
    const std::string name = host.data();
    names.insert(name);
    if (name.find('.') == std::string::npos) names.insert(name + ".local");
  }
  names.merge(addresses_of_this_machine());
  names.insert(more.begin(), more.end());
  std::string text;
  for (const auto& name : names) {
    if (!text.empty()) text += ',';
    text += is_ip(name) ? "IP:" : "DNS:";
    text += name;
  }
  return text;
}

bool add_extension(X509* certificate, int what, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>> extension(
      X509V3_EXT_conf_nid(nullptr, &context, what, value.c_str()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

Certificate make_certificate(EVP_PKEY* key, const std::string& names) {
  Certificate certificate(X509_new());
  X509* x = certificate.get();
  std::array<unsigned char, 16> serial{};
  if (x == nullptr || RAND_bytes(serial.data(), serial.size()) != 1) return nullptr;
  serial[0] = (serial[0] & 0x7f) | 0x40;  // positive, of full length
  const std::unique_ptr<BIGNUM, Freed<BN_free>> number(BN_bin2bn(serial.data(), serial.size(), nullptr));
  X509_NAME* subject = X509_get_subject_name(x);
  const auto* name = reinterpret_cast<const unsigned char*>("darmd");
  const bool made = X509_set_version(x, X509_VERSION_3) == 1 && number &&
                    BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(x)) != nullptr &&
                    X509_gmtime_adj(X509_getm_notBefore(x), -3600) != nullptr &&  // clocks of a LAN differ
                    X509_gmtime_adj(X509_getm_notAfter(x), kValidSeconds) != nullptr && X509_set_pubkey(x, key) == 1 &&
                    X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, name, -1, -1, 0) == 1 &&
                    X509_set_issuer_name(x, subject) == 1 && add_extension(x, NID_subject_alt_name, names) &&
                    add_extension(x, NID_basic_constraints, "critical,CA:FALSE") &&
                    add_extension(x, NID_key_usage, "critical,digitalSignature") &&
                    add_extension(x, NID_ext_key_usage, "serverAuth") && X509_sign(x, key, EVP_sha256()) > 0;
  return made ? std::move(certificate) : nullptr;
}

// Whole or not at all: written beside, then moved.
template <class Write>
Result<void> write_file(const std::filesystem::path& path, mode_t mode, Write&& write) {
  const auto fresh = path.string() + ".new";
  ::unlink(fresh.c_str());
  const int descriptor = ::open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (descriptor < 0) return fail(path.string() + ": cannot be written: " + std::generic_category().message(errno));
  File file(::fdopen(descriptor, "w"));
  if (!file || ::fchmod(descriptor, mode) != 0 || !write(file.get()) || std::fflush(file.get()) != 0 ||
      ::fsync(descriptor) != 0 || ::rename(fresh.c_str(), path.c_str()) != 0)
    return fail(path.string() + ": cannot be written: " + std::generic_category().message(errno));
  return {};
}

// The certificate that is there serves on: it can be read, has a while to go, and has every name asked for.
bool still_good(const TlsFiles& files, const std::vector<std::string>& names) {
  if (!make_tls_context(files)) return false;
  const File file(std::fopen(files.certificate.c_str(), "r"));
  const Certificate x(file ? PEM_read_X509(file.get(), nullptr, nullptr, nullptr) : nullptr);
  if (!x) return false;
  int days = 0;
  int seconds = 0;
  if (ASN1_TIME_diff(&days, &seconds, nullptr, X509_get0_notAfter(x.get())) != 1 ||
      days * 86400L + seconds < kRenewSeconds)
    return false;
  return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    return is_ip(name) ? X509_check_ip_asc(x.get(), name.c_str(), 0) == 1
                       : X509_check_host(x.get(), name.c_str(), name.size(), 0, nullptr) == 1;
  });
}

}  // namespace

Result<TlsFiles> self_signed_in(const std::filesystem::path& folder, const std::vector<std::string>& names) {
  for (const auto& name : names)
    if (!is_ip(name) && !is_host_name(name)) return fail("tls.names: \"" + name + "\" is no host name or IP address");
  TlsFiles files{folder / "certificate.pem", folder / "key.pem"};
  if (std::filesystem::exists(files.certificate) && still_good(files, names)) return files;
  std::error_code ec;
  std::filesystem::create_directories(folder, ec);
  if (ec) return fail(folder.string() + ": cannot be made: " + ec.message());
  const Key key(EVP_EC_gen("P-256"));
  const auto certificate = key ? make_certificate(key.get(), alternative_names(names)) : nullptr;
  if (!certificate) return fail("tls: OpenSSL could not make a certificate; set tls.certificate and tls.key");
  auto written = write_file(files.key, 0600, [&](FILE* file) {
    return PEM_write_PrivateKey(file, key.get(), nullptr, nullptr, 0, nullptr, nullptr) == 1;
  });
  if (written)
    written =
        write_file(files.certificate, 0644, [&](FILE* file) { return PEM_write_X509(file, certificate.get()) == 1; });
  if (!written) return std::unexpected(written.error());
  return files;
}

}  // namespace darm::session
