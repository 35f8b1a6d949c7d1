// tunnelrig demo: the whole chain on the virtual rig, each step the command that a user would type.
#include "cli/console.h"
#include "cli/verb.h"
#include "datasets/csv.h"
#include "datasets/error.h"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include <fmt/format.h>
#include <sys/wait.h>

namespace tunnelrig::cli {
namespace {

struct DemoOptions {
  std::string out = "demo";
  double duration_s = 20;
};

std::string shell_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

/// Words of a command line, quoted only where they must be.
std::string line_of(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) {
    const bool plain = word.find_first_not_of(
                           "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                           "_-./,:=") == std::string::npos;
    line += (line.empty() ? "" : " ") + (plain && !word.empty() ? word : shell_quoted(word));
  }
  return line;
}

int exit_code(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : kProblemFound; }

class Demo {
 public:
  explicit Demo(const DemoOptions& options)
      : out_(options.out),
        duration_(fmt::format("{:g}", options.duration_s)),
        program_(shell_quoted(std::filesystem::read_symlink("/proc/self/exe").string())) {}

  int run() {
    const std::string db = path("campaign.db"), plan = path("plan.csv"), report = path("report.html");
    tell(fmt::format(
        "The thesis's campaign on the virtual rig (simulated): 42 tunnel locations, OS, GND and CEIL, ten "
        "runs of {} s each.\n",
        duration_));
    int code = step({"plan", "--out", plan, "--duration", duration_});
    if (code == kWell)
      code = record({"log", "--db", db, "--plan", plan, "--source", "virtual", "--speed", "max"});
    const std::vector<std::vector<std::string>> rest = {
        {"calibrate", "--db", db},
        {"reduce", "--db", db, "--csv", path("coefficients.csv")},
        {"map", "--db", db, "--out", path("maps")},
        {"doctor", "--db", db},
        {"report", "--db", db, "--out", report}};
    for (const auto& words : rest)
      if (code == kWell) code = step(words);
    if (code == kWell) fmt::print("\nOpen {} in a browser; the maps are in {}.\n", report, path("maps"));
    return code;
  }

 private:
  std::string path(const char* name) const { return (out_ / name).string(); }

  /// The command as a user would type it, and as the shell runs it.
  std::string announce(const std::vector<std::string>& words) const {
    fmt::print("\n$ tunnelrig {}\n", line_of(words));
    std::fflush(stdout);
    return program_ + " " + line_of(words);
  }

  int step(const std::vector<std::string>& words) const {
    return exit_code(std::system(announce(words).c_str()));
  }

  /// Shows the first runs of a recording and how far it is; the whole list goes into log.txt.
  int record(const std::vector<std::string>& words) const {
    constexpr std::size_t kShown = 2;
    std::ofstream log(path("log.txt"));
    std::FILE* recording = ::popen(announce(words).c_str(), "r");
    if (recording == nullptr) throw StorageError("the recording cannot be started", false);
    std::size_t runs = 0, total = 0;
    {
      ProgressBar bar("recording");
      const auto show = show_on(bar);
      std::array<char, 4096> line{};
      while (std::fgets(line.data(), line.size(), recording) != nullptr) {
        const std::string text = line.data();
        log << text;
        const bool is_run = text.find(" frames, ") != std::string::npos;
        if (!is_run || ++runs <= kShown) fmt::print("{}", text);
        if (total == 0 && std::sscanf(text.c_str(), "%*[^:]: %zu of", &total) != 1) total = 0;
        show(runs, total);
      }
    }
    const int code = exit_code(::pclose(recording));
    fmt::print("… {} runs recorded, the list is in {}\n", runs, path("log.txt"));
    return code;
  }

  std::filesystem::path out_;
  std::string duration_, program_;
};

int run_demo(const DemoOptions& options) {
  const std::filesystem::path db = std::filesystem::path(options.out) / "campaign.db";
  if (std::filesystem::exists(db))
    throw InputError::in(db.string(), "is there already; name another folder with --out");
  make_folder(options.out);
  return Demo(options).run();
}

}  // namespace

void add_demo(CLI::App& app, Work& work) {
  auto options = std::make_shared<DemoOptions>();
  CLI::App* verb =
      app.add_subcommand("demo", "The whole chain on the virtual rig: log, calibrate, reduce, map, report");
  verb->footer(
      "Prints every command before it runs it. What is recorded is simulated, and marked so; "
      "docs/virtual-rig.md.\n\n"
      "Example: tunnelrig demo --out demo");
  verb->add_option("--out", options->out, "Folder for everything; made where it is missing")
      ->capture_default_str();
  verb->add_option("--duration", options->duration_s, "Seconds of each run")
      ->check(CLI::Range(0.5, 3600.0))
      ->capture_default_str();
  verb->callback([options, &work] { work = [options] { return run_demo(*options); }; });
}

}  // namespace tunnelrig::cli
