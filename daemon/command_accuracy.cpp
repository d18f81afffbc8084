// darmd accuracy: what accuracy costs in time, as a page, tables and files.
#include <array>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <string>

#include "daemon/accuracy/report/report_page.hpp"
#include "daemon/accuracy/study.hpp"
#include "daemon/commands.hpp"
#include "daemon/lifecycle/interruption.hpp"
#include "daemon/observe/log.hpp"
#include "daemon/writable.hpp"

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

constexpr std::array kFiles{"accuracy.html", "accuracy.md", "accuracy.json", "curves.csv", "figures.csv"};

// The study looks after its own.
Result<void> check_places(const fs::path& folder) {
  for (const fs::path& made : {folder, folder / "pictures"})
    if (auto ok = make_writable_folder(made); !ok) return ok;
  for (const char* name : kFiles)
    if (auto ok = check_writable_file(folder / name); !ok) return ok;
  return {};
}

Result<void> write_report(const fs::path& folder, const accuracy::Report& report) {
  const std::string prefix = picture_prefix(report);
  auto files = accuracy::svg_files(report, prefix);
  const std::array texts{accuracy::html_page(report), accuracy::markdown_page(report, prefix),
                         accuracy::json_text(report), accuracy::curves_csv(report), accuracy::figures_csv(report)};
  static_assert(texts.size() == kFiles.size());
  for (std::size_t i = 0; i < texts.size(); ++i) files.emplace_back(kFiles[i], texts[i]);
  for (const auto& [name, text] : files)
    if (auto written = write_text(folder / name, text); !written) return written;
  return {};
}

}  // namespace

int run(const AccuracyCommand& command) {
  const lifecycle::Interruption interruption("darmd accuracy");
  observe::set_up_log("warn", false);  // standard error is the progress's
  accuracy::StudyOptions options;
  options.config = command.config;
  options.cameras = command.cameras;
  options.only = command.only;
  options.out = command.out;
  options.viewport = {command.width, command.height};
  options.seconds = command.seconds;
  options.reference_psnr = command.reference_psnr;
  options.stopped = [&interruption] { return interruption.asked(); };
  const auto failed = [](const Error& error) {
    std::fprintf(stderr, "darmd accuracy: %s\n", error.message.c_str());
    return 1;
  };
  if (auto ok = check_places(command.out); !ok) return failed(ok.error());
  Progress progress("darmd accuracy", command.json);
  const auto study = accuracy::run_study(options, progress);
  if (!study) return failed(study.error());
  if (auto written = write_report(command.out, study->report); !written) return failed(written.error());
  if (command.json) {
    std::printf("%s", accuracy::json_text(study->report).c_str());
  } else {
    std::printf("%s: %zu measured, %zu from before", (command.out / "accuracy.html").c_str(), study->measured,
                study->kept);
    if (study->left_out > 0) std::printf(", %zu left out", study->left_out);
    std::printf("\n");
  }
  if (!study->stopped) return 0;
  std::fprintf(stderr, "darmd accuracy: interrupted; the same command goes on where it stopped\n");
  return lifecycle::kInterrupted;
}

}  // namespace darm
