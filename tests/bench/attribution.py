"""The blind benchmark: generates campaigns, runs `tunnelrig explain` on them, and scores it against the sealed keys.

Results are JSON lines, one a campaign; what stands there already is not run again, so that the benchmark can be stopped and
taken up. `explain` sees a campaign file; the key stays with this script, which hands both to the scorer.
"""

import argparse
import concurrent.futures
import hashlib
import itertools
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time

NOISES = ["white", "session", "autocorrelated", "heavy_tailed"]
TRACKS = ["none", "one", "two", "confounded", "outside", "not_recorded"]
SKIPPED = 77


def cell(track, noise, size=1.0, blocks=18, order="randomised", runs=None, options=()):
    return {"track": track, "noise": noise, "size": size, "blocks": blocks, "order": order,
            "runs": runs or round(blocks * 215 / 18), "options": list(options)}


def cells_of_the_table():
    """Those that the targets speak of: five numbers of blocks, so that 200 campaigns a cell are 1,000 a noise."""
    kinds = [("none", 1), ("one", 1), ("one", 0.5), ("two", 1), ("confounded", 1), ("outside", 1), ("not_recorded", 1)]
    for noise, (track, size), blocks in itertools.product(NOISES, kinds, (16, 18, 20, 22, 24)):
        yield cell(track, noise, size, blocks)
    for noise, track, blocks in itertools.product(NOISES, ("none", "one"), (4, 5)):
        yield cell(track, noise, 1, blocks)


def cells_around_it():
    """Other sizes, orders, numbers of blocks and runs, gaps in what was written down, switches and texts, raw campaigns."""
    for noise in NOISES:
        for size in (0.25, 2, 4):
            yield cell("one", noise, size)
        for blocks in (16, 18, 20, 22, 24):
            yield cell("outside", noise, 2, blocks)
        for track, blocks in itertools.product(("none", "one", "two"), (8, 12)):
            yield cell(track, noise, 1, blocks)
        for track in TRACKS:
            yield cell(track, noise, 1, order="swept")
        yield cell("one", noise, 1, runs=430)
        yield cell("none", noise, 1, options=["--unequal-repeats", "--missing-cells"])
        yield cell("one", noise, 1, options=["--unequal-repeats"])
        for track in ("none", "outside"):
            yield cell(track, noise, 1, options=["--switches"])
        yield cell("none", noise, 1, options=["--raw"])
        yield cell("one", noise, 1, options=["--raw"])


def cells_of_smoke():
    yield cell("none", "white")
    yield cell("none", "session")
    yield cell("one", "white")
    yield cell("one", "session", 2)
    yield cell("two", "heavy_tailed")
    yield cell("confounded", "white")
    yield cell("outside", "session")
    yield cell("one", "white", blocks=5)
    yield cell("one", "white", options=["--raw"])


def name_of(one):
    parts = [one["track"], one["noise"], f"{one['size']:g}", str(one["blocks"]), one["order"], str(one["runs"])]
    return "/".join(parts + one["options"])


def seed_of(cell_name, index):
    return int.from_bytes(hashlib.sha256(f"{cell_name}#{index}".encode()).digest()[:6], "big")


class Failure(Exception):
    pass


def run(command, accepted=(0,)):
    """Runs to the end; seconds and peak memory in MB."""
    started = time.perf_counter()
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen([str(part) for part in command], stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=errors)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode not in accepted:
            errors.seek(0)
            text = errors.read().decode(errors="replace").strip()[-500:]
            raise Failure(f"{' '.join(map(str, command))}: exit code {process.returncode}: {text}")
    return time.perf_counter() - started, usage.ru_maxrss / 1024


