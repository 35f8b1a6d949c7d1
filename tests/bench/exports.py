"""Exports of the thesis's whole campaign, each beside `cat` of the bytes that it wrote: wall and processor seconds, since other work
on the machine stretches the former."""

import pathlib
import shutil
import statistics
import subprocess
import sys

import measure
import thesis_campaign

program, scratch = sys.argv[1], pathlib.Path(sys.argv[2])
TIMES = 3


def remove(path):
    shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def medians(once):
    """After one run that fills the caches."""
    once()
    runs = [once() for _ in range(TIMES)]
    return {key: statistics.median(run[key] for run in runs) for key in runs[0]}


def export(db, options, target):
    remove(target)
    return measure.run([program, "export", "--db", db, *options, target])


def cat(target, copy):
    """Of the same bytes into one file; the reading is from memory."""
    copy.unlink(missing_ok=True)
    files = sorted(path for path in target.rglob("*") if path.is_file()) if target.is_dir() else [target]
    with open(copy, "wb") as out:
        listed = scratch / "files"
        listed.write_bytes(b"\0".join(bytes(path) for path in files))
        return measure.run(["xargs", "-0", "-a", listed, "cat"], stdout=out)


source = thesis_campaign.logged(program, scratch)
db = scratch / "exports.db"
shutil.copy(source, db)
subprocess.run([program, "calibrate", "--db", db], check=True, stdout=subprocess.DEVNULL)
raw_MB = float(subprocess.run([program, "export", "--db", db, "--format", "npy", "--parts", "raw", scratch / "first"], check=True, capture_output=True, text=True).stdout.split()[-5])
remove(scratch / "first")
print(f"{raw_MB:.0f} MB of raw counts; goal: 200 MB of them a second, or the disk's own speed\n")
print(f"{'':<26} {'wall':>9} {'raw':>10} {'written':>11} {'written':>10} {'peak':>9} {'of cat':>8} {'processor':>10} {'of cat':>8}")
for form in ("npy", "hdf5", "mat", "csv", "folder"):
    for parts in ("raw", "all") if form != "folder" else ("all",):
        target = scratch / f"export.{form}"
        options = ["--format", form] + (["--parts", "raw"] if parts == "raw" else [])
        figures = medians(lambda: export(db, options, target))
        written_MB = sum(path.stat().st_size for path in ([target] if target.is_file() else target.rglob("*")) if path.is_file()) / 1e6
        yardstick = medians(lambda: cat(target, scratch / "copy"))
        name = f"{form}, {'raw only' if parts == 'raw' else 'everything'}"
        wall_s = figures["wall_s"]
        print(f"{name:<26} {wall_s:7.2f} s {raw_MB / wall_s:5.0f} MB/s {written_MB:8.0f} MB {written_MB / wall_s:5.0f} MB/s "
              f"{figures['peak_MB']:6.0f} MB {wall_s / yardstick['wall_s']:8.2f} "
              f"{figures['cpu_s']:8.2f} s {figures['cpu_s'] / yardstick['cpu_s']:8.2f}", flush=True)
        remove(target)
remove(scratch / "copy")
