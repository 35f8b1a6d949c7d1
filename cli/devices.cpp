#include "cli/console.h"
#include "cli/verb.h"
#include "daq/usb_board.h"
#include "datasets/error.h"

#include <algorithm>
#include <array>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tunnelrig::cli {
namespace {

struct DevicesOptions {
  std::string serial;
  bool json = false, statistics = false, loader = false;
};

constexpr std::array<const char*, 4> kVariants = {"unknown", "F405", "emulator", "simulated"};

const char* variant_of(const trw_identity& identity) {
  return kVariants[identity.variant < kVariants.size() ? identity.variant : 0];
}

std::string firmware_of(const trw_identity& identity) {
  return fmt::format("{}.{} ({})", identity.firmware >> 8, identity.firmware & 0xFF, identity.describe);
}

/// What the board has to say about its past: faults that it survived.
std::string troubles_of(const trw_identity& identity) {
  std::string text;
  if ((identity.flags & TRW_FLAG_CLOCK_FAULT) != 0)
    text += fmt::format("clock step {} timed out; ", identity.clock_fault);
  if ((identity.flags & TRW_FLAG_FAULT_RECORD) != 0)
    text += fmt::format("hard fault at {:#010x} (lr {:#010x}, cfsr {:#x}, hfsr {:#x}, address {:#010x}); ",
                        identity.fault_pc, identity.fault_lr, identity.fault_cfsr, identity.fault_hfsr,
                        identity.fault_address);
  if (text.empty()) return "none";
  return text.substr(0, text.size() - 2);
}

void print_table(const std::vector<UsbDevice>& found) {
  Table table({"serial number", "bus", "board", "firmware", "boot id", "rate [Hz]", "state"});
  for (const UsbDevice& device : found) {
    const std::string where = fmt::format("{}.{}", device.bus, device.address);
    if (!device.identity) {
      table.add({device.serial.empty() ? "?" : device.serial, where, "", "", "", "", device.problem});
      continue;
    }
    const trw_identity& identity = *device.identity;
    table.add({device.serial, where, variant_of(identity), firmware_of(identity),
               fmt::format("{:08X}", identity.boot_id),
               device.rate ? fmt::format("{:.4f}", static_cast<double>(device.rate->tick_hz) /
                                                       device.rate->ticks_per_frame)
                           : "?",
               (identity.flags & TRW_FLAG_RUNNING) != 0 ? "sampling" : "stopped"});
  }
  table.print();
}

void print_statistics(const UsbDevice& device) {
  if (!device.identity || !device.statistics) return;
  const trw_statistics& s = *device.statistics;
  fmt::print(
      "\n{}\n  frames sampled  {}\n  ring            at most {} of {} frames\n  overruns        {} frames\n"
      "  USB             {} transfers, {} stalls, {} resets, {} suspends\n  converter       {} errors\n"
      "  sampling        {} cycles at most\n  faults          {}\n",
      device.serial, s.frames, s.ring_peak, device.identity->ring_frames, s.overruns, s.transfers, s.stalls,
      s.resets, s.suspends, s.adc_errors, s.isr_cycles, troubles_of(*device.identity));
}

nlohmann::ordered_json as_json(const UsbDevice& device) {
  nlohmann::ordered_json json{{"serial", device.serial}, {"bus", device.bus}, {"address", device.address}};
  if (!device.problem.empty()) json["problem"] = device.problem;
  if (device.identity) {
    json["board"] = variant_of(*device.identity);
    json["firmware"] = firmware_of(*device.identity);
    json["boot_id"] = device.identity->boot_id;
    json["sampling"] = (device.identity->flags & TRW_FLAG_RUNNING) != 0;
    json["faults"] = troubles_of(*device.identity);
  }
  if (device.rate) {
    json["tick_hz"] = device.rate->tick_hz;
    json["ticks_per_frame"] = device.rate->ticks_per_frame;
    json["oversampling"] = device.rate->oversampling;
  }
  if (device.statistics) {
    const trw_statistics& s = *device.statistics;
    json["statistics"] = {
        {"frames", s.frames},         {"ring_peak", s.ring_peak}, {"overruns", s.overruns},
        {"stalls", s.stalls},         {"resets", s.resets},       {"suspends", s.suspends},
        {"adc_errors", s.adc_errors}, {"transfers", s.transfers}, {"isr_cycles", s.isr_cycles}};
  }
  return json;
}

int reboot_to_loader(const std::string& serial) {
  std::string why;
  const auto board = UsbBoard::open(std::make_shared<UsbBus>(), serial, why);
  if (!board) throw InputError(fmt::format("devices --loader: {}", why));
  if (!board->reboot_to_loader()) throw InputError("devices --loader: the board refuses");
  fmt::print("the board restarts as 0483:df11; flash it with: dfu-util -a 0 -D tunnelrig-f405.dfu\n");
  return kWell;
}

int run_devices(const DevicesOptions& options) {
  if (options.loader) return reboot_to_loader(options.serial);
  std::vector<UsbDevice> found = list_usb_boards();
  std::erase_if(found, [&](const UsbDevice& device) { return !device.serial.starts_with(options.serial); });
  if (options.json) {
    nlohmann::ordered_json json{{"format", "tunnelrig-devices/1"},
                                {"boards", nlohmann::ordered_json::array()}};
    for (const UsbDevice& device : found) json["boards"].push_back(as_json(device));
    fmt::print("{}\n", json.dump(1));
  } else if (found.empty()) {
    fmt::print("no board on USB ({:04x}:{:04x})\n", static_cast<int>(TRW_USB_VENDOR),
               static_cast<int>(TRW_USB_PRODUCT));
  } else {
    print_table(found);
    for (const UsbDevice& device : found) {
      if (options.statistics) print_statistics(device);
    }
  }
  const bool problem =
      std::any_of(found.begin(), found.end(), [](const UsbDevice& d) { return !d.problem.empty(); });
  return problem ? kProblemFound : kWell;
}

}  // namespace

void add_devices(CLI::App& app, Work& work) {
  auto options = std::make_shared<DevicesOptions>();
  CLI::App* verb = app.add_subcommand("devices", "List the boards on USB, with what they say of themselves");
  verb->footer(
      "Exit code 1: there is a board that cannot be used; the table says why.\n\n"
      "Examples: tunnelrig devices --statistics\n"
      "          tunnelrig devices --serial 3A0042 --loader");
  verb->add_option("--serial", options->serial, "Only boards whose serial number starts so");
  verb->add_flag("--statistics", options->statistics, "Counters of each board, and faults it has survived");
  verb->add_flag("--json", options->json, "Print as JSON");
  verb->add_flag("--loader", options->loader,
                 "Restart the board in its ROM loader, to be flashed by dfu-util");
  verb->callback([options, &work] { work = [options] { return run_devices(*options); }; });
}

}  // namespace tunnelrig::cli
