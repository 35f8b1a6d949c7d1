"""Makes the campaigns that the tests of exports read back."""

import json
import pathlib
import sqlite3
import subprocess
import sys

import numpy as np

# A stored version of the model; creep of all rotors, as `explain --adopt` stores it (analysis/model/model_version.h).
MODEL = {
    "format": "tunnelrig-model/1",
    "version": 1,
    "parent": 0,
    "baseline": "thesis",
    "multiplicative": True,
    "dof": 17,
    "terms": [
        {
            "effect": "creep",
            "form": "",
            "rotor": None,
            "other": None,
            "theory": False,
            "parameters": {"amplitude": {"value": 0.01, "unit": "1"}, "time_constant": {"value": 100, "unit": "s"}},
            "reference": {"time_since_motor_start_s": 100},
        }
    ],
    "curves": [],
    "covariance": [[1e-6, 2e-5], [2e-5, 4.0]],
    "explanation": {},
}


def program(path, *arguments, expected=(0,), cwd=None):
    done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True, cwd=cwd)
    if done.returncode not in expected:
        raise SystemExit(f"tunnelrig {' '.join(map(str, arguments))}: exit code {done.returncode}\n{done.stderr}{done.stdout}")
    return done


def rig(tunnelrig, folder):
    """Recorded from the virtual rig with losses, a reboot and tares: before the calibration, and with all that follows it."""
    locations = "location\nOT\nH0V2\nH2V0\nH2V-2\nH4V1\nH4V-3\nOS\n"
    (folder / "locations.csv").write_text(locations)
    plan, early, late = folder / "plan.csv", folder / "uncalibrated.db", folder / "rig.db"
    program(tunnelrig, "plan", "--out", plan, "--locations", folder / "locations.csv", "--repeats", 2, "--duration", 2, "--anchor-every", 0)
    program(tunnelrig, "log", "--db", early, "--plan", plan, "--speed", "max", "--faults", "drop=0.02,reboot=1:0.1", expected=(0, 1))
    with sqlite3.connect(early) as db:
        db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    late.write_bytes(early.read_bytes())
    program(tunnelrig, "calibrate", "--db", late, expected=(0, 1))
    program(tunnelrig, "reduce", "--db", late, expected=(0, 1))
    with sqlite3.connect(late) as db:
        db.execute(
            "INSERT INTO documents (kind, created_utc, program_version, arguments, inputs, document) VALUES (?, ?, ?, ?, ?, ?)",
            ("model", "2026-03-02T08:00:00Z", "test", "tunnelrig explain --adopt", "{}", json.dumps(MODEL)),
        )


def odd(tunnelrig, folder):
    """Imported from a folder: every type of sample, names that no format takes as they are, gaps from the first frame on."""
    source = folder / "odd"
    (source / "raw").mkdir(parents=True)
    (source / "campaign.toml").write_text(
        'format = "tunnelrig-campaign/1"\nname = "Übung, größer"\n[rig]\npropeller_radius_m = 0.1524\nnominal_speed_rpm = 5000\n'
        "vehicle_width_m = 0.743\nvehicle_height_m = 0.30\n[tunnel]\nwidth_m = 1.5\nheight_m = 1.5\n"
    )
    points = [f"{cell},{force:.3f},{0.34 + 0.242 * force + 0.001 * ((7 * i + cell) % 5 - 2):.6f}" for cell in range(1, 5) for i, force in enumerate(np.linspace(5, 10, 8))]
    (source / "calibration.csv").write_text("cell,applied_force_N,voltage_V\n" + "\n".join(points) + "\n")
    rng = np.random.default_rng(20260302)
    types = {"a/b": "<i2", "run 1": "<u2", "RUN_1": "<f4", "run_1": "<f8", "größe": "<i2", "x" * 70: "<i2"}
    rows = ["run,location,repeat,session,start_utc,raw,air_temperature_C,Temp (°C),operator,run 2"]
    for i, (run, kind) in enumerate(types.items()):
        counts = rng.normal([2600, 2700, 2500, 2650], 30, (500 + i, 4))
        np.save(source / "raw" / f"{i}.npy", (counts if kind[1] in "iu" else counts * 3.3 / 4096).astype(kind))
        rows.append(f'{run},"{"OT" if i < 3 else "Ecke, links"}",{i},S1,2026-03-02T08:{i:02}:00Z,raw/{i}.npy,20,{"" if i == 1 else 20 + i},"Zoë, ""Z""",{i}')
    (source / "raw" / "0.gaps.csv").write_text("first_frame,frames_lost,cause\n0,7,lost\n100,3,reboot\n100,2,lost\n500,9,lost\n")
    (source / "raw" / "1.gaps.csv").write_text("first_frame,frames_lost\n250,6000000000\n")  # beyond 32 bits
    (source / "runs.csv").write_text("\n".join(rows) + "\n")
    program(tunnelrig, "import", source, "--db", folder / "odd.db")
    program(tunnelrig, "calibrate", "--db", folder / "odd.db", expected=(0, 1))


def thrusts(tunnelrig, folder):
    """Runs that give thrusts: nothing was recorded, nothing is to be calibrated."""
    source = folder / "thrusts"
    source.mkdir()
    toml = (folder / "odd" / "campaign.toml").read_text()
    (source / "campaign.toml").write_text(toml.replace("Übung, größer", "thrusts"))
    (source / "calibration.csv").write_text("cell,applied_force_N,voltage_V\n")
    rows = [f"R{i},{place},{i},S{i % 2},2026-03-02T08:{i:02}:00Z,,20,{7 + 0.01 * i},7.1,7.2,{7.3 - 0.01 * i}" for i, place in enumerate(["OT", "OS"] * 3)]
    (source / "runs.csv").write_text(
        "run,location,repeat,session,start_utc,raw,air_temperature_C,thrust_1_N,thrust_2_N,thrust_3_N,thrust_4_N\n" + "\n".join(rows) + "\n"
    )
    program(tunnelrig, "import", source, "--db", folder / "thrusts.db")


if __name__ == "__main__":
    where = pathlib.Path(sys.argv[2])
    subprocess.run(["rm", "-rf", where], check=True)
    where.mkdir(parents=True)
    rig(sys.argv[1], where)
    odd(sys.argv[1], where)
    thrusts(sys.argv[1], where)
