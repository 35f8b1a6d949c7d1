"""The thesis's whole campaign, recorded on the virtual rig once: 430 runs of 60 s."""

import subprocess

import measure


def logged(program, scratch):
    """The campaign file, made where it is missing."""
    db, new, plan = scratch / "log.db", scratch / "new.db", scratch / "plan.csv"
    if db.exists():
        return db
    locations = scratch / "locations.csv"
    labels = [f"H{h}V{v}" if (h, v) != (0, 0) else "OT" for h in range(6) for v in range(-3, 4)] + ["OS"]
    locations.write_text("location\n" + "\n".join(labels) + "\n")
    for path in (new, plan):
        path.unlink(missing_ok=True)
    subprocess.run([program, "plan", "--out", plan, "--locations", locations, "--anchor-every", "0"], check=True, stdout=subprocess.DEVNULL)
    figures = measure.run([program, "log", "--db", new, "--plan", plan, "--speed", "max"])
    print(f"logged on the virtual rig at max speed in {figures['wall_s']:.1f} s")
    new.rename(db)
    return db
