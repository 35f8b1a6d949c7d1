"""cycles.py IMAGE.elf [--recursion]: upper bounds of what the firmware's work costs, counted in the disassembly.

Every instruction of a function counts, both sides of every branch, times the bounds of the loops that it stands in; calls
add their callee. Costs are those of the Cortex-M4 (ARM DDI 0439, table 3-1) with the most for a taken branch. Flash has 5
wait states and in front of it the ART accelerator, 1 KiB, which holds each of our loops: a jump pays for a refill once in
each call of its function, not in every turn of a loop. Bounds cannot be read off the code: they stand below, for the backward
jumps of a function in the order of addresses (what is not named is layout, not a loop). Where the number of these jumps is
another one than here, this program fails, and somebody has to look again. With --recursion it only says whether any
function of ours can call itself."""

import re
import subprocess
import sys

CPU_HZ = 168e6
RATE_HZ = 4000 / 3
FLASH_REFILL = 6

# function: (how many backward jumps it has, {which of them: bound})
FRAMES, WORDS, USB_PACKETS = 16, 16, 4


def bounds(conversions, priming):
    return {
        "on_sampling": (2, {}),
        "sampling_take": (0, {}),
        "board_on_scans": (5, {0: 4 * conversions, 1: 4}),  # clipped(), and the shifts of clipped_in_filter()
        # store: 4 channels, 8 scans; the same for all 12 blocks when it is primed; then 4 channels, 12 blocks, 4 roundings
        "decimator_step": (8, {0: 4, 1: 8, 2: 4, 3: 8, 4: 12 * priming, 5: 4, 6: 12, 7: 4}),
        # consecutive(); samples and frames of trw_put_frame; bytes of the checksum
        "board_next_packet": (7, {0: FRAMES, 3: 4, 4: FRAMES, 5: 40 + 10 * FRAMES}),
        "send": (1, {}),
        # the FIFO: last bytes, words, packets
        "otg_fs_interrupt": (25, {12: 3, 13: WORDS, 14: USB_PACKETS}),
    }


# Calls on the error path only: a converter overrun, which the manual's cure makes slow and which no frame depends on.
ERROR_PATH = {"start_anew", "board_frames_missed", "board_on_adc_error", "ticks", "__aeabi_uldivmod"}
EXCEPTION = 12 + 12 + 2 * FLASH_REFILL  # entry and return


def functions(image):
    text = subprocess.run(["arm-none-eabi-objdump", "-d", "--no-show-raw-insn", image], check=True, capture_output=True, text=True).stdout
    found, name = {}, None
    for line in text.splitlines():
        if head := re.match(r"[0-9a-f]+ <(.+)>:$", line):
            name = head[1]
            found[name] = []
        elif name and (item := re.match(r" *([0-9a-f]+):\t(\S+)(?:\t(.*))?", line)):
            if not item[2].startswith("."):
                found[name].append((int(item[1], 16), item[2], (item[3] or "").split("@")[0].strip()))
    return found


def cost(mnemonic, operands):
    """Cycles each time, and once more for a refill from flash."""
    base = mnemonic.split(".")[0]
    registers = operands[operands.find("{") :].count(",") + 1 if "{" in operands else 0
    if base in ("bl", "blx", "bx", "cbz", "cbnz") or re.fullmatch(r"b(eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le|al)?", base):
        return 4, FLASH_REFILL
    if base.startswith(("ldm", "pop")):
        return 1 + registers + (4 if "pc" in operands else 0), FLASH_REFILL if "pc" in operands else 0
    if base.startswith(("stm", "push")):
        return 1 + registers, 0
    if base.startswith(("ldrd", "strd")):
        return 3, 0
    if base.startswith(("ldr", "str")):
        return 2, 0
    if base.startswith(("udiv", "sdiv")):
        return 12, 0
    if base.startswith(("mla", "mls", "dsb", "isb")):
        return 2, 0
    return 1, 0


