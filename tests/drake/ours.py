"""The stages of this project as processes, with what they cost."""

import hashlib
import os
import resource
import subprocess
import time
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
PROGRAMS = Path(os.environ.get("REGRASP_PROGRAMS", PROJECT / "target" / "release"))


class Cost:
    """Wall and CPU seconds (user and system) of a block, its children included; load of the machine at its end."""

    def __init__(self, wall=0.0, cpu=0.0, load=0.0):
        self.wall, self.cpu, self.load = wall, cpu, load

    def after(self, first):
        """The cost of `first` and then this."""
        return Cost(first.wall + self.wall, first.cpu + self.cpu, self.load)

    def __enter__(self):
        self._wall, self._cpu = time.perf_counter(), cpu()
        return self

    def __exit__(self, *_):
        self.wall, self.cpu, self.load = time.perf_counter() - self._wall, cpu() - self._cpu, os.getloadavg()[0]


def cpu():
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def run(program, *arguments, accept=(0,)):
    done = subprocess.run([PROGRAMS / program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode not in accept:
        raise SystemExit(f"{program} {' '.join(map(str, arguments))}: exit {done.returncode}\n{done.stderr}")


def decompose(scene, out, *options):
    # Exit 3: a target was not quite met; the regions are there, and the judge says how good they are.
    run("regrasp-decompose", "run", "--scene", scene, "--out", out / "decompose", *options, accept=(0, 3))
    return out / "decompose" / "regions.json"


def certify(scene, out, *options):
    run("regrasp-certify", "run", "--scene", scene, "--in", out, "--out", out / "certify", *options)
    return out / "certify" / "regions.json"


def digest(scene):
    """Digest of the files of a scene."""
    files = sorted(path for path in scene.iterdir() if path.is_file())
    return hashlib.sha256(b"".join(path.name.encode() + path.read_bytes() for path in files)).hexdigest()[:16]


def verdicts(scene, configurations):
    """This project's collision verdicts: 1 free, 0 in collision."""
    program = PROGRAMS / "examples" / "verdicts"
    text = "\n".join(" ".join(repr(float(v)) for v in q) for q in configurations)
    done = subprocess.run([program, scene], input=text, capture_output=True, text=True, check=True)
    return [line == "1" for line in done.stdout.split()]
