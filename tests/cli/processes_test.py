"""Three processes under mpirun fly what one flies, to the last digit, and only one of them speaks. They do not tune.

    processes_test.py PROGRAM       exit code 77: there is no mpirun
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

program = sys.argv[1]
if shutil.which("mpirun") is None:
    print("no mpirun: skipped")
    sys.exit(77)
fly = [program, "fly", "--scenario", "circle", "--controllers", "ibs-map,pid-ff", "--runs", "7", "--workers", "1", "--json"]
with tempfile.TemporaryDirectory() as folder:
    one, three = pathlib.Path(folder) / "one.json", pathlib.Path(folder) / "three.json"
    alone = subprocess.run([*fly, one], capture_output=True, text=True, check=True)
    mpirun = ["mpirun", "--allow-run-as-root", "--oversubscribe", "-n", "3"]
    together = subprocess.run([*mpirun, *fly, three], capture_output=True, text=True, check=True)
    assert alone.stdout == together.stdout, f"{alone.stdout}\n---\n{together.stdout}"
    assert one.read_text() == three.read_text(), "the JSON differs"
    refused = subprocess.run([*mpirun, program, "fly", "--runs", "2", "--map-scale", "99"], capture_output=True, text=True)
    assert refused.returncode == 2, refused.returncode
    assert refused.stderr.count("map_scale") == 1, refused.stderr
    gains = pathlib.Path(folder) / "gains.toml"
    untuned = subprocess.run([*mpirun, program, "fly", "--tune", gains, "--budget", "10"], capture_output=True, text=True)
    assert untuned.returncode == 2, untuned.returncode
    assert untuned.stderr.count("without mpirun") == 1, untuned.stderr
    assert not gains.exists()
