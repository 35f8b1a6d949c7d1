"""The closed loop on measurements of other rigs: error on rows held out, before and after, beside the goals.

Every table of the shared data goes through the built program as a user's would: written as a CSV with a schema, imported,
explained. Nothing here names an effect to the program. Data: TUNNELRIG_SHARED_DATA, or shared/data beside the checkout.
"""

import argparse
import collections
import concurrent.futures
import csv
import json
import math
import os
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile

SKIPPED = 77
ALL, SECOND, LOW = "a quarter of the rows", "every second", "trained on the lowest 70 % of speeds"


class Table:
    """Rows of one table, and what its schema says of them."""

    def __init__(self, name, rows, response, groups, blocks="rows", hold_out="", covariates=(), more="", arguments=()):
        self.name, self.rows, self.response, self.groups, self.blocks = name, rows, response, groups, blocks
        self.hold_out, self.covariates, self.more, self.arguments = hold_out, covariates, more, list(arguments)

    def schema(self):
        def column(kind, name, unit, meaning):
            return f'{kind}\ncolumn = "{name}"\nunit = "{unit}"\n' + (f'meaning = "{meaning}"\n' if meaning else "")
        groups = ", ".join(f'"{group}"' for group in self.groups)
        text = f'format = "tunnelrig-table/1"\nname = "{self.name}"\ngroups = [{groups}]\nblocks = "{self.blocks}"\n'
        if self.hold_out:
            text += f'hold_out = "{self.hold_out}"\n'
        text += column("[response]", *self.response) + self.more
        return text + "".join(column("[[covariates]]", *covariate) for covariate in self.covariates)

    def write(self, folder, name):
        with open(folder / name, "w", encoding="utf-8", newline="") as out:
            writer = csv.DictWriter(out, list(self.rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)
        (folder / "schema.toml").write_text(self.schema(), encoding="utf-8")


class Loop:
    def __init__(self, program, jobs):
        self.program, self.jobs = program, jobs

    def run(self, folder, *arguments):
        done = subprocess.run([str(self.program), *arguments], cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise SystemExit(f"tunnelrig {' '.join(arguments)}: exit code {done.returncode}: {done.stderr.strip()[-500:]}")

    def explain(self, table, *more):
        with tempfile.TemporaryDirectory(prefix="measured.") as name:
            folder = pathlib.Path(name)
            table.write(folder, "table.csv")
            self.run(folder, "import", "table.csv", "--format", "table", "--schema", "schema.toml", "--db", "t.db")
            self.run(folder, "explain", "--db", "t.db", "--json", "e.json", *table.arguments, *more)
            return json.loads((folder / "e.json").read_text(encoding="utf-8"))

    def explain_all(self, tables, *more):
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(lambda table: self.explain(table, *more), tables))


# --- figures ----------------------------------------------------------------------------------------------------------

def share_of(mean):
    """Errors as percentages of a mean response."""
    return lambda error: 100 * error / mean


def counted(words, most=3):
    if not words:
        return "–"
    return ", ".join(word if count == 1 and len(words) == 1 else f"{word} {count}"
                     for word, count in collections.Counter(words).most_common(most))


def names(explanations):
    return [adopted["effect"] + (f" ({adopted['form']})" if adopted["form"] and len(explanations) == 1 else "")
            for e in explanations for adopted in e["adopted"]]


def rivals(explanations):
    return [rival for e in explanations for adopted in e["adopted"] for rival in adopted["confounded_with"]]


def line(data, hold_out, explanations, scales, goal="", limit=None, unit="%", also=True, remark=""):
    """A row of the table; of several explanations the medians. `scales` convert errors to `unit`."""
    scales = list(scales)
    middle = lambda of: statistics.median(scale(of(e)) for e, scale in zip(explanations, scales, strict=True))
    after = middle(lambda e: e["after"]["held_out_rmse"])
    met = "" if not goal else "met" if (limit is None or after <= limit) and also else "NOT MET"
    verdict = counted([e["verdict"] for e in explanations], 4)
    return [data, hold_out, f"{middle(lambda e: e['before']['held_out_rmse']):.2f} {unit}", f"{after:.2f} {unit}",
            f"{middle(lambda e: e['noise_floor']):.2f} {unit}", counted(names(explanations)),
            counted(rivals(explanations)), verdict, goal, met, remark]


HEADER = ["data", "held out", "before", "after", "floor", "adopted", "confounded with", "verdicts", "goal", "", ""]


def print_table(rows):
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for k, row in enumerate(rows):
        print("| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths)) + " |")
        if k == 0:
            print("|" + "|".join("-" * (width + 2) for width in widths) + "|")


def read(path):
    with open(path, encoding="utf-8-sig", newline="") as file:
        return list(csv.DictReader(file))


# --- UIUC propellers, static ----------------------------------------------------------------------------------------

PROPELLER = ('[speed]\ncolumn = "N"\nunit = "rev/min"\n[propeller]\ndiameter_column = "D"\ndiameter_unit = "in"\n')


def uiuc_table(name, rows, hold_out, blocks="rows"):
    return Table(name, rows, ("CT", "1", "c_t_propeller"), ["PropName"], blocks, hold_out, more=PROPELLER)


def mean_of(rows, column, chosen=lambda row: True):
    return statistics.fmean(abs(float(row[column])) for row in rows if chosen(row))


def line_fit(x, y):
    """Intercept at the mean, slope and the standard error of the slope."""
    mean_x, mean_y = statistics.fmean(x), statistics.fmean(y)
    sxx = sum((a - mean_x) ** 2 for a in x)
    slope = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y)) / sxx
    rest = sum((b - mean_y - slope * (a - mean_x)) ** 2 for a, b in zip(x, y))
    return mean_y - slope * mean_x, slope, math.sqrt(rest / (len(x) - 2) / sxx)


