#include "daemon/config/table_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace darm::config {
namespace {

// Levenshtein distance; keys are short.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

}  // namespace

std::string printable(std::string_view key) {
  std::string text(key.substr(0, 60));
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return text;
}

TableReader::TableReader(ReadReport& report, const TomlTable* table, int line, std::string prefix)
    : report_(report), table_(table), line_(line), prefix_(std::move(prefix)) {}

const TomlValue* TableReader::find(std::string_view key) const {
  if (table_ == nullptr) return nullptr;
  for (const auto& [name, value] : *table_)
    if (name == key) return &value;
  return nullptr;
}

const TomlValue* TableReader::ask(std::string_view key) {
  if (report_.known != nullptr) report_.known->push_back(prefix_ + std::string(key));
  return ask_section(key);
}

const TomlValue* TableReader::ask_section(std::string_view key) {
  asked_.emplace_back(key);
  return find(key);
}

void TableReader::fault_at(const TomlValue& value, std::string_view key, const std::string& text) {
  report_.faults->push_back({report_.file, value.line != 0 ? value.line : line_, prefix_ + printable(key), text});
}

void TableReader::fault(std::string_view key, const std::string& text) {
  const TomlValue* value = find(key);
  report_.faults->push_back(
      {report_.file, value != nullptr && value->line != 0 ? value->line : line_, prefix_ + printable(key), text});
}

void TableReader::boolean(std::string_view key, bool& out) {
  const TomlValue* value = ask(key);
  if (value == nullptr) return;
  if (const auto* b = std::get_if<bool>(&value->data))
    out = *b;
  else
    fault_at(*value, key, fmt::format("{} is not true or false", value->shown()));
}

void TableReader::integer(std::string_view key, std::int64_t low, std::int64_t high,
                          const std::function<void(std::int64_t)>& set) {
  const TomlValue* value = ask(key);
  if (value == nullptr) return;
  const auto* i = std::get_if<std::int64_t>(&value->data);
  if (i == nullptr || *i < low || *i > high)
    fault_at(*value, key, fmt::format("{} is not a whole number from {} to {}", value->shown(), low, high));
  else
    set(*i);
}

bool TableReader::read_number(const TomlValue& value, std::string_view key, double low, double high, double& out) {
  double number = NAN;
  if (const auto* d = std::get_if<double>(&value.data)) number = *d;
  if (const auto* i = std::get_if<std::int64_t>(&value.data)) number = static_cast<double>(*i);
  if (std::isfinite(number) && number >= low && number <= high) {
    out = number;
    return true;
  }
  fault_at(value, key, fmt::format("{} is not a number from {} to {}", value.shown(), low, high));
  return false;
}

void TableReader::number(std::string_view key, double& out, double low, double high) {
  if (const TomlValue* value = ask(key)) (void)read_number(*value, key, low, high, out);
}

void TableReader::number_or_auto(std::string_view key, double& out, double low, double high) {
  const TomlValue* value = ask(key);
  if (value == nullptr) return;
  if (const auto* s = std::get_if<std::string>(&value->data)) {
    if (*s == "auto")
      out = 0;
    else
      fault_at(*value, key, fmt::format("{} is not \"auto\" or a number from {} to {}", value->shown(), low, high));
    return;
  }
  (void)read_number(*value, key, low, high, out);
}

void TableReader::texts(std::string_view key, std::vector<std::string>& out, std::size_t most, std::size_t max_length) {
  const TomlValue* value = ask(key);
  if (value == nullptr) return;
  const auto* array = value->array();
  std::vector<std::string> read;
  for (std::size_t i = 0; array != nullptr && i < array->size() && i < most; ++i) {
    const auto* s = std::get_if<std::string>(&(*array)[i].data);
    if (s != nullptr && s->size() <= max_length && s->find('\0') == std::string::npos) read.push_back(*s);
  }
  if (array == nullptr || read.size() != array->size())
    fault_at(*value, key,
             fmt::format("{} is not a list of at most {} texts of {} bytes", value->shown(), most, max_length));
  else
    out = std::move(read);
}

bool TableReader::text(std::string_view key, std::string& out, std::size_t max_length) {
  const TomlValue* value = ask(key);
  if (value == nullptr) return false;
  const auto* s = std::get_if<std::string>(&value->data);
  if (s == nullptr || s->size() > max_length || s->find('\0') != std::string::npos) {
    fault_at(*value, key, fmt::format("{} is not a text of at most {} bytes", value->shown(), max_length));
    return false;
  }
  out = *s;
  return true;
}

void TableReader::choice(std::string_view key, std::string& out, std::initializer_list<std::string_view> allowed) {
  const TomlValue* value = ask(key);
  if (value == nullptr) return;
  const auto* s = std::get_if<std::string>(&value->data);
  if (s != nullptr && std::find(allowed.begin(), allowed.end(), *s) != allowed.end())
    out = *s;
  else
    fault_at(*value, key, fmt::format("{} is not one of {}", value->shown(), fmt::join(allowed, ", ")));
}

