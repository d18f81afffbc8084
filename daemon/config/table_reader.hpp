// Reads the keys of one table into variables, checks ranges, and knows at the end which keys nobody asked for.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/load.hpp"
#include "daemon/config/toml_value.hpp"

namespace darm::config {

/// Where readers of one file report. `known`: also collect the names of all keys asked for.
struct ReadReport {
  std::string file;
  std::vector<Fault>* faults = nullptr;
  std::vector<std::string>* known = nullptr;
};

/// A key, or another text of the user's, as it may stand in a message.
[[nodiscard]] std::string printable(std::string_view key);

/// A key that is absent leaves its variable as it is; a faulty one is reported and does too. finish() once at the end.
class TableReader {
 public:
  /// `table` may be null (nothing is there). `prefix` is put before keys: "stream." or "cameras[1].".
  TableReader(ReadReport& report, const TomlTable* table, int line, std::string prefix);

  void boolean(std::string_view key, bool& out);
  void integer(std::string_view key, std::int64_t low, std::int64_t high, const std::function<void(std::int64_t)>& set);
  template <class T>
  void integer(std::string_view key, T& out, std::int64_t low, std::int64_t high) {
    integer(key, low, high, [&out](std::int64_t value) { out = static_cast<T>(value); });
  }
  /// A finite number in [low, high]; integers are taken too.
  void number(std::string_view key, double& out, double low, double high);
  /// The same, or "auto", which sets 0.
  void number_or_auto(std::string_view key, double& out, double low, double high);
  /// True: it is there, and sound.
  bool text(std::string_view key, std::string& out, std::size_t max_length);
  /// A list of at most `most` texts.
  void texts(std::string_view key, std::vector<std::string>& out, std::size_t most, std::size_t max_length);
  void choice(std::string_view key, std::string& out, std::initializer_list<std::string_view> allowed);
  void one_of(std::string_view key, std::uint32_t& out, std::initializer_list<std::uint32_t> allowed);
  void vector3(std::string_view key, glm::dvec3& out, double low, double high);
  /// Three numbers, or one for all three.
  void rgb(std::string_view key, glm::dvec3& out, double low, double high);
  /// A vector3 that is not zero.
  void direction(std::string_view key, glm::dvec3& out);
  /// A sub-table; true if it is there (or keys are being collected).
  bool table(std::string_view key, const std::function<void(TableReader&)>& read);
  /// A list of tables; `begin` runs before the first if the key is there.
  void tables(std::string_view key, std::size_t most, const std::function<void()>& begin,
              const std::function<void(TableReader&)>& read);
  /// Faults if one of `keys` is absent.
  void require(std::initializer_list<std::string_view> keys);
  /// A fault of this table at `key`.
  void fault(std::string_view key, const std::string& text);
  /// Reports the keys that nobody asked for, with the nearest that is known.
  void finish();

 private:
  const TomlValue* find(std::string_view key) const;
  const TomlValue* ask(std::string_view key);
  const TomlValue* ask_section(std::string_view key);
  void fault_at(const TomlValue& value, std::string_view key, const std::string& text);
  bool read_number(const TomlValue& value, std::string_view key, double low, double high, double& out);
  bool read_vector(const TomlValue& value, std::string_view key, double low, double high, glm::dvec3& out);

  ReadReport& report_;
  const TomlTable* table_;
  int line_;
  std::string prefix_;
  std::vector<std::string> asked_;
};

}  // namespace darm::config