def logarithms(rows, column):
    return [math.log(float(row[column])) for row in rows]


def slope_t(rows):
    """Student's t of the slope of ln CT over ln N: what a propeller's trend is over its scatter."""
    _, slope, error = line_fit(logarithms(rows, "N"), logarithms(rows, "CT"))
    return slope / error


def without_trend(rows, seed):
    """The same speeds; CT constant but for the scatter about a power law, in another order."""
    x, y = logarithms(rows, "N"), logarithms(rows, "CT")
    at_zero, slope, _ = line_fit(x, y)
    scatter = [b - at_zero - slope * a for a, b in zip(x, y)]
    random.Random(seed).shuffle(scatter)
    mean = statistics.fmean(y)
    return [{**row, "CT": f"{math.exp(mean + e):.6f}"} for row, e in zip(rows, scatter)]


def uiuc(loop, data):
    by_propeller = collections.defaultdict(list)
    for row in read(data / "uiuc_static/static.csv"):
        by_propeller[row["PropName"]].append(row)
    propellers = {name: rows for name, rows in by_propeller.items() if len(rows) >= 12}
    def scales(chosen=lambda rank, n: True):  # of the mean over the rows that are scored
        for rows in propellers.values():
            n = len(rows)
            by_speed = sorted(rows, key=lambda row: float(row["N"]))
            yield share_of(mean_of([row for k, row in enumerate(by_speed) if chosen((k + 0.5) / n, n)], "CT"))

    label = f"UIUC, each of {len(propellers)} propellers, median"

    def each(hold_out):
        return [uiuc_table(name, rows, hold_out(len(rows))) for name, rows in propellers.items()]

    second = lambda n: f"sin(rank(N)*{n}*_pi) < 0"
    low = lambda n: "rank(N) > 0.7"
    highest = lambda rank, n: rank > 0.7
    yield line(label, SECOND, loop.explain_all(each(second)),
               scales(lambda rank, n: math.sin(rank * n * math.pi) < 0), "after ≤ 1.25 %", 1.25)
    yield line(label, LOW, loop.explain_all(each(low)), scales(highest), "named ≤ 2.0 %", 2.0)
    yield line(label, LOW, loop.explain_all(each(low), "--adopt-empirical"), scales(highest),
               "with the curve ≤ 1.5 %", 1.5, remark="--adopt-empirical")
    still = {name: rows for name, rows in propellers.items() if abs(slope_t(rows)) < 3}
    found = loop.explain_all([uiuc_table(name, rows, "") for name, rows in still.items()])
    yield line(f"UIUC, {len(still)} propellers whose slope is below three standard errors", ALL, found,
               [share_of(mean_of(rows, "CT")) for rows in still.values()], "nothing named", also=not names(found))
    found = loop.explain_all([uiuc_table(name, without_trend(rows, seed), "")
                              for seed, (name, rows) in enumerate(propellers.items())])
    named = sum(bool(e["adopted"]) for e in found)
    yield line(f"UIUC, {len(propellers)} propellers, trend taken out, scatter dealt out anew, median", ALL, found, scales(),
               "named in ≤ 5 %", also=named <= 0.05 * len(found), remark=f"{named} named")
    rows = [row for rows in propellers.values() for row in rows]
    whole = [share_of(mean_of(rows, "CT"))]
    for hold_out, expression, blocks in ((SECOND, second(14), "rows"), (LOW, low(14), "rows"),
                                         ("a quarter of the propellers", "", "PropName")):
        table = uiuc_table("UIUC", rows, expression, blocks)
        yield line("UIUC, all propellers in one table", hold_out, [loop.explain(table)], whole)