void TableReader::one_of(std::string_view key, std::uint32_t& out, std::initializer_list<std::uint32_t> allowed) {
  const TomlValue* value = ask(key);
  if (value == nullptr) return;
  const auto* i = std::get_if<std::int64_t>(&value->data);
  if (i != nullptr && std::find(allowed.begin(), allowed.end(), *i) != allowed.end())
    out = static_cast<std::uint32_t>(*i);
  else
    fault_at(*value, key, fmt::format("{} is not one of {}", value->shown(), fmt::join(allowed, ", ")));
}

bool TableReader::read_vector(const TomlValue& value, std::string_view key, double low, double high, glm::dvec3& out) {
  const auto* array = value.array();
  if (array == nullptr || array->size() != 3) {
    fault_at(value, key, fmt::format("{} is not a list of three numbers from {} to {}", value.shown(), low, high));
    return false;
  }
  glm::dvec3 result;
  for (int i = 0; i < 3; ++i)
    if (!read_number((*array)[static_cast<std::size_t>(i)], key, low, high, result[i])) return false;
  out = result;
  return true;
}

void TableReader::vector3(std::string_view key, glm::dvec3& out, double low, double high) {
  if (const TomlValue* value = ask(key)) (void)read_vector(*value, key, low, high, out);
}

void TableReader::rgb(std::string_view key, glm::dvec3& out, double low, double high) {
  const TomlValue* value = ask(key);
  if (value == nullptr) return;
  if (value->array() != nullptr) {
    (void)read_vector(*value, key, low, high, out);
    return;
  }
  double grey = 0;
  if (read_number(*value, key, low, high, grey)) out = glm::dvec3(grey);
}

void TableReader::direction(std::string_view key, glm::dvec3& out) {
  const TomlValue* value = ask(key);
  glm::dvec3 vector;
  if (value == nullptr || !read_vector(*value, key, -1e6, 1e6, vector)) return;
  if (vector.x * vector.x + vector.y * vector.y + vector.z * vector.z > 1e-12)
    out = vector;
  else
    fault_at(*value, key, "a direction must be longer than 1e-6");
}

bool TableReader::table(std::string_view key, const std::function<void(TableReader&)>& read) {
  const TomlValue* value = ask_section(key);
  const TomlTable* table = value != nullptr ? value->table() : nullptr;
  if (value != nullptr && table == nullptr)
    fault_at(*value, key, fmt::format("{} is not a section; write [{}{}]", value->shown(), prefix_, key));
  if (table == nullptr && report_.known == nullptr) return false;
  TableReader inner(report_, table, value != nullptr ? value->line : 0, fmt::format("{}{}.", prefix_, key));
  read(inner);
  inner.finish();
  return true;
}

void TableReader::tables(std::string_view key, std::size_t most, const std::function<void()>& begin,
                         const std::function<void(TableReader&)>& read) {
  const TomlValue* value = ask_section(key);
  if (report_.known != nullptr) {
    TableReader inner(report_, nullptr, 0, fmt::format("{}{}[].", prefix_, key));
    read(inner);
    inner.finish();
  }
  if (value == nullptr) return;
  const auto* array = value->array();
  if (array == nullptr || array->size() > most) {
    fault_at(*value, key,
             fmt::format("{} is not a list of at most {} sections [[{}{}]]", value->shown(), most, prefix_, key));
    return;
  }
  begin();
  for (std::size_t i = 0; i < array->size(); ++i) {
    const auto& element = (*array)[i];
    const auto* table = element.table();
    if (table == nullptr) {
      fault_at(element, key, fmt::format("{} is not a section [[{}{}]]", element.shown(), prefix_, key));
      continue;
    }
    TableReader inner(report_, table, element.line, fmt::format("{}{}[{}].", prefix_, key, i));
    read(inner);
    inner.finish();
  }
}

void TableReader::require(std::initializer_list<std::string_view> keys) {
  if (table_ == nullptr) return;
  for (const auto key : keys)
    if (find(key) == nullptr) fault(key, "is missing");
}

void TableReader::finish() {
  if (table_ == nullptr) return;
  for (const auto& [key, value] : *table_) {
    if (std::find(asked_.begin(), asked_.end(), key) != asked_.end()) continue;
    std::string nearest;
    std::size_t best = std::max<std::size_t>(2, key.size() / 3) + 1;
    if (key.size() <= 64) {
      for (const auto& known : asked_) {
        const std::size_t distance = edit_distance(key, known);
        if (distance < best) {
          best = distance;
          nearest = known;
        }
      }
    }
    fault_at(value, key,
             nearest.empty() ? fmt::format("unknown key; known are {}", fmt::join(asked_, ", "))
                             : fmt::format("unknown key; did you mean {}?", nearest));
  }
}

}  // namespace darm::config
