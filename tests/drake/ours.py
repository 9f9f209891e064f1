"""The stages of this project as processes, with what they cost."""

import os
import resource
import subprocess
import time
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
PROGRAMS = Path(os.environ.get("REGRASP_PROGRAMS", PROJECT / "target" / "release"))


class Cost:
    """Wall and CPU seconds of a block, its children included."""

    def __enter__(self):
        self._wall, self._cpu = time.perf_counter(), cpu()
        return self

    def __exit__(self, *_):
        self.wall, self.cpu = time.perf_counter() - self._wall, cpu() - self._cpu


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


def verdicts(scene, configurations):
    """This project's collision verdicts: 1 free, 0 in collision."""
    program = PROGRAMS / "examples" / "verdicts"
    text = "\n".join(" ".join(repr(float(v)) for v in q) for q in configurations)
    done = subprocess.run([program, scene], input=text, capture_output=True, text=True, check=True)
    return [line == "1" for line in done.stdout.split()]
