"""Runs commands and says how long they took and how much memory they used, as the kernel accounts for them."""

import os
import statistics
import subprocess
import time


def run(command, **options):
    """One run: wall and processor seconds and peak memory in MB of a command (its children included)."""
    start = time.perf_counter()
    with open(os.devnull, "wb") as nothing:
        process = subprocess.Popen(command, stdout=options.get("stdout", nothing), stderr=nothing, cwd=options.get("cwd"))
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in options.get("expected", (0,)):
        raise SystemExit(f"{' '.join(map(str, command))}: exit code {process.returncode}")
    return {
        "wall_s": time.perf_counter() - start,
        "cpu_s": usage.ru_utime + usage.ru_stime,
        "peak_MB": usage.ru_maxrss / 1024,
    }


def repeat(command, times=5, **options):
    """Medians over some runs, after one that is not counted and fills the caches."""
    run(command, **options)
    runs = [run(command, **options) for _ in range(times)]
    return {key: statistics.median(one[key] for one in runs) for key in runs[0]}
