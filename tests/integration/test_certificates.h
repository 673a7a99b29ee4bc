#pragma once

#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>

#include "tests/unit/server/temp_dir.h"

namespace grouser::testing {

/// Throwaway certificates of a throwaway authority, by the openssl command.
/// Each NAME has NAME.pem and NAME.key in dir().
class TestCertificates {
 public:
  static constexpr const char* kThisMachine = "-addext subjectAltName=DNS:localhost,IP:127.0.0.1";

  TestCertificates() {
    std::ofstream(dir_ / "c.cnf") << "[req]\ndistinguished_name=dn\n[dn]\n";
    Make("ca", "-days 2 -addext basicConstraints=critical,CA:TRUE");
    Make("other-ca", "-days 2 -addext basicConstraints=critical,CA:TRUE");
  }

  /// Signed by the authority, valid for two days; `more`: openssl req's options.
  void Sign(const std::string& name, const std::string& more = "") const {
    Make(name, "-days 2 -CA " + Pem("ca") + " -CAkey " + Key("ca") + " " + more);
  }
  void SignExpired(const std::string& name) const {
    Run("openssl req -new -config " + (dir_ / "c.cnf") + kNewKey + Key(name) + " -out " +
        (dir_ / "csr") + " -subj /CN=" + name + " " + kThisMachine);
    Run("openssl x509 -req -copy_extensions copy -days -1 -in " + (dir_ / "csr") + " -CA " +
        Pem("ca") + " -CAkey " + Key("ca") + " -out " + Pem(name));
  }
  std::string Pem(const std::string& name) const { return dir_ / (name + ".pem"); }
  std::string Key(const std::string& name) const { return dir_ / (name + ".key"); }
  const TempDir& dir() const { return dir_; }

 private:
  static constexpr const char* kNewKey =
      " -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -keyout ";

  void Make(const std::string& name, const std::string& more) const {
    Run("openssl req -x509 -config " + (dir_ / "c.cnf") + kNewKey + Key(name) + " -out " +
        Pem(name) + " -subj /CN=" + name + " " + more);
  }
  static void Run(const std::string& command) {
    if (std::system((command + " 2>/dev/null").c_str()) != 0) {
      throw std::runtime_error("failed: " + command);
    }
  }

  TempDir dir_;
};

}  // namespace grouser::testing