class Counter:
    def __init__(self, found):
        self.found = found

    def loops(self, name):
        addresses = {a for a, _, _ in self.found[name]}
        loops = []
        for address, mnemonic, operands in self.found[name]:
            target = re.search(r"\b([0-9a-f]{7,8}) <", operands)
            if mnemonic.startswith(("b", "cb")) and not mnemonic.startswith(("bl", "bx", "bic", "bf")) and target:
                if int(target[1], 16) <= address and int(target[1], 16) in addresses:
                    loops.append((int(target[1], 16), address))
        return loops

    def count(self, name, bounds_of, skip=()):
        loops = self.loops(name)
        expected, bound_of = bounds_of.get(name, (0, {}))
        if len(loops) != expected:
            raise SystemExit(f"cycles.py: {name} has {len(loops)} backward jumps, {expected} are known: look at the disassembly again")
        total = 0
        for address, mnemonic, operands in self.found[name]:
            times = 1
            for number, (first, last) in enumerate(loops):
                if first <= address <= last:
                    times *= bound_of.get(number, 1)
            once, refill = cost(mnemonic, operands)
            total += times * once + refill
            callee = re.search(r"<([^+>]+)>", operands)
            if mnemonic.startswith("b") and callee and callee[1] in self.found and callee[1] != name and callee[1] not in skip:
                total += times * self.count(callee[1], bounds_of, skip)
        return total


def recursive(found):
    """Functions from which direct calls lead back to themselves. (Calls through the tables of controller, port and application
    go downwards only: a controller's function calls nobody.)"""
    calls = {name: set() for name in found}
    for name, code in found.items():
        for _, mnemonic, operands in code:
            callee = re.search(r"<([^+>]+)>", operands)
            jump_to_own_start = callee and callee[1] == name and not mnemonic.startswith("bl")
            if mnemonic.startswith("b") and callee and callee[1] in found and not jump_to_own_start:
                calls[name].add(callee[1])

    def reachable(start):
        seen, todo = set(), list(calls[start])
        while todo:
            name = todo.pop()
            if name not in seen:
                seen.add(name)
                todo += calls[name]
        return seen

    return [name for name in found if name in reachable(name)]


def main():
    counter = Counter(functions(sys.argv[1]))
    if "--recursion" in sys.argv:
        found = recursive(counter.found)
        print("recursion:", ", ".join(found) or "none")
        raise SystemExit(1 if found else 0)

    def sampling(conversions, priming=0, skip=frozenset()):
        return counter.count("on_sampling", bounds(conversions, priming), ERROR_PATH | skip) + EXCEPTION

    plain, filtered, first = sampling(1, skip={"decimator_step"}), sampling(8), sampling(8, 1)
    packet = counter.count("board_next_packet", bounds(1, 0))
    no_control = {"usb_on_reset", "usb_on_setup", "usb_on_received", "abort_in"}
    transfer = counter.count("send", bounds(1, 0)) + 3 * (counter.count("otg_fs_interrupt", bounds(1, 0), no_control) + EXCEPTION)
    tick = 1000  # the tick, and a turn of the main loop that finds nothing to send: about 300 instructions

    def row(what, cycles, rate_hz):
        print(f"{what:<46}{cycles:6d} cycles {cycles / 168:6.1f} us {100 * cycles * rate_hz / CPU_HZ:6.2f} % of the processor")
        return 100 * cycles * rate_hz / CPU_HZ

    print("firmware, upper bounds from the disassembly, 168 MHz, 1333.3 frames/s")
    a = row("sampling interrupt, 1 conversion per frame", plain, RATE_HZ)
    b = row("sampling interrupt, 8 conversions and filter", filtered, RATE_HZ)
    row("the same, first frame after a start (the worst)", first, 0)
    c = row("a packet of 16 frames with its checksum", packet, RATE_HZ / FRAMES)
    d = row("its transfer: three USB interrupts", transfer, RATE_HZ / FRAMES)
    e = row("tick and idle turn of the main loop (estimate)", tick, 1000 + RATE_HZ)
    print(f"together: {a + c + d + e:.1f} % plain, {b + c + d + e:.1f} % with the filter")


main()