# --- Strawson motors ------------------------------------------------------------------------------------------------

def strawson_rows(data):
    """Sweeps stacked, rows with the motor turning, thrust by magnitude as in the pushing direction."""
    rows = []
    for path in sorted((data / "strawson_motors/rawdata").glob("*.csv")):
        group, _, supply = path.stem.partition("_")
        sweep = read(path)
        speed = [float(row["Motor Electrical Speed (RPM)"] or 0) for row in sweep]
        for row, rpm in zip(sweep, speed):
            thrust = abs(float(row["Thrust (gf)"] or 0))
            if rpm > 0.05 * max(speed) and thrust > 2:
                rows.append({"group": group, "cells": 3 if supply == "11" else 2, "throttle_us": float(row["ESC signal (µs)"]) - 1000,
                             "thrust_gf": thrust, "voltage_V": row["Voltage (V)"], "speed_rpm": rpm})
    return rows


def strawson(loop, data):
    rows = strawson_rows(data)
    hold_out = "cells == 2"
    voltage = [("voltage_V", "V", "supply_voltage_V")]
    speed = '[speed]\ncolumn = "speed_rpm"\nunit = "rpm"\n[propeller]\ndiameter_m = 0.127\n'
    throttle = ["--baseline", "power:throttle_us"]

    def table(name, chosen, **how):
        return Table(name, chosen, ("thrust_gf", "gf", "thrust_N"), ["group"], "rows", hold_out, voltage, **how)

    groups = collections.defaultdict(list)
    for row in rows:
        groups[row["group"]].append(row)
    groups = {name: own for name, own in groups.items() if {row["cells"] for row in own} == {2, 3} and len(own) >= 10}
    held = lambda row: row["cells"] == 2
    newtons = 9.80665e-3
    scale = lambda own: share_of(newtons * mean_of(own, "thrust_gf", held))
    label = f"Strawson, each of {len(groups)} motors with propeller, median"
    kinds = (("signal", throttle, ""), ("constant C_T", [], speed))
    for what, arguments, more in kinds:
        tables = [table(name, own, arguments=arguments, more=more) for name, own in groups.items()]
        yield line(f"{label}, {what}", "3S → 2S", loop.explain_all(tables), [scale(own) for own in groups.values()])
    for what, arguments, more in kinds:
        found = loop.explain(table("Strawson", rows, arguments=arguments, more=more))
        goal = "supply_voltage in a set, and better" if what == "signal" else ""
        inside = "supply_voltage" in names([found]) + rivals([found])
        better = found["after"]["held_out_rmse"] < found["before"]["held_out_rmse"]
        yield line(f"Strawson, one table, {what}", "3S → 2S", [found], [scale(rows)], goal, also=inside and better)
    found = loop.explain(table("Strawson", rows, arguments=throttle), "--adopt-empirical")
    yield line("Strawson, one table, signal", "3S → 2S", [found], [scale(rows)], remark="--adopt-empirical")


