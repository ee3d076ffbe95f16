"""The results of searches, pose graphs, odometry and uncertainty, computed natively or in the page's Python."""

import json

import numpy as np

from solvers import register
from solvers.drives import simulated_drive
from solvers.odometry import candidates, close, edges_of, prepare, scan_to_map, scan_to_scan, verified
from solvers.posegraph import marginals, optimise
from solvers.scenes.rooms import kabsch_scene, room
from solvers.scenes.walls import corridor
from solvers.studies.race import SEEDS
from solvers.uncertainty import covariance, monte_carlo


def main(text):
    """The result of each function of `FOUND` listed under "asked": names mapped to numbers."""
    return json.dumps({name: FOUND[name]() for name in json.loads(text)["asked"]})


def rows(pose):
    """x, y, cos and sin of each pose."""
    return np.concatenate([pose.t, pose.R[..., 0]], axis=-1).tolist()


def searches():
    """The end of each search on the race's 25 seeds, or on five of them if it is slow."""

    def end(scene, name):
        result = register(scene.source, scene.target, name)
        return [*rows(result.pose), float(result.objective), int(result.steps), int(result.status)]

    rooms = {seed: room("noise", seed=seed) for seed in SEEDS}
    pairs = {seed: kabsch_scene("noisy", seed=seed, outliers=5) for seed in SEEDS}
    return {
        "branch-and-bound": {seed: end(rooms[seed], "branch-and-bound") for seed in SEEDS[:5]},
        "correlative": {seed: end(rooms[seed], "correlative") for seed in SEEDS},
        "graduated-nonconvexity": {seed: end(pairs[seed], "graduated-nonconvexity") for seed in SEEDS},
    }


def odometry():
    """A short drive matched scan to scan and to a map, its loops, and the graph closed with them."""
    drive, _ = simulated_drive(scans=50, beams=91)
    scans = prepare(drive)
    chain, by_map = scan_to_scan(scans, drive.motion), scan_to_map(scans, drive.motion, length=2)
    loops = verified(scans, chain.poses, *candidates(chain.poses))
    return {
        "chain": rows(chain.poses),
        "map": rows(by_map.poses),
        "loops": [loops.source.tolist(), loops.target.tolist(), loops.believed.tolist()],
        "closed": rows(close(chain, loops).poses),
    }


def posegraph():
    """The graph of that drive under each kernel, with the marginal covariances."""
    drive, _ = simulated_drive(scans=50, beams=91)
    scans = prepare(drive)
    chain = scan_to_scan(scans, drive.motion)
    edges, robust = edges_of(chain, verified(scans, chain.poses, *candidates(chain.poses)))
    results = {}
    for kernel in ("none", "huber", "cauchy", "dcs"):
        end = optimise(chain.poses, edges, kernel=kernel, robust=robust)
        results[kernel] = [rows(end.poses), float(end.total), end.weights.tolist()]
    results["marginals"] = marginals(end.poses, edges, [10, 49]).tolist()
    return results


def uncertainty():
    """Covariances in closed form and from redrawn scenes."""
    scene = kabsch_scene("noisy", seed=53)
    fit = register(scene.source, scene.target, "kabsch")
    scenes = [corridor(seed=seed) for seed in range(12)]
    source, target = (np.stack([getattr(s, name) for s in scenes]) for name in ("source", "target"))
    along = register(source[0], target[0], "point-to-plane", start=scenes[0].start, gate=0.8)
    hessian = covariance(along, "hessian")
    return {
        "pairs": covariance(fit, sigma=0.12).matrix.tolist(),
        "hessian": hessian.deviations.tolist(),
        "censi": covariance(along, "censi", source_noise=0.05, target_noise=0.05).deviations.tolist(),
        "drawn": rows(monte_carlo(source, target, "point-to-plane", start=scenes[0].start, gate=0.8).poses),
    }


FOUND = {"searches": searches, "odometry": odometry, "posegraph": posegraph, "uncertainty": uncertainty}
