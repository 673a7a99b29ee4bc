#include "server/net/tls_files.h"

#include <openssl/pem.h>
#include <openssl/x509.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <stdexcept>

namespace grouser::server {
namespace {

constexpr std::size_t kMaxBytes = 1024 * 1024;

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
using Bio = std::unique_ptr<BIO, Freed<BIO_free_all>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;

struct Source {
  const char* option;
  const std::string& path;

  [[noreturn]] void Fail(const std::string& what) const {
    throw std::runtime_error(std::string(option) + ": " + path + ": " + what);
  }
  std::string Read() const {
    std::ifstream in(path, std::ios::binary);
    if (!in) Fail(std::strerror(errno));
    std::string text(kMaxBytes + 1, '\0');
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (in.bad()) Fail("cannot be read");
    text.resize(static_cast<std::size_t>(in.gcount()));
    if (text.size() > kMaxBytes) Fail("larger than 1 MiB, expected a file of PEM");
    return text;
  }
};

Bio Open(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

/// No question at a terminal where a key has a password.
int NoPassword(char*, int, int, void*) { return 0; }

std::string TimeText(const ASN1_TIME* time) {
  const Bio out(BIO_new(BIO_s_mem()));
  std::array<char, 64> text{};
  if (ASN1_TIME_print(out.get(), time) != 1) return "?";
  const int size = BIO_read(out.get(), text.data(), static_cast<int>(text.size()));
  return {text.data(), static_cast<std::size_t>(std::max(size, 0))};
}

Certificate FirstCertificate(const Source& source, const std::string& text) {
  Certificate certificate(PEM_read_bio_X509(Open(text).get(), nullptr, NoPassword, nullptr));
  if (!certificate) source.Fail("has no certificate in PEM (-----BEGIN CERTIFICATE-----)");
  return certificate;
}

void CheckTime(const Source& source, const X509& certificate) {
  const ASN1_TIME* from = X509_get0_notBefore(&certificate);
  const ASN1_TIME* to = X509_get0_notAfter(&certificate);
  if (X509_cmp_current_time(to) < 0) source.Fail("the certificate expired on " + TimeText(to));
  if (X509_cmp_current_time(from) > 0) {
    source.Fail("the certificate is valid from " + TimeText(from) + " only");
  }
}

}  // namespace

TlsMaterial ReadTls(const TlsFiles& files) {
  const Source of_certificate{"--tls-cert", files.certificates};
  const Source of_key{"--tls-key", files.key};
  const Source of_ca{"--tls-client-ca", files.client_ca};
  TlsMaterial material;
  material.certificates = of_certificate.Read();
  const Certificate certificate = FirstCertificate(of_certificate, material.certificates);
  CheckTime(of_certificate, *certificate);
  material.key = of_key.Read();
  const Key key(PEM_read_bio_PrivateKey(Open(material.key).get(), nullptr, NoPassword, nullptr));
  if (!key) of_key.Fail("has no private key in PEM without a password");
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    of_key.Fail("is not the key of the certificate in " + files.certificates);
  }
  if (!files.client_ca.empty()) {
    material.client_ca = of_ca.Read();
    FirstCertificate(of_ca, material.client_ca);
  }
  return material;
}

}  // namespace grouser::server
