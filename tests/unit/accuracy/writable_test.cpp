#include "daemon/writable.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

namespace darm {
namespace {

namespace fs = std::filesystem;

class Writable : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  void put(const fs::path& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  [[nodiscard]] std::string text_of(const fs::path& name) const {
    std::ifstream in(folder_ / name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  fs::path folder_ = fs::temp_directory_path() / ("darm-writable-" + std::to_string(getpid()));
};

TEST_F(Writable, AskingLeavesNothingAndChangesNothing) {
  put("old.png", "what is there");
  EXPECT_TRUE(check_writable_file(folder_ / "new.png"));
  EXPECT_TRUE(check_writable_file(folder_ / "old.png"));
  EXPECT_TRUE(make_writable_folder(folder_));
  EXPECT_EQ(text_of("old.png"), "what is there");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(Writable, AFolderIsMadeWithThoseAboveIt) {
  EXPECT_TRUE(make_writable_folder(folder_ / "a" / "b"));
  EXPECT_TRUE(fs::is_directory(folder_ / "a" / "b"));
}

TEST_F(Writable, TheErrorNamesThePathAndTheWayOut) {
  put("file", "");
  fs::create_directories(folder_ / "folder.png");
  const auto says = [](const Result<void>& result, const fs::path& path, const std::string& words) {
    ASSERT_FALSE(result) << path;
    EXPECT_TRUE(result.error().message.starts_with(path.string() + ": ")) << result.error().message;
    EXPECT_NE(result.error().message.find(words), std::string::npos) << result.error().message;
  };
  says(check_writable_file(folder_ / "folder.png"), folder_ / "folder.png", "it is a folder; name a file");
  says(check_writable_file(folder_ / "none/x.png"), folder_ / "none/x.png", "name another place");
  says(make_writable_folder(folder_ / "file"), folder_ / "file", "name another place");
  says(make_writable_folder(folder_ / "file/below"), folder_ / "file/below", "name another place");
  says(make_writable_folder("/proc/darm"), "/proc/darm", "name another place");
  if (geteuid() == 0) return;  // may write anywhere
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  says(check_writable_file(folder_ / "new.png"), folder_ / "new.png", "denied");
  says(make_writable_folder(folder_), folder_, "denied");
  fs::permissions(folder_, fs::perms::owner_all);
}

}  // namespace
}  // namespace darm