# --- FARE-KE load cells ---------------------------------------------------------------------------------------------

def fareke(loop, data):
    for cell in (1, 3, 4):
        rows = read(data / f"fareke_load_cells/cell{cell}.csv")[:15]
        for k, row in enumerate(rows):
            for column in [key for key in row if not key or not key.startswith(("force_", "sensor_"))]:
                del row[column]
            row["axis"] = "xyz"[k // 5]
        explanations, scales, gross = [], [], []
        for axis in "xyz":
            forces = [(f"force_{each}", "gf", "") for each in "xyz"]
            own = [row for row in rows if row["axis"] == axis]
            largest = float(own[-1][f"force_{axis}"])
            gain = abs(float(own[-1][f"sensor_{axis}"]) - float(own[0][f"sensor_{axis}"])) / largest  # counts per gf
            hold_out = " || ".join(f"force_{each} == {largest:g}" for each in "xyz")
            found = loop.explain(Table(f"cell{cell} {axis}", rows, (f"sensor_{axis}", "counts", ""), ["axis"], "rows",
                                       hold_out, forces, arguments=["--baseline", f"linear:force_{axis}"]))
            explanations.append(found)
            scales.append(lambda error, gain=gain: error / gain)
            gross += [f"{axis}: {row['row']} {row['studentised']:.0f} σ" for row in found["suspect_rows"]]
        yield line(f"FARE-KE cell {cell}, median of three axes", "the largest load of every axis", explanations, scales,
                   "crosstalk named" + ("; the gross row found" if cell == 3 else ""), unit="gf",
                   also="crosstalk" in names(explanations) and (cell != 3 or any(":8" in row for row in gross)),
                   remark="; ".join(gross))


# --- ground effect --------------------------------------------------------------------------------------------------

def ground(loop, data):
    by_configuration = collections.defaultdict(list)
    for row in read(data / "ground_effect_coplanar/ground_effect.csv"):
        by_configuration[row["configuration"]].append(row)
    distance = [("ground_distance_R", "1", "ground_distance_R")]
    for name, rows in by_configuration.items():
        scale = [share_of(mean_of(rows, "thrust_N"))]
        for what, hold_out in (("every second height", f"sin(rank(ground_distance_R)*{len(rows)}*_pi) < 0"),
                               ("every second height, the lowest too", f"sin(rank(ground_distance_R)*{len(rows)}*_pi) > 0"),
                               ("every third height", f"sin(rank(ground_distance_R)*{len(rows)}*_pi*2/3) < -0.5"),
                               (ALL, "")):
            found = loop.explain(Table(name, rows, ("thrust_N", "N", "thrust_N"), ["configuration"], "rows", hold_out,
                                       distance))
            goal = ("", None)
            if name == "coplanar":  # the goals' figures are of the second of these splits
                goal = ("≤ 0.6 %", 0.6) if what.endswith("the lowest too") else ("≤ 1.3 %", 1.3)
            yield line(f"ground effect, {name}", what, [found], scale, *goal,
                       also="ground_effect" in " ".join(names([found])))


PARTS = {"uiuc": uiuc, "strawson": strawson, "fareke": fareke, "ground": ground}


def main():
    parser = argparse.ArgumentParser(prog="rig bench measured", description=__doc__)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--part", action="append", choices=list(PARTS), help="only these data sets")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    root = pathlib.Path(__file__).resolve().parents[2]
    data = pathlib.Path(os.environ.get("TUNNELRIG_SHARED_DATA", root / ".." / "shared" / "data"))
    if not data.is_dir():
        print(f"the measured data are not at {data}; TUNNELRIG_SHARED_DATA names another folder", file=sys.stderr)
        return SKIPPED
    loop = Loop((options.build / "cli" / "tunnelrig").resolve(), options.jobs)
    rows = [HEADER]
    for part in options.part or PARTS:
        for row in PARTS[part](loop, data):
            print(f"{row[0]}, {row[1]}", file=sys.stderr)
            rows.append(row)
    print_table(rows)
    return 1 if any("NOT MET" in row for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
