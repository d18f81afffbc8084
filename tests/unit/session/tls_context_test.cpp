#include "actors/session/tls_context.hpp"

#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <fstream>
#include <iterator>
#include <memory>

namespace darm::session {
namespace {

class SelfSigned : public ::testing::Test {
 protected:
  SelfSigned() {
    std::string name = ::testing::TempDir() + "darm-tls-XXXXXX";
    folder = ::mkdtemp(name.data());
  }
  ~SelfSigned() override { std::filesystem::remove_all(folder); }

  static std::string text_of(const std::filesystem::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static std::shared_ptr<X509> certificate(const std::filesystem::path& path) {
    const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "r"), &std::fclose);
    return {PEM_read_X509(file.get(), nullptr, nullptr, nullptr), &X509_free};
  }
  std::filesystem::path folder;
};

TEST_F(SelfSigned, is_for_this_machine_and_the_names_asked_for) {
  const auto files = self_signed_in(folder / "tls", {"scene.example.org", "192.0.2.7"});
  ASSERT_TRUE(files) << files.error().message;
  const auto x = certificate(files->certificate);
  ASSERT_TRUE(x);
  for (const auto* name : {"localhost", "scene.example.org"})
    EXPECT_EQ(X509_check_host(x.get(), name, 0, 0, nullptr), 1) << name;
  for (const auto* ip : {"127.0.0.1", "::1", "192.0.2.7"}) EXPECT_EQ(X509_check_ip_asc(x.get(), ip, 0), 1) << ip;
  EXPECT_EQ(X509_check_host(x.get(), "other.example.org", 0, 0, nullptr), 0);
  EXPECT_EQ(X509_verify(x.get(), X509_get0_pubkey(x.get())), 1);
  int days = 0;
  int seconds = 0;
  ASSERT_EQ(ASN1_TIME_diff(&days, &seconds, X509_get0_notBefore(x.get()), X509_get0_notAfter(x.get())), 1);
  EXPECT_LE(days, 825) << "more is refused by some browsers";
  EXPECT_GE(days, 800);
}

TEST_F(SelfSigned, its_key_is_for_nobody_else_to_read) {
  const auto files = self_signed_in(folder, {});
  ASSERT_TRUE(files) << files.error().message;
  struct stat info{};
  ASSERT_EQ(::stat(files->key.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
  EXPECT_TRUE(make_tls_context(*files));
}

TEST_F(SelfSigned, stays_the_same_until_a_name_is_missing_or_it_is_damaged) {
  const auto first = text_of(self_signed_in(folder, {})->certificate);
  EXPECT_EQ(text_of(self_signed_in(folder, {})->certificate), first);
  const auto named = text_of(self_signed_in(folder, {"a.example.org"})->certificate);
  EXPECT_NE(named, first);
  EXPECT_EQ(text_of(self_signed_in(folder, {"a.example.org"})->certificate), named);
  std::ofstream(folder / "key.pem") << "no key";
  const auto mended = self_signed_in(folder, {});
  ASSERT_TRUE(mended);
  EXPECT_NE(text_of(mended->certificate), named);
  EXPECT_TRUE(make_tls_context(*mended));
}

TEST_F(SelfSigned, a_name_that_is_none_is_refused) {
  for (const auto* name : {"", "a b", "a,IP:1.2.3.4", "DNS:x", "a\nb", "x;y"})
    EXPECT_FALSE(self_signed_in(folder, {name})) << name;
}

TEST_F(SelfSigned, a_key_of_another_certificate_is_named_in_the_error) {
  const auto a = self_signed_in(folder / "a", {});
  const auto b = self_signed_in(folder / "b", {});
  ASSERT_TRUE(a && b);
  const auto mixed = make_tls_context({a->certificate, b->key});
  ASSERT_FALSE(mixed);
  EXPECT_NE(mixed.error().message.find((folder / "b" / "key.pem").string()), std::string::npos)
      << mixed.error().message;
  const auto absent = make_tls_context({folder / "nothing.pem", a->key});
  ASSERT_FALSE(absent);
  EXPECT_NE(absent.error().message.find("nothing.pem"), std::string::npos);
}

TEST_F(SelfSigned, its_fingerprint_is_what_browsers_show) {
  const auto files = self_signed_in(folder, {});
  ASSERT_TRUE(files);
  const auto print = fingerprint(files->certificate);
  ASSERT_TRUE(print);
  EXPECT_EQ(print->size(), 32u * 3 - 1);
  EXPECT_EQ((*print)[2], ':');
  EXPECT_FALSE(fingerprint(files->key));
}

}  // namespace
}  // namespace darm::session
