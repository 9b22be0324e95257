"""MuJoCo's own equations of an MJCF file against those of the scene that is made of it.

MuJoCo's free joints hold the position before the quaternion, and velocities linear in world axes before angular in body
axes; joints have the order of the file in both. Forces are ``qfrc_passive`` + ``qfrc_actuator`` - ``qfrc_bias``:
springs, dampers, actuators and gravity.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from eomgen.pipeline.pipeline import derive
from eomgen.scene.load import load
from eomgen.scene.scene import Scene
from eomgen.system.system import System
from tests.oracles.evaluation import Array, relative_error, tape_evaluator
from tests.oracles.mujoco_exact import neglected_offsets, refine_rings
from tests.oracles.states import random_states, rotation_of

STATES = 20


@dataclass
class Imported:
    """A file in MuJoCo and as a scene.

    Attributes
    ----------
    scene, system : as eomgen reads the file
    model, data : as MuJoCo compiles it, static bodies kept
    """

    scene: Scene
    system: System
    model: mujoco.MjModel
    data: mujoco.MjData

    @classmethod
    def of(
        cls, path: Path, terms: tuple[str, ...] = ("mass", "residual"), scene: Scene | None = None, **options: object
    ) -> Imported:
        scene = scene or load(path, **options)
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compiler.fusestatic = False
        model = spec.compile()
        # of a DC motor MuJoCo takes the current at the end of its step
        model.actuator_actearly[model.actuator_dyntype == mujoco.mjtDyn.mjDYN_DCMOTOR] = 0
        found = cls(scene, derive(scene, list(terms)), model, mujoco.MjData(model))
        sizes = [(factor.q_size, factor.v_size) for factor in found.system.factors]
        assert sizes == [((7, 6), (4, 3), (1, 1), (1, 1))[kind] for kind in model.jnt_type]
        return found

    def place(self, q: Array, v: Array) -> Array:
        """Put a state into MuJoCo's data, and return the (nv, nv) matrix from eomgen's velocities to MuJoCo's."""
        A = np.eye(self.system.nv)
        qpos = q.copy()
        for factor in self.system.factors:
            if factor.group == "SE3":
                at, start = slice(factor.q_start, factor.q_start + 7), factor.v_start
                qpos[at] = [*q[at][4:], *q[at][:4]]
                A[start : start + 6, start : start + 6] = 0.0
                A[start : start + 3, start + 3 : start + 6] = rotation_of(q[at][:4])
                A[start + 3 : start + 6, start : start + 3] = np.eye(3)
        self.data.qpos[:], self.data.qvel[:] = qpos, A @ v
        return A

    def equations(self, q: Array, v: Array, u: Array, z: Array) -> tuple[Array, Array, Array]:
        """Return M, the residual at rest of accelerations (bias less forces), and the sizes of their parts."""
        A = self.place(q, v)
        if self.system.nu:  # without inputs the file switches actuators off
            self.data.ctrl[self._controls()], self.data.act[:] = u, z
        rest_of_M, rest_of_bias = neglected_offsets(self.model, self.data)
        mujoco.mj_fwdPosition(self.model, self.data)
        refine_rings(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        mujoco.mj_fwdActuation(self.model, self.data)
        M = np.zeros((self.system.nv, self.system.nv))
        mujoco.mj_fullM(self.model, self.data, M)
        M += rest_of_M
        bias = self.data.qfrc_bias + rest_of_bias
        parts = [bias, M @ self._drift(q, v), -self.data.qfrc_passive, -self.data.qfrc_actuator]
        return A.T @ M @ A, A.T @ sum(parts), np.sum([np.abs(A.T @ part) for part in parts], axis=0)

    def _controls(self) -> list[int]:
        """Return the places of the inputs of the scene in MuJoCo's controls, without actuators of contacts."""
        model, counts = self.model, getattr(self.model, "actuator_ctrlnum", np.ones(self.model.nu, dtype=int))
        starts = np.cumsum([0, *counts])
        kept = [k for k, kind in enumerate(model.actuator_trntype) if kind != mujoco.mjtTrn.mjTRN_BODY]
        return [place for k in kept for place in range(starts[k], starts[k + 1])]

    def _drift(self, q: Array, v: Array) -> Array:
        """Return dA/dt v, the part of MuJoCo's accelerations that velocities alone give."""
        drift = np.zeros(self.system.nv)
        for factor in self.system.factors:
            if factor.group == "SE3":
                omega, speed = v[factor.v_start : factor.v_start + 3], v[factor.v_start + 3 : factor.v_start + 6]
                turned = rotation_of(q[factor.q_start : factor.q_start + 4]) @ np.cross(omega, speed)
                drift[factor.v_start : factor.v_start + 3] = turned
        return drift

    def errors(
        self, *, control: float = 1.0, spread: float = 1.0, seed: int = 0, states: int = STATES
    ) -> tuple[float, float]:
        """Return the largest relative errors of M and of the forces at random states."""
        state = self.states(control, spread, seed, states)
        evaluate = tape_evaluator(self.system)
        own = {**state, "a": np.zeros_like(state["v"]), "lam": np.zeros((states, len(self.system.multipliers)))}
        M, r = evaluate("mass", own)["M"], evaluate("residual", own)["r"]
        expected = [self.equations(*(own[name][k] for name in ("q", "v", "u", "z"))) for k in range(states)]
        mass, bias, sizes = (np.array(part) for part in zip(*expected, strict=True))
        floor = float(np.max(np.linalg.norm(sizes, axis=1), initial=1e-9)) * 1e-3
        return relative_error(M, mass, 2), float(
            np.max(
                np.linalg.norm(r[:, : self.system.nv] - bias, axis=1) / np.maximum(np.linalg.norm(sizes, axis=1), floor)
            )
        )

    def rates(self, *, seed: int = 0, states: int = STATES) -> tuple[Array, Array]:
        """Return the rates of internal states at random states, (states, nz), and MuJoCo's of activations."""
        state = self.states(1.0, 1.0, seed, states)
        own = tape_evaluator(self.system)("internal_rate", state)["zdot"]
        expected = []
        for k in range(states):
            self.equations(*(state[name][k] for name in ("q", "v", "u", "z")))
            expected.append(self.data.act_dot.copy())
        return own, np.array(expected)

    def sensors(self, *, seed: int = 0, states: int = STATES) -> dict[str, tuple[Array, Array]]:
        """Return by name the outputs of sensors at random states and accelerations, and MuJoCo's values."""
        state = self.states(1.0, 1.0, seed, states)
        state["a"] = np.random.default_rng(seed + 1).standard_normal(state["v"].shape)
        values = tape_evaluator(self.system)("outputs", state)["y"]
        starts = np.cumsum([0, *(len(output.values) for output in self.scene.outputs)])
        own = {
            output.name: values[:, a:b] for output, a, b in zip(self.scene.outputs, starts, starts[1:], strict=False)
        }
        expected = []
        for k in range(states):
            self.equations(*(state[name][k] for name in ("q", "v", "u", "z")))
            A, drift = self.place(state["q"][k], state["v"][k]), self._drift(state["q"][k], state["v"][k])
            self.data.qacc[:], self.data.time = A @ state["a"][k] + drift, float(np.ravel(state["t"][k])[0])
            mujoco.mj_rnePostConstraint(self.model, self.data)
            for stage in (mujoco.mj_sensorPos, mujoco.mj_sensorVel, mujoco.mj_sensorAcc):
                stage(self.model, self.data)
            expected.append(self.data.sensordata.copy())
        theirs = np.array(expected)
        result = {}
        for index in range(self.model.nsensor):
            name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_SENSOR, index)
            start, size = self.model.sensor_adr[index], self.model.sensor_dim[index]
            if name in own:
                result[name] = own[name], theirs[:, start : start + size]
        return result

    def constraints(self, q: Array) -> tuple[Array, Array]:
        """Return matrix and violation of the constraints at a configuration, which MuJoCo's data takes too."""
        self.place(q, np.zeros(self.system.nv))
        evaluate = tape_evaluator(self.system)
        state = {"q": q, "v": np.zeros(self.system.nv), "t": np.zeros(1)}
        B = evaluate("constraint_jacobian", state)["B"]
        return B.reshape(-1, self.system.nv), evaluate("constraint", state)["Phi"]

    def states(self, control: float, spread: float, seed: int, count: int) -> dict[str, Array]:
        rng = np.random.default_rng(seed)
        state = dict(random_states(self.system, count, rng))
        for factor in self.system.factors:
            if factor.group == "R":
                state["q"][:, factor.q_start] *= spread
        state["u"] = control * rng.uniform(-1.0, 1.0, (count, self.system.nu))
        state["z"] = control * rng.uniform(-1.0, 1.0, (count, self.system.nz))
        return state
