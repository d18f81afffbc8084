#include "daemon/lifecycle/service_notifier.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace darm::lifecycle {
namespace {

std::optional<long long> number_of(const char* text) {
  if (text == nullptr) return std::nullopt;
  long long value = 0;
  const char* end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, value);
  if (error != std::errc() || stop != end || value <= 0) return std::nullopt;
  return value;
}

// A status is one line: a newline would start another assignment.
std::string one_line(std::string_view text) {
  std::string line(text);
  for (char& c : line)
    if (c == '\n' || c == '\r') c = ' ';
  return line;
}

}  // namespace

ServiceNotifier ServiceNotifier::from_environment() {
  const char* path = std::getenv("NOTIFY_SOCKET");
  const std::string socket_path = path != nullptr ? path : "";
  std::optional<std::chrono::microseconds> watchdog;
  const auto limit = number_of(std::getenv("WATCHDOG_USEC"));
  const char* pid_text = std::getenv("WATCHDOG_PID");
  const bool ours = pid_text == nullptr || number_of(pid_text) == static_cast<long long>(getpid());
  if (limit && ours) watchdog = std::chrono::microseconds(*limit);
  unsetenv("NOTIFY_SOCKET");
  unsetenv("WATCHDOG_USEC");
  unsetenv("WATCHDOG_PID");
  return ServiceNotifier(socket_path, watchdog);
}

ServiceNotifier::ServiceNotifier(const std::string& socket_path, std::optional<std::chrono::microseconds> watchdog) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const bool valid = socket_path.size() > 1 && socket_path.size() < sizeof address.sun_path &&
                     (socket_path[0] == '/' || socket_path[0] == '@');
  if (!valid) return;
  std::memcpy(address.sun_path, socket_path.data(), socket_path.size());
  if (socket_path[0] == '@') address.sun_path[0] = '\0';
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return;
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_path.size());
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), length) != 0) {
    close(fd);
    return;
  }
  socket_ = fd;
  if (watchdog) interval_ = *watchdog / 2;
}

ServiceNotifier::~ServiceNotifier() {
  if (socket_ >= 0) close(socket_);
}

ServiceNotifier::ServiceNotifier(ServiceNotifier&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), interval_(other.interval_) {}

void ServiceNotifier::send(const std::string& state) const {
  if (socket_ >= 0) (void)!::send(socket_, state.data(), state.size(), MSG_NOSIGNAL);
}

void ServiceNotifier::ready(std::string_view status) const { send("READY=1\nSTATUS=" + one_line(status)); }
void ServiceNotifier::status(std::string_view status) const { send("STATUS=" + one_line(status)); }
void ServiceNotifier::stopping() const { send("STOPPING=1"); }
void ServiceNotifier::watchdog() const { send("WATCHDOG=1"); }

}  // namespace darm::lifecycle
