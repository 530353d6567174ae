"""The networks that `springfit bench step --write` writes, and the clock of the peers; see README.md."""

import json
import time
from pathlib import Path

import numpy as np


class Network:
    """One network. `real` is the type of the peer's numbers."""

    def __init__(self, prefix, real):
        self.prefix = prefix
        self.head = json.loads(Path(f"{prefix}.json").read_text())
        read = lambda name, kind, columns: np.fromfile(f"{prefix}_{name}", dtype=kind).reshape(-1, columns)
        self.ends = read("ends.u32", "<u4", 2).astype(np.int32)
        springs, nodes = read("springs.f64", "<f8", 3), read("nodes.f64", "<f8", 5)
        self.stiffness, self.length, self.damping = (np.ascontiguousarray(column, dtype=real) for column in springs.T)
        self.positions = np.ascontiguousarray(nodes[:, :3], dtype=real)
        self.mobility = np.ascontiguousarray(nodes[:, 4] / nodes[:, 3], dtype=real)
        self.step, self.steps, self.damped = self.head["step"], self.head["steps"], self.head["damped"]
        self.gravity = self.head["acceleration"]
        # v half a step before the start, so that leapfrog starts at rest
        free = (self.mobility > 0)[:, None]
        self.velocities = np.ascontiguousarray(-0.5 * self.step * np.array(self.gravity) * free, dtype=real)

    def by_node(self):
        """The springs of each node: where its list starts, the other ends, the springs."""
        ends = np.concatenate([self.ends, self.ends[:, ::-1]])
        order = np.argsort(ends[:, 0], kind="stable")
        starts = np.searchsorted(ends[order, 0], np.arange(len(self.positions) + 1)).astype(np.int32)
        springs = (order % len(self.ends)).astype(np.int32)
        return starts, np.ascontiguousarray(ends[order, 1]), springs

    def error(self, positions):
        """Distance from where our run is after the same steps, over the distance moved."""
        moved = np.fromfile(f"{self.prefix}_moved.f64").reshape(-1, 3)
        start = np.fromfile(f"{self.prefix}_nodes.f64").reshape(-1, 5)[:, :3]
        return float(np.linalg.norm(positions - moved) / np.linalg.norm(moved - start))


def measure(network, advance, wait, positions, rounds):
    """Checks the motion, then times rounds of steps. `advance` does a step, `wait` until all are done."""
    for _ in range(network.steps):
        advance()
    wait()
    error = network.error(positions())
    steps = max(10, int(4e7 / len(network.ends)))
    wall, processor = [], []
    for _ in range(rounds):
        before, start = time.process_time(), time.perf_counter()
        for _ in range(steps):
            advance()
        wait()
        wall.append((time.perf_counter() - start) / steps)
        processor.append((time.process_time() - before) / steps)
    return {"rounds": wall, "processor": processor, "error": error}
