"""Reads exports back with h5py, scipy.io, NumPy and csv, and compares them to the campaign file.

read_back.py PROGRAM CAMPAIGNS CASE: exit code 77 where Python lacks the reader.
"""

import importlib
import json
import os
import pathlib
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import readers

PROGRAM, CAMPAIGNS, CASE = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).absolute(), sys.argv[3]
NEEDS = {"hdf5": ["h5py"], "mat": ["scipy.io"]}


def export(db, form, target, *options, **how):
    command = [PROGRAM, "export", "--db", db, "--format", form, target, *options]
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, **how)


class Store:
    """The campaign file, read as docs/campaign-file.md says."""

    def __init__(self, path):
        self.db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)

    def document(self, kind):
        row = self.db.execute("SELECT document FROM documents WHERE kind = ? ORDER BY id DESC", (kind,)).fetchone()
        return row and json.loads(row[0])

    def sheet(self, name):
        columns = json.loads(self.db.execute("SELECT columns FROM sheets WHERE sheet = ?", (name,)).fetchone()[0])
        rows = self.db.execute("SELECT cells FROM sheet_rows WHERE sheet = ? ORDER BY row", (name,))
        return [dict(zip(columns, json.loads(cells))) for cells, in rows]

    def recordings(self):
        """{run: (samples, frame numbers, gaps)}"""
        out = {}
        for run, name, kind, channels in self.db.execute("SELECT id, run, sample_type, channels FROM raw_runs"):
            between = (run << 32, (run << 32) + 2**32 - 1)
            blobs = self.db.execute("SELECT data FROM raw_chunks WHERE id BETWEEN ? AND ? ORDER BY id", between)
            samples = np.frombuffer(b"".join(data for data, in blobs), kind).reshape(-1, channels)
            gaps = self.db.execute("SELECT first_frame, frames_lost, cause, estimated FROM gaps WHERE raw_run = ? ORDER BY id", (run,)).fetchall()
            frame = np.arange(len(samples), dtype=np.uint64)
            for first, lost, _, _ in gaps:
                frame[first:] += np.uint64(lost)
            out[name] = (samples, frame, gaps)
        return out


