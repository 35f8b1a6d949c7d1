"""The thesis's whole campaign: 430 runs of 60 s. Every figure stands beside its yardstick from the same minute."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import measure
import thesis_campaign

program, scratch, rig = sys.argv[1], pathlib.Path(sys.argv[2]), os.path.abspath(sys.argv[3])
folder, db = (scratch / name for name in ("campaign", "campaign.db"))
here = pathlib.Path(__file__).parent


def make():
    """Logs the campaign on the virtual rig and exports it, once."""
    if folder.exists():
        return
    log_db = thesis_campaign.logged(program, scratch)
    subprocess.run([program, "export", "--db", log_db, folder], check=True, stdout=subprocess.DEVNULL)


def row(name, figures, yardstick=None, text=""):
    ratio = f"{figures['wall_s'] / yardstick['wall_s']:8.3f}" if yardstick else "        "
    print(f"{name:<34} {figures['wall_s'] * 1e3:9.1f} ms {figures['peak_MB']:7.1f} MB  {ratio}  {text}")


make()
raw = sorted((folder / "raw").glob("*.npy"))
size_MB = sum(path.stat().st_size for path in raw) / 1e6
print(f"{len(raw)} runs, {size_MB:.0f} MB of raw data\n")
print(f"{'':<34} {'wall':>12} {'peak':>10}  {'ratio':>8}")

cat = measure.repeat(["cat"] + raw)
row("cat of the .npy files", cat)
numpy = measure.repeat(["/usr/bin/python3", here / "numpy_yardstick.py", folder / "raw"])
row("NumPy: load, mean, std", numpy)

imported = measure.repeat([program, "import", folder, "--db", db, "--replace"], times=3)
row("import", imported, cat, f"of cat; {size_MB / imported['wall_s']:.0f} MB/s")
copy = measure.repeat(["dd", f"if={db}", f"of={scratch / 'copy'}", "bs=1M", "conv=fsync", "status=none"], times=3)
row("the same bytes by dd conv=fsync", copy, None, f"{db.stat().st_size / 1e6 / copy['wall_s']:.0f} MB/s")
subprocess.run([program, "calibrate", "--db", db], check=True, stdout=subprocess.DEVNULL)

reduce = [program, "reduce", "--db", db]
row("reduce", measure.repeat(reduce), None, "goal: under 100 ms")
quick = measure.repeat(reduce + ["--from-raw", "--no-spectra"])
row("reduce --from-raw --no-spectra", quick, numpy, f"of NumPy (goal 0.2); {quick['wall_s'] / cat['wall_s']:.1f} of cat (aim 3)")
full = measure.repeat(reduce + ["--from-raw"])
row("reduce --from-raw, with spectra", full, numpy, f"of NumPy; {full['wall_s'] / cat['wall_s']:.1f} of cat")

version = measure.repeat([program, "--version"], times=21)
launched = measure.repeat([rig, "--version"], times=21)
row("tunnelrig --version", version)
row("./rig --version", launched, None, f"adds {(launched['wall_s'] - version['wall_s']) * 1e3:.1f} ms (goal: at most 50)")
(scratch / "copy").unlink()
