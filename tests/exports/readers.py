"""One reader per format; all give the same: what the export says, with its units.

tables:  {table: {column: (unit, values)}}
groups:  {group: {array: (unit, values)}}
texts:   {name: text}
provenance: {key: text}
raw:     {key: {"run", "location", "sample_rate_hz", "series": {name: (unit, values)}}}
"""

import csv
import json

import numpy as np


def hdf5(path):
    import h5py

    def text(value):
        return value.decode() if isinstance(value, bytes) else str(value)

    def values(dataset):
        return np.array([text(v) for v in dataset[:]]) if dataset.dtype.kind in "SO" else dataset[...]

    out = {"tables": {}, "groups": {}, "texts": {}, "raw": {}}
    with h5py.File(path) as file:
        out["provenance"] = {key: text(value) for key, value in file.attrs.items()}
        for name, group in file.items():
            if name == "raw":
                for key, recording in group.items():
                    series = {n: (text(d.attrs["unit"]), d[...]) for n, d in recording.items()}
                    out["raw"][key] = {"run": text(recording.attrs["run"]), "location": text(recording.attrs["location"])}
                    out["raw"][key].update(sample_rate_hz=recording.attrs["sample_rate_hz"], series=series)
            elif name == "texts":
                out["texts"] = {n: text(d[()]) for n, d in group.items()}
            else:
                kind = "groups" if name in ("map", "covariance", "model_covariance") else "tables"
                out[kind][name] = {n: (text(d.attrs["unit"]), values(d)) for n, d in group.items()}
    return out


def mat(path):
    import scipy.io

    file = scipy.io.loadmat(path, struct_as_record=False, squeeze_me=False, chars_as_strings=True)

    def only(struct):
        return struct[0, 0]

    def text(value):
        return str(value[0]) if value.size else ""

    def values(value):
        if value.dtype == object:
            return np.array([text(cell) for cell in value[:, 0]])
        return value[:, 0] if value.shape[1] == 1 else value

    def fields(name):
        struct, units = only(file[name]), only(file[name + "_units"])
        return {f: (text(getattr(units, f)), values(getattr(struct, f))) for f in struct._fieldnames}

    out = {"tables": {}, "groups": {}, "raw": {}}
    for name in file:
        if name.startswith("raw_"):
            struct = only(file[name])
            units = only(struct.units)
            out["raw"][name[4:]] = {
                "run": text(struct.run),
                "location": text(struct.location),
                "sample_rate_hz": struct.sample_rate_hz[0, 0],
                "series": {f: (text(getattr(units, f)), values(getattr(struct, f))) for f in units._fieldnames},
            }
        elif name in ("texts", "provenance"):
            struct = only(file[name])
            out[name] = {f: text(getattr(struct, f)) for f in struct._fieldnames}
        elif not name.startswith("__") and not name.endswith("_units"):
            out["groups" if name in ("map", "covariance", "model_covariance") else "tables"][name] = fields(name)
    return out


def npy(path):
    def note(file):
        return json.loads(file.read_text())

    out = {"tables": {}, "groups": {}, "raw": {}}
    for file in path.glob("*.npy"):
        table, units = np.load(file), note(file.with_suffix(".json"))["columns"]
        assert list(units) == list(table.dtype.names), file
        out["tables"][file.stem] = {name: (units[name]["unit"], table[name]) for name in table.dtype.names}
    for group in ("map", "covariance", "model_covariance"):
        if (path / group).exists():
            units = note(path / f"{group}.json")["arrays"]
            out["groups"][group] = {f.stem: (units[f.stem]["unit"], np.load(f)) for f in (path / group).iterdir()}
    for file in (path / "raw").glob("*.json"):
        about = note(file)
        series = {name: (unit["unit"], np.load(path / "raw" / f"{file.stem}.{name}.npy")) for name, unit in about["series"].items()}
        out["raw"][file.stem] = {**{k: about[k] for k in ("run", "location", "sample_rate_hz")}, "series": series}
    out["texts"] = {file.stem: file.read_text() for file in (path / "texts").iterdir()}
    out["provenance"] = note(path / "provenance.json")
    return out


def csvs(path):
    """CSV has no place for units but its names and columns.csv, and none for the run of a recording but recordings.csv."""

    def table(file):
        rows = list(csv.reader(file.open(newline="")))
        return {name: [row[i] for row in rows[1:]] for i, name in enumerate(rows[0])}

    dictionary = table(path / "columns.csv")
    units = {(t, c): u for t, c, u in zip(dictionary["table"], dictionary["column"], dictionary["unit"])}

    def typed(unit, cells):
        try:
            return np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            return np.array(cells)

    out = {"tables": {}, "groups": {}, "raw": {}}
    for file in path.glob("*.csv"):
        out["tables"][file.stem] = {n: (units.get((file.stem, n), ""), typed("", cells)) for n, cells in table(file).items()}
    for group in ("map", "covariance", "model_covariance"):
        if (path / group).exists():
            out["groups"][group] = {f.stem: (units[group, f.stem], np.loadtxt(f, delimiter=",")) for f in (path / group).iterdir()}
    recordings = table(path / "recordings.csv")
    runs = table(path / "runs.csv")
    location = dict(zip(runs["run"], runs["location"]))
    for run, key, rate in zip(recordings["run"], recordings["key"], recordings["sample_rate_hz"]):
        if not key:
            continue
        file = path / "raw" / f"{key}.csv"
        names = file.open().readline().strip().split(",")
        columns = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
        series = {}
        for name in ("frame", "counts", "voltage_V", "thrust_N"):
            stem, _, ending = name.partition("_")
            wanted = [i for i, n in enumerate(names) if n == name or (n.startswith(stem + "_") and n.endswith(ending))]
            if wanted:
                series[name] = (units["raw", name], columns[:, wanted[0]] if name == "frame" else columns[:, wanted])
        out["raw"][key] = {"run": run, "location": location[run], "sample_rate_hz": float(rate), "series": series}
    out["texts"] = {file.stem: file.read_text() for file in (path / "texts").iterdir()}
    out["provenance"] = json.loads((path / "provenance.json").read_text())
    return out


READERS = {"hdf5": hdf5, "mat": mat, "npy": npy, "csv": csvs}