class Bench:
    def __init__(self, build, results, explain_options):
        self.program = build / "cli" / "tunnelrig"
        self.generator = build / "tests" / "attribution" / "generate_campaign"
        self.results = results
        self.explain_options = explain_options
        self.scratch = build / "bench"
        self.lock = threading.Lock()

    def explain(self, folder, name, arguments, key_arguments):
        """Generates the campaign `name` and explains it: key, explanation, seconds, MB."""
        campaign, key, db, out = (folder / f"{name}{end}" for end in ("", ".key.json", ".db", ".explain.json"))
        run([self.generator, *arguments, "--out", campaign, "--key", key])
        truth = json.loads(key.read_text())
        run([self.program, "import", campaign, "--db", db])
        run([self.program, "calibrate", "--db", db], accepted=(0, 1))
        seconds, peak_MB = run([self.program, "explain", "--db", db, "--json", out, *truth["explain_arguments"],
                                *key_arguments, *self.explain_options])
        return truth, json.loads(out.read_text()), seconds, peak_MB

    def campaign(self, one, index):
        name = name_of(one)
        seed = seed_of(name, index)
        arguments = ["--track", one["track"], "--noise", one["noise"], "--order", one["order"], "--blocks",
                     one["blocks"], "--runs", one["runs"], "--size", one["size"], "--seed", seed, *one["options"]]
        line = {"id": f"{name}#{index}", "seed": seed, "explain": None, "separated": None}
        folder = pathlib.Path(tempfile.mkdtemp(prefix="attribution.", dir=self.scratch))
        try:
            seed_argument = ["--seed", index + 1]
            line["key"], line["explain"], line["seconds"], line["peak_MB"] = self.explain(
                folder, "first", arguments, seed_argument)
            proposed = self.proposed(line["explain"]) if one["track"] == "confounded" else []
            if proposed:
                (folder / "separate.json").write_text(json.dumps(proposed))
                more = [*arguments, "--separate", folder / "separate.json"]
                _, line["separated"], _, _ = self.explain(folder, "second", more, seed_argument)
        except (Failure, OSError, ValueError) as error:
            line["error"] = str(error)
            key = folder / "first.key.json"
            if "key" not in line and key.exists():
                line["key"] = json.loads(key.read_text())
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        if "key" not in line:
            raise SystemExit(line["error"])
        with self.lock, open(self.results, "a", encoding="utf-8") as out:
            out.write(json.dumps(line) + "\n")

    @staticmethod
    def proposed(explanation):
        """Separating runs of the sets that hold more than one name."""
        runs = []
        for adopted in explanation.get("adopted", []):
            proposal = adopted.get("separating_run")
            if adopted.get("confounded_with") and proposal:
                runs += proposal if isinstance(proposal, list) else [proposal]
        return runs


def chosen_cells(options):
    cells = list(cells_of_smoke() if options.smoke else cells_of_the_table())
    if options.around:
        cells += list(cells_around_it())
    keep = lambda one, given, key: not given or one[key] in given
    return [one for one in cells
            if options.only in name_of(one) and keep(one, options.track, "track") and keep(one, options.noise, "noise") and
            keep(one, options.blocks, "blocks") and keep(one, options.size, "size")]


def finished(results):
    """Campaigns that stand in the results; a line that was cut off in the middle is taken out."""
    if not results.exists():
        return set()
    lines = results.read_text(encoding="utf-8").splitlines()
    good = []
    for line in lines:
        try:
            good.append((json.loads(line)["id"], line))
        except (ValueError, KeyError):
            print(f"{results}: a line that is no result is taken out", file=sys.stderr)
    if len(good) < len(lines):
        results.write_text("".join(line + "\n" for _, line in good), encoding="utf-8")
    return {name for name, _ in good}


def work(bench, todo, jobs):
    started = shown = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        futures = [pool.submit(bench.campaign, one, index) for one, index in todo]
        try:
            for done, future in enumerate(concurrent.futures.as_completed(futures), 1):
                future.result()
                now = time.monotonic()
                if now - shown > 10:
                    left = (now - started) / done * (len(todo) - done)
                    print(f"{done} of {len(todo)} campaigns, about {left / 60:.0f} min left", file=sys.stderr)
                    shown = now
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def print_cost(results, wanted):
    lines = [json.loads(line) for line in results.read_text(encoding="utf-8").splitlines()]
    seconds = sorted(line["seconds"] for line in lines if line["id"] in wanted and "seconds" in line)
    memory = [line["peak_MB"] for line in lines if line["id"] in wanted and "peak_MB" in line]
    if seconds:
        print(f"\nexplain: median {seconds[len(seconds) // 2]:.2f} s, longest {seconds[-1]:.2f} s, "
              f"largest {max(memory):.0f} MB")
    errors = [line for line in lines if line["id"] in wanted and "error" in line]
    for line in errors[:5]:
        print(f"{line['id']}: {line['error']}")