class Case(unittest.TestCase):
    def setUp(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.addCleanup(self.scratch.cleanup)
        self.here = pathlib.Path(self.scratch.name)

    def exported(self, db, form, *options):
        target = self.here / f"{pathlib.Path(db).stem}.{form}"
        done = export(CAMPAIGNS / db, form, target, *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return readers.READERS[form](target), done.stdout

    def same(self, got, wanted, text=""):
        np.testing.assert_array_equal(np.asarray(got, float), np.asarray(wanted, float), text)


class ReadBack(Case):
    """One format against the store."""

    def check_series(self, out, db):
        store, daq = Store(CAMPAIGNS / db), out["tables"]["campaign"]
        recordings = store.recordings()
        self.assertEqual({r["run"] for r in out["raw"].values()}, set(recordings))
        certificate = store.document("calibration")
        for key, recording in out["raw"].items():
            self.assertRegex(key, r"^[A-Za-z][A-Za-z0-9_]{0,54}$")
            samples, frame, _ = recordings[recording["run"]]
            name, volts = ("voltage_V", 1) if samples.dtype.kind == "f" else ("counts", daq["volts_per_count"][1][0])
            unit, got = recording["series"][name]
            self.assertEqual(unit, "V" if name == "voltage_V" else "1")
            if CASE != "csv":
                self.assertEqual(got.dtype.newbyteorder("="), samples.dtype, key)
            self.same(got.astype(samples.dtype), samples, key)
            unit, got = recording["series"]["frame"]
            self.assertEqual(unit, "1")
            self.same(got, frame, "lost frames stay lost")
            if certificate is None:
                self.assertNotIn("thrust_N", recording["series"])
                continue
            unit, thrust = recording["series"]["thrust_N"]
            self.assertEqual((unit, thrust.shape), ("N", (len(samples), 4)))
            for rotor, cell in enumerate(certificate["cells"]):
                factor = certificate["propellers"]["factor"][rotor]
                slope, zero = np.polyfit(samples[:, rotor].astype(float), thrust[:, rotor].astype(float), 1)
                self.assertAlmostEqual(slope * cell["gain_V_per_N"] * factor / volts, 1, delta=1e-5)

    def check_lost_frames(self, out, db):
        table = out["tables"]["lost_frames"]
        got = list(zip(*(table[c][1] for c in ("run", "frame", "frames_lost", "row", "cause", "estimated"))))
        wanted = []
        for run, (_, _, gaps) in Store(CAMPAIGNS / db).recordings().items():
            before = 0
            for first, lost, cause, estimated in gaps:
                wanted.append((run, first + before, lost, first, cause, estimated))
                before += lost
        self.assertGreater(len(wanted), 3)
        self.assertEqual([(str(g[0]), *map(int, g[1:4]), "" if str(g[4]) == "nan" else str(g[4]), int(g[5])) for g in got], wanted)

    def check_runs(self, out, db):
        table, sheet = out["tables"]["runs"], Store(CAMPAIGNS / db).sheet("runs")
        self.assertEqual(list(table["run"][1]), [row["run"] for row in sheet])
        self.assertEqual(list(table["location"][1]), [row["location"] for row in sheet])
        self.same(table["repeat"][1], [row["repeat"] for row in sheet])
        self.same(table["air_temperature_C"][1], [row["air_temperature_C"] for row in sheet])
        self.assertEqual(table["air_temperature_C"][0], "degC")
        return table, sheet

    def check_dictionary(self, out):
        """Every column is explained, with the unit that it carries, and nothing else is."""
        table = out["tables"]["columns"]
        said = {(t, c): u for t, c, u in zip(*(map(str, table[n][1]) for n in ("table", "column", "unit")))}
        there = {(t, c): u for part in ("tables", "groups") for t, columns in out[part].items() if t != "columns" for c, (u, _) in columns.items()}
        there.update({("raw", c): u for recording in out["raw"].values() for c, (u, _) in recording["series"].items()})
        self.assertEqual({k: "" if u == "nan" else u for k, u in said.items()}, there)
        for (_, column), unit in there.items():
            for ending, name in (("_N", "N"), ("_V", "V"), ("_rpm", "rpm"), ("_percent", "%"), ("_s", "s"), ("_hz", "Hz")):
                if column.endswith(ending) and "_per_" not in column:
                    self.assertEqual(unit, name, column)

    def test_rig(self):
        out, said = self.exported("rig.db", CASE)
        self.assertNotIn("without", said)
        self.check_series(out, "rig.db")
        self.check_lost_frames(out, "rig.db")
        self.check_runs(out, "rig.db")
        self.check_dictionary(out)
        self.check_models(out)
        self.assertEqual(out["provenance"]["format"], "tunnelrig-export/1")
        self.assertEqual(out["provenance"]["model"], "version 1 (creep)")
        self.assertIn("--format " + CASE, out["provenance"]["arguments"])
        toml = Store(CAMPAIGNS / "rig.db").db.execute("SELECT text FROM texts").fetchone()[0]
        self.assertEqual(out["texts"]["campaign"], toml)
        # U comes from forces: rotors 1 and 4 are on the right
        t = out["tables"]["run_coefficients"]
        thrust = np.array([t[f"thrust_{i}_N"][1] for i in range(1, 5)])
        np.testing.assert_allclose(t["u_percent"][1], 100 * (thrust[0] - thrust[1] - thrust[2] + thrust[3]) / thrust.sum(0), rtol=1e-9)

    def check_models(self, out):
        certificate, model = Store(CAMPAIGNS / "rig.db").document("calibration"), Store(CAMPAIGNS / "rig.db").document("model")
        cells, points = out["tables"]["calibration_cells"], out["tables"]["calibration_points"]
        self.assertEqual(cells["gain_V_per_N"][0], "V/N")
        for name in ("zero_V", "gain_V_per_N", "dof", "correlation"):
            self.same(cells[name][1], [cell[name] for cell in certificate["cells"]], name)
        self.same(cells["gain_variance_V2_per_N2"][1], [cell["covariance"][1][1] for cell in certificate["cells"]])
        self.same(cells["propeller_factor"][1], certificate["propellers"]["factor"])
        for name in ("force_N", "voltage_V", "residual_N", "weight", "suspicious"):
            self.same(points[name][1], [point[name] for cell in certificate["cells"] for point in cell["points"]], name)
        parameters = out["tables"]["model_parameters"]
        wanted = model["terms"][0]["parameters"]
        self.assertEqual(list(parameters["parameter"][1]), list(wanted))
        self.assertEqual([str(u) if str(u) != "1.0" else "1" for u in parameters["unit"][1]], [p["unit"] for p in wanted.values()])
        self.same(parameters["value"][1], [p["value"] for p in wanted.values()])
        np.testing.assert_allclose(parameters["standard_uncertainty"][1], np.sqrt(np.diag(model["covariance"])), rtol=1e-12)
        self.same(out["groups"]["model_covariance"]["version_1"][1], model["covariance"])

    def test_coefficients_and_maps_are_those_of_reduce_and_map(self):
        out, _ = self.exported("rig.db", CASE, "--model", "thesis", "--parts", "thrusts,coefficients,maps")
        self.check_dictionary(out)
        copy = self.here / "copy.db"
        copy.write_bytes((CAMPAIGNS / "rig.db").read_bytes())
        reduce = subprocess.run([PROGRAM, "reduce", "--db", copy, "--model", "thesis", "--json"], capture_output=True, text=True)
        locations, table = json.loads(reduce.stdout)["locations"], out["tables"]["locations"]
        self.assertEqual(list(table["location"][1]), [l["location"] for l in locations])
        for name in ("std", "standard_uncertainty", "dof", "u95"):
            self.same(table[f"c_t_{name}"][1], [l["c_t"][name] for l in locations], name)
        self.same(table["c_t"][1], [l["c_t"]["mean"] for l in locations])
        self.same(table["u_percent"][1], [l["u_percent"]["mean"] for l in locations])
        self.same(table["u_u95_percent"][1], [l["u_percent"]["u95"] for l in locations])
        self.same(table["c_t_u_calibration"][1], [l["c_t_budget"]["calibration"] for l in locations])
        np.testing.assert_allclose(np.sqrt(np.diag(out["groups"]["covariance"]["c_t"][1])), table["c_t_standard_uncertainty"][1], rtol=1e-6)
        # the mean of a calibrated series is the run's thrust
        runs = out["tables"]["run_coefficients"]
        mean = {r["run"]: r["series"]["thrust_N"][1].astype(float).mean(0) for r in out["raw"].values()}
        for i, run in enumerate(runs["run"][1]):
            np.testing.assert_allclose(mean[run], [runs[f"thrust_{k}_N"][1][i] for k in range(1, 5)], rtol=1e-6)
        self.assertNotIn("counts", next(iter(out["raw"].values()))["series"])
        subprocess.run([PROGRAM, "map", "--db", copy, "--model", "thesis", "--out", self.here / "maps"], check=True, capture_output=True)
        wanted, got = json.loads((self.here / "maps" / "disturbance_map.json").read_text()), out["groups"]["map"]
        self.same(got["y_norm"][1], wanted["y_norm"])
        self.same(got["z_norm"][1], wanted["z_norm"])
        for name in ("delta_ct", "uneven_thrust"):
            for layer in ("", "_u95"):
                unit, values = got[f"{name}{layer}_percent"]
                self.assertEqual((unit, values.shape), ("%", (41, 41)))
                self.same(values, wanted[f"{name}{layer}_percent"], name + layer)
        self.assertFalse(np.array_equal(got["delta_ct_percent"][1], got["delta_ct_percent"][1].T), "rows and columns are told apart")

    def test_before_the_calibration(self):
        target = self.here / "early"
        done = export(CAMPAIGNS / "uncalibrated.db", CASE, target)
        self.assertEqual(done.returncode, 0, done.stderr)
        for part in ("thrusts", "calibration", "coefficients", "maps"):
            self.assertRegex(done.stdout, f"without {part}: there is no calibration yet")
        out = readers.READERS[CASE](target)
        self.check_series(out, "uncalibrated.db")
        self.check_dictionary(out)
        self.assertEqual(export(CAMPAIGNS / "uncalibrated.db", CASE, self.here / "b", "--parts", "maps").returncode, 1, "asked for by name")

    def test_a_run_that_is_being_recorded_and_one_without_frames(self):
        db = self.here / "busy.db"
        db.write_bytes((CAMPAIGNS / "rig.db").read_bytes())
        with sqlite3.connect(db) as file:
            file.execute("UPDATE raw_runs SET state = 'recording', hash = '' WHERE run = 'R0003'")
            file.execute("UPDATE raw_runs SET state = 'partial', frames = 0 WHERE run = 'R0005'")
            file.execute("DELETE FROM raw_chunks WHERE id >> 32 = (SELECT id FROM raw_runs WHERE run = 'R0005')")
        out, said = self.exported(db, CASE)
        self.assertIn("without the frames of run R0003: it is being recorded", said)
        self.assertNotIn("R0003", out["raw"])
        self.assertEqual(len(out["raw"]["R0005"]["series"]["frame"][1]), 0)
        table = out["tables"]["recordings"]
        keys = dict(zip(table["run"][1], table["key"][1]))
        self.assertEqual((keys["R0002"], keys["R0003"]), ("R0002", ""))

    def test_runs_that_give_thrusts(self):
        out, said = self.exported("thrusts.db", CASE)
        for part in ("raw", "thrusts", "calibration"):
            self.assertIn(f"without {part}: the runs give thrusts, not voltages", said)
        self.assertEqual(out["raw"], {})
        self.assertEqual(len(out["tables"]["recordings"]["run"][1]), 0)
        given = np.array([[float(row[f"thrust_{k}_N"]) for k in range(1, 5)] for row in Store(CAMPAIGNS / "thrusts.db").sheet("runs")])
        self.same(np.transpose([out["tables"]["run_coefficients"][f"thrust_{k}_N"][1] for k in range(1, 5)]), given)
        noise = [name for name in out["tables"]["run_coefficients"] if "standard_error" in name]
        self.assertEqual(len(noise), 6)
        for name in noise:
            self.assertTrue(np.isnan(out["tables"]["run_coefficients"][name][1]).all(), name)
        self.check_dictionary(out)

    def test_types_names_and_gaps_of_any_kind(self):
        out, said = self.exported("odd.db", CASE)
        self.assertIn("without maps: ", said)
        self.check_series(out, "odd.db")
        self.check_lost_frames(out, "odd.db")
        self.check_dictionary(out)
        table, sheet = self.check_runs(out, "odd.db")
        keys = {r["run"]: key for key, r in out["raw"].items()}
        self.assertEqual(keys["run_1"].lower(), "run_1_2", "RUN_1 came first, and not every disk tells capitals apart")
        self.assertEqual(keys["RUN_1"], "RUN_1")
        self.assertEqual(len({key.lower() for key in keys.values()}), 6)
        self.same(table["Temp___C_"][1] if "Temp___C_" in table else table["Temp____C_"][1], [float(r["Temp (°C)"] or "nan") for r in sheet])
        self.assertEqual(set(table["operator"][1]), {'Zoë, "Z"'})
        self.assertEqual(out["provenance"]["campaign"], "Übung, größer")
        self.assertEqual({str(v) for v in out["tables"]["runs"]["key"][1]}, set(out["raw"]))


class Refusals(Case):
    """Bad targets, a full disk, a kill: nothing half-written, and the campaign file as it was."""

    def refused(self, form, target, message, **how):
        before = sorted(self.here.rglob("*"))
        done = export(self.db, form, target, **how)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn(message, done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertEqual(sorted(self.here.rglob("*")), before)
        self.assertEqual(self.db.read_bytes(), self.bytes)

    def setUp(self):
        super().setUp()
        self.db = self.here / "c.db"
        self.db.write_bytes((CAMPAIGNS / "rig.db").read_bytes())
        self.bytes = self.db.read_bytes()

    def test_targets(self):
        (self.here / "full").mkdir()
        (self.here / "full" / "precious").write_text("mine")
        (self.here / "there").write_text("mine")
        (self.here / "nowhere").symlink_to(self.here / "gone")
        for form in ("hdf5", "mat", "csv", "npy"):
            self.refused(form, self.db, "is the campaign file itself")
            self.refused(form, self.here / "c.db-wal", "is the campaign file itself, or one that belongs to it")
            self.refused(form, "c.db", "is the campaign file itself", cwd=self.here)
            for target in ("full", "there", "nowhere"):
                self.refused(form, self.here / target, "export never overwrites")
        self.refused("folder", self.db, "never overwrites")
        self.refused("hdf5", self.here / "no" / "such.h5", "there is no folder")
        self.refused("mat", self.here / "full" / "", "export never overwrites")
        self.refused("xlsx", self.here / "a", "'xlsx' is no format of an export; write folder, hdf5, mat, csv or npy")
        self.assertEqual(export(self.db, "csv", self.here / "a", "--parts", "raw,moon").returncode, 2)
        self.assertEqual(export(self.db, "folder", self.here / "a", "--parts", "raw").returncode, 2)
        self.assertEqual((self.here / "there").read_text(), "mine")

    def test_an_empty_folder_and_a_slash_behind_the_name(self):
        (self.here / "empty").mkdir()
        for form, target in (("csv", "empty/"), ("npy", "new/"), ("folder", "newer/")):
            done = export(self.db, form, target, cwd=self.here)
            self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(sorted(p.name for p in self.here.iterdir()), ["c.db", "empty", "new", "newer"])

    def test_full_disk(self):
        """The kernel refuses to write beyond 100 kB of a file, as it would on a disk without room."""

        def little_room():
            resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

        for form in ("hdf5", "mat", "csv"):
            done = export(self.db, form, self.here / "out", preexec_fn=little_room)
            self.assertEqual(done.returncode, 2, f"{form}: {done.stderr}")
            self.assertRegex(done.stderr, r"out\S*: cannot be written")
            self.assertNotIn(".part", done.stderr)
            self.assertEqual([p.name for p in self.here.iterdir()], ["c.db"], form)

    def test_killed(self):
        for form in ("hdf5", "mat", "csv", "npy"):
            target = self.here / f"out.{form}"
            process = subprocess.Popen([PROGRAM, "export", "--db", self.db, "--format", form, target], stdout=subprocess.DEVNULL)
            while not list(self.here.glob(f"out.{form}.*.part")) and process.poll() is None:
                pass
            process.kill()
            if process.wait() == -signal.SIGKILL:
                self.assertFalse(target.exists())
            self.assertEqual(export(self.db, form, self.here / f"again.{form}").returncode, 0)

    def test_damaged_raw_data(self):
        with sqlite3.connect(self.db) as db:
            db.execute("UPDATE raw_chunks SET data = zeroblob(length(data)) WHERE id = (SELECT max(id) FROM raw_chunks)")
        done = export(self.db, "hdf5", self.here / "out.h5")
        self.assertEqual(done.returncode, 1)
        self.assertIn("damaged", done.stderr)
        self.assertFalse((self.here / "out.h5").exists())


class Octave(Case):
    """The example of docs/exports.md as it stands there. That for Python is run with the other documents."""

    def test_draws_a_map(self):
        self.assertEqual(export(CAMPAIGNS / "rig.db", "mat", self.here / "my.mat").returncode, 0)
        page = (pathlib.Path(__file__).parents[2] / "docs" / "exports.md").read_text()
        part = page.split("## A map in Octave or MATLAB\n")[1].split("\n## ")[0]
        script = [line[4:] for line in part.splitlines() if line.startswith("    ")]
        self.assertLessEqual(len(script), 12)
        (self.here / "example.m").write_text("\n".join(script) + "\n")
        subprocess.run(["octave-cli", "--no-gui", "example.m"], cwd=self.here)
        picture = (self.here / "map.png").read_bytes()
        self.assertTrue(picture.startswith(b"\x89PNG") and len(picture) > 10_000)


def lacking():
    """What this case needs and the machine has not; empty where it has all."""
    if CASE == "octave":
        return "" if all(shutil.which(program) for program in ("octave-cli", "gs", "gnuplot")) else "octave-cli with gs and gnuplot"
    for module in NEEDS.get(CASE, ["numpy"]):
        try:
            importlib.import_module(module)
        except ImportError:
            return f"Python's {module}"
    return ""


def main():
    if missing := lacking():
        print(f"skipped: {missing} is not installed here")
        return 77
    cases = {"refusals": Refusals, "octave": Octave}.get(CASE, ReadBack)
    suite = unittest.defaultTestLoader.loadTestsFromTestCase(cases)
    return 0 if unittest.TextTestRunner(verbosity=2).run(suite).wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
