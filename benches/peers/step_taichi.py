"""Leapfrog of one network in Taichi on the processor.

    step_taichi.py PREFIX ROUNDS f32|f64 springs|nodes THREADS

"springs": a loop over springs that adds to both ends (atomically, as Taichi does in parallel loops); "nodes": a loop over
nodes that reads their springs. Prints one JSON object.
"""

import json
import sys

import numpy as np
import taichi as ti

from step_network import Network, measure

prefix, rounds, precision, way, threads = sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4], int(sys.argv[5])
real = ti.f32 if precision == "f32" else ti.f64
network = Network(prefix, np.float32 if precision == "f32" else np.float64)
ti.init(arch=ti.cpu, default_fp=real, cpu_max_num_threads=threads, fast_math=True, log_level=ti.ERROR, offline_cache=False)
NODES, SPRINGS, DAMPED = len(network.positions), len(network.ends), network.damped


def put(values, kind):
    field = ti.field(kind, shape=values.shape)
    field.from_numpy(values)
    return field


def put_vectors(values):
    field = ti.Vector.field(3, real, shape=len(values))
    field.from_numpy(values)
    return field


x, v, f = put_vectors(network.positions), put_vectors(network.velocities), put_vectors(0 * network.positions)
k, l0, c, mobility = (put(a, real) for a in (network.stiffness, network.length, network.damping, network.mobility))
ends = ti.Vector.field(2, ti.i32, shape=SPRINGS)
ends.from_numpy(network.ends)
starts, others, springs = (put(a, ti.i32) for a in network.by_node())
g, h = ti.Vector(network.gravity, dt=real), network.step


@ti.func
def pull(a, b, s):
    d = x[b] - x[a]
    length = d.norm()
    n = d / length
    force = k[s] * (length - l0[s]) * n
    if ti.static(DAMPED):
        force += c[s] * (v[b] - v[a]).dot(n) * n
    return force


@ti.kernel
def along_springs():
    for node in range(NODES):
        f[node] = ti.Vector.zero(real, 3)
    for s in range(SPRINGS):
        a, b = ends[s][0], ends[s][1]
        force = pull(a, b, s)
        f[a] += force
        f[b] -= force


@ti.kernel
def around_nodes():
    for a in range(NODES):
        total = ti.Vector.zero(real, 3)
        for entry in range(starts[a], starts[a + 1]):
            total += pull(a, others[entry], springs[entry])
        f[a] = total


@ti.kernel
def move():
    for node in range(NODES):
        m = mobility[node]
        if m > 0:
            v[node] += h * (f[node] * m + g)
            x[node] += h * v[node]


def advance():
    along_springs() if way == "springs" else around_nodes()
    move()


found = measure(network, advance, ti.sync, lambda: x.to_numpy().astype(np.float64), rounds)
print(json.dumps({"version": f"taichi {'.'.join(map(str, ti.__version__))}", **found}))
