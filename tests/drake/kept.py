"""What Drake grew in an earlier run, with its cost: minutes for each cover, and it does not change."""

import json

import numpy as np

from ours import Cost


def kept(folder, what, grow):
    """Cost and regions of `grow()`, read from `folder` if it holds those of the same conditions `what`, else kept there."""
    name = "-".join(str(what[key]) for key in ("scene", "method"))
    at = "".join(f"{v:+.2f}" for v in what.get("q", []))
    path = folder and folder / f"{name}{at}.json"
    if path and path.is_file():
        found = json.loads(path.read_text())
        if found["what"] == json.loads(json.dumps(what)):
            return Cost(**found["cost"]), [(np.array(A), np.array(b)) for A, b in found["regions"]]
    with Cost() as cost:
        regions = grow()
    if path:
        folder.mkdir(parents=True, exist_ok=True)
        lists = [(A.tolist(), b.tolist()) for A, b in regions]
        cost_of = dict(wall=cost.wall, cpu=cost.cpu, load=cost.load)
        path.write_text(json.dumps(dict(what=what, cost=cost_of, regions=lists)))
    return cost, regions