def parse_arguments():
    parser = argparse.ArgumentParser(prog="rig bench attribution", description=__doc__,
                                     epilog="Example: ./rig bench attribution --campaigns 10 --track one --noise white")
    parser.add_argument("build", type=pathlib.Path, help=argparse.SUPPRESS)
    parser.add_argument("--campaigns", type=int, help="per cell (200, overnight; smoke: 1)")
    parser.add_argument("--first", type=int, default=0, help="number of the first one: others than those that a rule was made on")
    parser.add_argument("--track", action="append", choices=TRACKS)
    parser.add_argument("--noise", action="append", choices=NOISES)
    parser.add_argument("--blocks", action="append", type=int)
    parser.add_argument("--size", action="append", type=float)
    parser.add_argument("--only", default="", metavar="TEXT", help="cells whose name holds it, of track/noise/size/blocks/order/runs/options")
    parser.add_argument("--around", action="store_true", help="also cells beyond the table: " + cells_around_it.__doc__)
    parser.add_argument("--smoke", action="store_true", help="a few campaigns, for the tests")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--results", type=pathlib.Path, help="JSON lines (BUILD/bench/attribution.jsonl)")
    parser.add_argument("--fresh", action="store_true", help="begin anew where results stand there already")
    parser.add_argument("--explain", action="append", default=[], metavar="OPTION", help="handed to explain")
    parser.add_argument("--score", action="append", default=[], metavar="OPTION", help="handed to the scorer")
    return parser.parse_args()


def main():
    options = parse_arguments()
    build = options.build.resolve()
    (build / "bench").mkdir(exist_ok=True)
    results = options.results or build / "bench" / ("smoke.jsonl" if options.smoke else "attribution.jsonl")
    if options.fresh:
        results.unlink(missing_ok=True)
    bench = Bench(build, results, options.explain)
    verbs = subprocess.run([bench.program, "--help"], capture_output=True, text=True, check=False).stdout
    if not re.search(r"^\s+explain\s", verbs, re.MULTILINE):
        print("this program has no verb explain; there is nothing to score", file=sys.stderr)
        return SKIPPED
    campaigns = options.campaigns or (1 if options.smoke else 200)
    wanted = [(one, index) for one in chosen_cells(options) for index in range(options.first, options.first + campaigns)]
    if not wanted:
        print("no cell is left of this choice", file=sys.stderr)
        return 2
    done = finished(results)
    # one campaign of every cell first, so that a table that is stopped early says something of each
    todo = sorted((pair for pair in wanted if f"{name_of(pair[0])}#{pair[1]}" not in done), key=lambda pair: pair[1])
    print(f"{len(wanted)} campaigns, {len(todo)} to run, results in {results}", file=sys.stderr)
    work(bench, todo, options.jobs)
    names = {f"{name_of(one)}#{index}" for one, index in wanted}
    with tempfile.NamedTemporaryFile("w", suffix=".jsonl", encoding="utf-8") as chosen:
        for line in results.read_text(encoding="utf-8").splitlines():
            if json.loads(line)["id"] in names:
                chosen.write(line + "\n")
        chosen.flush()
        scorer = build / "tests" / "attribution" / "score_attribution"
        code = subprocess.run([scorer, chosen.name, *options.score], check=False).returncode
        if options.smoke:  # one campaign a cell says nothing of a target, but all of a crash or a broken contract
            code = broken(json.loads(subprocess.run([scorer, chosen.name, "--json"], check=False,
                                                    capture_output=True, text=True).stdout))
    print_cost(results, names)
    return code


def broken(scores):
    """1 where `explain` failed or broke its contract, or nobody asked whether it did."""
    wanted = {"explain failed", "contract broken"}
    values = [(score["metric"], score["value"]) for score in scores if score["metric"] in wanted]
    return int({name for name, _ in values} != wanted or any(value != 0 for _, value in values))


if __name__ == "__main__":
    sys.exit(main())
