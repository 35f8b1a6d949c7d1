// The image itself: its size, its file for dfu-util, and a boot in an emulated STM32F405 whose stream is
// logged into a campaign file. The emulator keeps no real time, so that sequence and content are checked, and
// never a rate.
#include "cli/program.h"
#include "daq/packets.h"
#include "datasets/campaign_file.h"
#include "datasets/raw_store.h"
#include "simulated/board.h"
#include "support/temporary_folder.h"

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace tunnelrig {
namespace {

const std::filesystem::path kImages = TUNNELRIG_IMAGES;

#define SKIP_WITHOUT_IMAGE()                                                                     \
  if (!std::filesystem::exists(kImages / "tunnelrig-f405.elf")) {                                \
    GTEST_SKIP() << "no image in " << kImages << ": arm-none-eabi-gcc is missing (./rig setup)"; \
  }

std::vector<unsigned char> bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Sizes of a section of an ELF file by `arm-none-eabi-size -A`.
std::size_t section(const std::filesystem::path& elf, const std::string& name) {
  const test::TemporaryFolder folder;
  const auto out = folder / "size";
  const std::string command = "arm-none-eabi-size -A '" + elf.string() + "' >'" + out.string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::ifstream in(out);
  for (std::string word; in >> word;) {
    std::size_t size = 0;
    if (word == name && in >> size) return size;
  }
  return 0;
}

TEST(Image, FitsItsLimits) {
  SKIP_WITHOUT_IMAGE();
  for (const char* name : {"tunnelrig-f405", "tunnelrig-f405-12MHz"}) {
    const auto elf = kImages / (std::string(name) + ".elf");
    const std::size_t flash = std::filesystem::file_size(kImages / (std::string(name) + ".bin"));
    const std::size_t ram =
        section(elf, ".stack") + section(elf, ".survives") + section(elf, ".data") + section(elf, ".bss");
    EXPECT_LT(flash, 24u * 1024);
    EXPECT_LT(ram, 80u * 1024);
    EXPECT_GT(ram, 64u * 1024) << "the ring";
    RecordProperty(std::string(name) + "_flash", static_cast<int>(flash));
    RecordProperty(std::string(name) + "_ram", static_cast<int>(ram));
  }
}

TEST(Image, VectorsPointIntoTheImageAndTheStackHasNothingBelowIt) {
  SKIP_WITHOUT_IMAGE();
  const auto image = bytes_of(kImages / "tunnelrig-f405.bin");
  ASSERT_GT(image.size(), 98u * 4);
  const auto word = [&](std::size_t i) { return trw_get32(image.data() + 4 * i); };
  EXPECT_EQ(word(0), 0x20000000u + 4096) << "the stack is the lowest of the RAM";
  for (std::size_t i = 1; i < 98; ++i) {
    EXPECT_EQ(word(i) & 1u, 1u) << "Thumb, vector " << i;
    EXPECT_LT(word(i) - 0x08000000u, image.size()) << i;
  }
}

TEST(Image, NoFunctionCallsItself) {
  SKIP_WITHOUT_IMAGE();
  const std::string command = "/usr/bin/python3 '" TUNNELRIG_FIRMWARE_SOURCE "/cycles.py' '" +
                              (kImages / "tunnelrig-f405.elf").string() + "' --recursion";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST(Image, DfuFileIsWhole) {
  SKIP_WITHOUT_IMAGE();
  const auto dfu = bytes_of(kImages / "tunnelrig-f405.dfu"), image = bytes_of(kImages / "tunnelrig-f405.bin");
  ASSERT_EQ(dfu.size(), 11 + 274 + 8 + image.size() + 16);
  EXPECT_EQ(std::string(dfu.begin(), dfu.begin() + 5), "DfuSe");
  EXPECT_EQ(trw_get32(dfu.data() + 285), 0x08000000u);
  EXPECT_TRUE(std::equal(image.begin(), image.end(), dfu.begin() + 293));
  std::uint32_t crc = 0xFFFFFFFFu;  // of everything before it, IEEE 802.3, not inverted at the end
  for (std::size_t i = 0; i + 4 < dfu.size(); ++i) {
    crc ^= dfu[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1u) != 0 ? 0xEDB88320u : 0u);
  }
  EXPECT_EQ(trw_get32(dfu.data() + dfu.size() - 4), crc);
}

int free_port() {
  const int probe = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  EXPECT_EQ(::bind(probe, reinterpret_cast<sockaddr*>(&address), length), 0);
  ::getsockname(probe, reinterpret_cast<sockaddr*>(&address), &length);
  ::close(probe);
  return ntohs(address.sin_port);
}

/// An emulated board; reaped by its own process id.
class Emulator {
 public:
  explicit Emulator(const std::filesystem::path& image) : port_(free_port()) {
    process_ = ::fork();
    if (process_ != 0) return;
    const std::string serial = "tcp:127.0.0.1:" + std::to_string(port_) + ",server=on,wait=on";
    if (std::freopen("/dev/null", "w", stdout) == nullptr ||
        std::freopen("/dev/null", "w", stderr) == nullptr)
      ::_exit(126);
    ::execlp("qemu-system-arm", "qemu-system-arm", "-M", "netduinoplus2", "-kernel", image.c_str(),
             "-display", "none", "-monitor", "none", "-serial", serial.c_str(), "-icount",
             "shift=6,sleep=off", nullptr);
    ::_exit(127);
  }
  ~Emulator() {
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;

  int port() const { return port_; }

 private:
  int port_;
  pid_t process_ = -1;
};

TEST(Image, BootsInAnEmulatorAndIsLogged) {
  SKIP_WITHOUT_IMAGE();
  if (std::system("command -v qemu-system-arm >/dev/null") != 0)
    GTEST_SKIP() << "no qemu-system-arm (./rig setup)";
  const test::TemporaryFolder folder;
  const Emulator emulator(kImages / "tunnelrig-emulator.elf");
  const std::string arguments =
      "log --db c.db --location OT --session S1 --duration 20 --source tcp:127.0.0.1:" +
      std::to_string(emulator.port());
  test::ProgramResult result;
  for (int attempt = 0; attempt < 50; ++attempt) {  // until the emulator listens
    result = test::run_program(folder.path(), arguments);
    if (result.error.find("refused") == std::string::npos) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const CampaignFile file(folder / "c.db", CampaignFile::Access::kRead);
  const RawRun run = raw_run(file, "R0001").value();
  const Ledger ledger = ledger_of(file, run.id).value();
  EXPECT_EQ(run.state, RunState::kComplete) << result.error;
  EXPECT_EQ(ledger.frames_stored, 26667u);
  EXPECT_EQ(ledger.frames_lost + ledger.packets_corrupt + ledger.bytes_skipped + ledger.reboots, 0u);
  EXPECT_EQ(ledger.boot_id, 0x454D5531u);
  EXPECT_EQ(ledger.first_sequence, 0u);
  test::FrameList list;
  read_raw(file, run, list);
  for (std::size_t i = 0; i < list.samples.size(); ++i) {
    ASSERT_EQ(list.samples[i], simulated::sample_of(i / 4, i % 4)) << "frame " << i / 4;
  }
}

TEST(Image, CppcheckFindsNothing) {
  if (std::system("command -v cppcheck >/dev/null") != 0) GTEST_SKIP() << "no cppcheck (./rig setup)";
  const std::string source = TUNNELRIG_FIRMWARE_SOURCE;
  const std::string command =
      "cd '" + source +
      "' && cppcheck --quiet --error-exitcode=1 --std=c11 --enable=warning,style,performance,portability "
      "--inline-suppr --suppress=unusedStructMember --suppress=missingIncludeSystem -Icore -Iboard "
      "-Iboard/include -Iwire core board";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

}  // namespace
}  // namespace tunnelrig
