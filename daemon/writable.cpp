#include "daemon/writable.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

namespace darm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWayOut = "; name another place, or make this one writable";

std::string words_of(int error) { return std::generic_category().message(error); }

// Opens for writing as the work will; 0 or errno.
int try_open(const fs::path& file, int flags) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CLOEXEC | flags, 0666);
  if (fd < 0) return errno;
  ::close(fd);
  return 0;
}

// A new file under this name; 0 or errno.
int try_new(const fs::path& file) {
  const int error = try_open(file, O_CREAT | O_EXCL);
  if (error == 0) ::unlink(file.c_str());
  return error;
}

}  // namespace

Result<void> check_writable_file(const fs::path& file) {
  std::error_code ignored;
  const auto status = fs::status(file, ignored);
  if (fs::is_directory(status)) return fail(file.string() + ": cannot be written: it is a folder; name a file");
  const int error = fs::exists(status) ? try_open(file, O_NONBLOCK) : try_new(file);
  if (error != 0) return fail(file.string() + ": cannot be written: " + words_of(error) + kWayOut);
  return {};
}

Result<void> make_writable_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && !fs::is_directory(folder, error)) error = std::make_error_code(std::errc::not_a_directory);
  if (error) return fail(folder.string() + ": the folder cannot be made: " + error.message() + kWayOut);
  const int tried = try_new(folder / (".darmd-" + std::to_string(::getpid())));
  if (tried != 0 && tried != EEXIST)
    return fail(folder.string() + ": nothing can be written there: " + words_of(tried) + kWayOut);
  return {};
}

}  // namespace darm
