"""What the logger costs while it records the rig in real time."""

import pathlib
import sys

import measure

program, scratch = sys.argv[1], pathlib.Path(sys.argv[2])
db = scratch / "rate.db"
SECONDS = 30
for suffix in ("", "-wal", "-shm"):
    pathlib.Path(f"{db}{suffix}").unlink(missing_ok=True)
used = measure.run([program, "log", "--db", db, "--location", "OT", "--session", "S1", "--duration", str(SECONDS), "--speed", "1"])
print(f"\nlogger at rig speed, {SECONDS} s with the virtual rig in the same process: "
      f"{100 * used['cpu_s'] / used['wall_s']:.2f} % of a core (goal: under 2 %), {used['peak_MB']:.1f} MB")
