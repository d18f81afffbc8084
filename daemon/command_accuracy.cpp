// darmd accuracy: what accuracy costs in time, as a page, tables and files.
#include <atomic>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <system_error>

#include "daemon/accuracy/report/report_page.hpp"
#include "daemon/accuracy/study.hpp"
#include "daemon/commands.hpp"
#include "daemon/lifecycle/stop_signals.hpp"
#include "daemon/observe/log.hpp"

namespace darm {
namespace {

namespace fs = std::filesystem;

// Pictures of several scenes may lie in one folder: "pictures/sponza-".
std::string picture_prefix(const accuracy::Report& report) {
  std::string stem = fs::path(report.scene).stem().string().substr(0, 64);
  for (char& c : stem)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_') c = '-';
  return "pictures/" + stem + "-";
}

Result<void> write_text(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out << text;
  out.close();
  if (!out) return fail(file.string() + ": cannot be written; check the folder and the free space");
  return {};
}

Result<void> write_report(const fs::path& folder, const accuracy::Report& report) {
  const std::string prefix = picture_prefix(report);
  std::error_code error;
  fs::create_directories(folder / "pictures", error);
  if (error) return fail((folder / "pictures").string() + ": cannot be made: " + error.message());
  auto files = accuracy::svg_files(report, prefix);
  files.emplace_back("accuracy.html", accuracy::html_page(report));
  files.emplace_back("accuracy.md", accuracy::markdown_page(report, prefix));
  files.emplace_back("accuracy.json", accuracy::json_text(report));
  files.emplace_back("curves.csv", accuracy::curves_csv(report));
  files.emplace_back("figures.csv", accuracy::figures_csv(report));
  for (const auto& [name, text] : files)
    if (auto written = write_text(folder / name, text); !written) return written;
  return {};
}

}  // namespace

int run(const AccuracyCommand& command) {
  std::atomic<bool> asked{false};
  const lifecycle::StopSignals signals([&asked](int) {
    if (asked.exchange(true)) std::_Exit(130);  // the second one means now
  });
  observe::set_up_log("warn", false);  // standard error is the progress's
  accuracy::StudyOptions options;
  options.config = command.config;
  options.cameras = command.cameras;
  options.only = command.only;
  options.out = command.out;
  options.viewport = {command.width, command.height};
  options.seconds = command.seconds;
  options.reference_psnr = command.reference_psnr;
  options.stopped = [&asked] { return asked.load(); };
  const auto failed = [](const Error& error) {
    std::fprintf(stderr, "darmd accuracy: %s\n", error.message.c_str());
    return 1;
  };
  accuracy::Progress progress("darmd accuracy", command.json);
  const auto study = accuracy::run_study(options, progress);
  if (!study) return failed(study.error());
  if (auto written = write_report(command.out, study->report); !written) return failed(written.error());
  if (command.json) {
    std::printf("%s", accuracy::json_text(study->report).c_str());
  } else {
    std::printf("%s: %zu measured, %zu from before\n", (command.out / "accuracy.html").c_str(), study->measured,
                study->kept);
  }
  if (!study->stopped) return 0;
  std::fprintf(stderr, "darmd accuracy: interrupted; the same command goes on where it stopped\n");
  return 130;
}

}  // namespace darm
