# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The alternatives to the emulator, each set up as its own documentation advises.

All use the same compiled equations (`bench.equations`) and run one piece of the command at a time,
so that none steps over a jump. A solver that locates events locates the stops and break-aways of
the bodies. For the others the rate decides between stick and slip, within a threshold that is
swept like the tolerance.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from antenna_drive.article.experiments import DriveExperiment
from antenna_drive.parameters.records import record_of
from lab.bench import equations
from lab.bench.equations import BODIES, FloatArray, IntArray, STATES
import numpy as np

# Output interval of every run, 200 Hz as drives are recorded; the solver's steps are its own [s].
GRID_S = 5e-3
# The rate decides between stick and slip; see `equations`.
BY_RATE = 2
# Start and end [s], value and slope of a part of the command.
Piece = tuple[float, float, float, float]
# A guard that falls below zero within this time has jumped; smaller steps do not help [s].
_JUMP_S = 1e-7
# Sizes of the states, for absolute tolerances: V; A, A, A, rad, rad/s; V; rad, rad/s.
_SIZES = np.array([1.0, *2 * (1.0, 1.0, 1.0, 1.0, 1.0), 1.0, 1.0, 1.0, *4 * (1e-4, 1e-4)])


@dataclass(frozen=True)
class Setting:
    """The settings of a peer."""

    method: str             # the peer's name of the integrator
    tolerance: float        # relative; absolute ones are this times the size of each state
    threshold: float = 0.0  # rotor rate that counts as zero [rad/s]; 0 to locate stops as events

    def __str__(self) -> str:
        """Return the setting as text."""
        friction = f'|w| < {self.threshold:g} sticks' if self.threshold else 'stops located'
        return f'{self.method}, tolerance {self.tolerance:g}, {friction}'


class Problem:
    """An experiment for solvers: equations, constants, command and modes of the friction."""

    def __init__(self, experiment: DriveExperiment, compile_equations: bool = True) -> None:
        """Prepare the experiment, with compiled or plain Python equations."""
        self.experiment = experiment
        self.drive = drive = experiment.drive()
        self.p = equations.constants(drive)
        self.record = record_of(drive)
        self.start = equations.initial_state(drive)
        self.pieces = equations.pieces(experiment)
        self.grid: FloatArray = GRID_S * np.arange(
            round(experiment.duration / GRID_S) + 1, dtype=np.float64)
        self.rates, self.guards, self.settle = _compiled() if compile_equations else _plain()
        self.slip: IntArray = np.zeros(BODIES, np.int64)
        self.threshold = 0.0
        self.close = 0.0
        self.absolute = _SIZES
        self._g = np.zeros(BODIES)
        self._compile()

    def _compile(self) -> None:
        x = self.start.copy()
        self.rates(x, 0.0, self.slip, 0.0, self.p, np.zeros(STATES))
        self.guards(x, self.slip, self.p, self._g)
        self.settle(x, self.slip, 0, False, self.p)
        self.slip[:] = 0

    def begin(self, setting: Setting) -> FloatArray:
        """Put every body at rest and return the initial state."""
        self.threshold = setting.threshold
        # rate of a rotor that counts as zero when another body stops [rad/s]
        self.close = setting.tolerance
        self.slip[:] = BY_RATE if setting.threshold else 0
        return self.start.copy()

    def right_hand_side(self, start: float, value: float, slope: float,
                        ) -> Callable[[float, FloatArray], FloatArray]:
        """Return f(t, x) within a piece of the command."""
        rates, slip, threshold, p = self.rates, self.slip, self.threshold, self.p

        def f(t: float, x: FloatArray) -> FloatArray:
            dx = np.empty(STATES)
            rates(x, value + slope * (t - start), slip, threshold, p, dx)
            return dx

        return f

    def guard(self, body: int, x: FloatArray) -> float:
        """Return the function that falls through zero when a body stops or breaks away."""
        self.guards(x, self.slip, self.p, self._g)
        return float(self._g[body])

    def switch(self, x: FloatArray, bodies: set[int], breaks: bool = False) -> None:
        """
        Update stick and slip of `bodies`, whose guards fell through zero, and of others that stop.

        The rate of a body that stops becomes zero in `x` (STATES,). With `breaks` a sticking body
        slips even if x does not require it.
        """
        self.guards(x, self.slip, self.p, self._g)
        for body in range(BODIES):
            if body in bodies or (self._g[body] <= self.close and not self._released(x, body)):
                self.settle(x, self.slip, body, breaks and body in bodies, self.p)

    def _released(self, x: FloatArray, body: int) -> bool:
        # a body that has just begun to slip has no rate yet, and must not be stopped for that
        rate = x[equations.HUB_RATE] if body == 2 else x[
            1 + equations.MOTOR_STATES * body + equations.RATE]
        return bool(self.slip[body] != 0 and rate == 0.0)

    def within(self, start: float, end: float) -> FloatArray:
        """Return the times of the grid after `start` up to `end`."""
        inside = (self.grid > start + 1e-9) & (self.grid <= end + 1e-9)
        return np.minimum(self.grid[inside], end)

    def readings(self, states: FloatArray) -> FloatArray:
        """Return the sensors' signals of states on the grid, shapes (STATES, n), (n, 6)."""
        return equations.readings(states, self.p)


@cache
def _compiled() -> Any:
    import numba
    return equations.equations(numba.njit(error_model='numpy', inline='never'))


@cache
def _plain() -> Any:
    return equations.equations()


def solve_ivp(problem: Problem, setting: Setting) -> FloatArray:
    """Run with scipy.integrate.solve_ivp, restarted at each jump and each stop."""
    from scipy.integrate import solve_ivp as solve

    x = problem.begin(setting)
    out = np.empty((STATES, problem.grid.size))
    out[:, 0] = x
    row = 1
    events = [] if setting.threshold else [_event(problem, body) for body in range(BODIES)]
    for start, end, value, slope in problem.pieces:
        f = problem.right_hand_side(start, value, slope)
        t = start
        while t < end:
            times = problem.within(t, end)
            also_end = times.size == 0 or times[-1] != end
            found = solve(f, (t, end), x, method=setting.method, rtol=setting.tolerance,
                          atol=setting.tolerance * problem.absolute, events=events or None,
                          t_eval=np.append(times, end) if also_end else times)
            if found.status < 0:
                raise RuntimeError(found.message)
            kept = len(found.t) - (1 if also_end and found.status == 0 else 0)
            if kept:
                out[:, row:row + kept] = found.y[:, :kept]
                row += kept
            if found.status == 0:
                x, t = found.y[:, -1].copy(), end
            else:
                struck = {body for body in range(BODIES) if len(found.t_events[body])}
                body = min(struck)
                x, t = found.y_events[body][-1].copy(), float(found.t_events[body][-1])
                problem.switch(x, struck, breaks=True)
    return problem.readings(out)


def _event(problem: Problem, body: int) -> Any:
    def event(t: float, x: FloatArray) -> float:
        return problem.guard(body, x)

    event.terminal = True  # type: ignore[attr-defined]
    event.direction = -1.0  # type: ignore[attr-defined]
    return event


def python_control(problem: Problem, setting: Setting) -> FloatArray:
    """Run with python-control's input_output_response, one piece of the command at a time."""
    import control

    x = problem.begin(setting)
    out = np.empty((STATES, problem.grid.size))
    out[:, 0] = x
    row = 1
    rates, slip, threshold, p = problem.rates, problem.slip, problem.threshold, problem.p

    def update(t: float, x: FloatArray, u: FloatArray, params: Any) -> FloatArray:
        dx = np.empty(STATES)
        rates(x, u[0], slip, threshold, p, dx)
        return dx

    system = control.nlsys(update, None, inputs=1, outputs=STATES, states=STATES, name='drive')
    for start, end, value, slope in problem.pieces:
        times = problem.within(start, end)
        also_end = times.size == 0 or times[-1] != end
        knots = np.array([start, end])
        found = control.input_output_response(
            system, knots, value + slope * (knots - start), x,
            t_eval=np.concatenate(([start], times, [end] if also_end else [])),
            solve_ivp_method=setting.method,
            solve_ivp_kwargs={'rtol': setting.tolerance,
                              'atol': setting.tolerance * problem.absolute})
        kept = times.size
        out[:, row:row + kept] = found.states[:, 1:kept + 1]
        row += kept
        x = np.array(found.states[:, -1])
    return problem.readings(out)


def pathsim(problem: Problem, setting: Setting) -> FloatArray:
    """Run with PathSim: an ODE block, a source for the command, events for the stops."""
    from pathsim import Connection, Simulation, solvers
    from pathsim.blocks import ODE, Scope, Source
    from pathsim.events import Schedule

    rates, slip, p = problem.rates, problem.slip, problem.p
    x = problem.begin(setting)
    threshold = problem.threshold
    piece = [0]

    def command(t: float) -> float:
        start, _, value, slope = problem.pieces[piece[0]]
        return value + slope * (t - start)

    def f(x: FloatArray, u: FloatArray, t: float) -> FloatArray:
        dx = np.empty(STATES)
        rates(x, u[0], slip, threshold, p, dx)
        return dx

    source = Source(command)
    drive = ODE(f, x)
    events: list[Any] = [] if setting.threshold else _pathsim_stops(problem, drive)

    def turn(t: float) -> None:
        piece[0] = min(piece[0] + 1, len(problem.pieces) - 1)

    # the schedule ends a step at each jump of the command
    if len(problem.pieces) > 1:
        first, period = problem.pieces[0][1], problem.pieces[1][1] - problem.pieces[1][0]
        events.insert(0, Schedule(t_start=first, t_period=period, func_act=turn, tolerance=1e-9))
    scope = Scope(sampling_period=GRID_S)
    simulation = Simulation(
        [source, drive, scope],
        [Connection(source, drive), *(Connection(drive[k], scope[row])
                                      for row, k in enumerate(equations.READ_STATES))],
        events, dt=1e-4, dt_max=GRID_S, Solver=getattr(solvers, setting.method), log=False,
        tolerance_lte_rel=setting.tolerance,
        tolerance_lte_abs=setting.tolerance * problem.absolute)
    simulation.run(problem.grid[-1])
    times, found = scope.read()
    states = np.zeros((STATES, problem.grid.size))
    states[list(equations.READ_STATES)] = _on_grid(
        problem.grid, np.asarray(times, np.float64), np.asarray(found, np.float64))
    return problem.readings(states)


def _pathsim_stops(problem: Problem, drive: Any) -> list[Any]:
    """Return an event for each body that stops or breaks away."""
    from pathsim.events import ZeroCrossingDown

    before = [0.0] * BODIES

    def stop(body: int, t: float) -> None:
        x = np.array(drive.engine.state)
        problem.switch(x, {body})
        drive.engine.set(x)

    def guard(body: int, t: float) -> float:
        g = problem.guard(body, drive.engine.state)
        if g > 0.0:
            before[body] = t
        elif abs(t - before[body]) < _JUMP_S:
            return 0.0
        return g

    return [ZeroCrossingDown(func_evt=partial(guard, body), func_act=partial(stop, body),
                             tolerance=1e-6) for body in range(BODIES)]


def _on_grid(grid: FloatArray, times: FloatArray, states: FloatArray) -> FloatArray:
    # a scope may sample slightly late if a step ends elsewhere
    if len(times) == len(grid) and np.allclose(times, grid, atol=1e-9):
        return states
    return np.array([np.interp(grid, times, row) for row in states])


def drake(problem: Problem, setting: Setting) -> FloatArray:
    """Run with Drake's Simulator: a LeafSystem, with witness functions for the stops."""
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

    x = problem.begin(setting)
    present = [problem.pieces[0]]
    simulator = Simulator(_drake_system(problem, setting, present))
    ApplySimulatorConfig(SimulatorConfig(
        integration_scheme=setting.method, max_step_size=0.1, accuracy=setting.tolerance,
        use_error_control=True), simulator)
    context: Any = simulator.get_mutable_context()
    context.SetContinuousState(x)
    context.SetAccuracy(setting.tolerance)
    simulator.Initialize()
    out = np.empty((STATES, problem.grid.size))
    out[:, 0] = x
    row = 1
    for piece in problem.pieces:
        present[0] = piece
        start, end, _, _ = piece
        for t in problem.within(start, end):
            simulator.AdvanceTo(t)
            out[:, row] = context.get_continuous_state_vector().CopyToVector()
            row += 1
        simulator.AdvanceTo(end)
    return problem.readings(out)


def _drake_system(problem: Problem, setting: Setting, present: list[Piece]) -> Any:
    """Return the drive in the one piece of the command that is present."""
    from pydrake.systems.framework import (
        LeafSystem, UnrestrictedUpdateEvent, WitnessFunctionDirection,
    )

    rates, slip, p, threshold = problem.rates, problem.slip, problem.p, problem.threshold
    dx = np.empty(STATES)

    class DriveSystem(LeafSystem):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.DeclareContinuousState(STATES)
            self.witnesses = [] if setting.threshold else [
                self._witness(body) for body in range(BODIES)]

        def _witness(self, body: int) -> Any:
            def guard(context: Any) -> float:
                return problem.guard(body, context.get_continuous_state_vector().CopyToVector())

            def update(context: Any, event: Any, state: Any) -> None:
                vector = state.get_mutable_continuous_state().get_mutable_vector()
                x = vector.CopyToVector()
                problem.switch(x, {body})
                vector.SetFromVector(x)

            return self.MakeWitnessFunction(
                f'body {body}', WitnessFunctionDirection.kPositiveThenNonPositive, guard,
                UnrestrictedUpdateEvent(update))

        def DoGetWitnessFunctions(self, context: Any) -> list[Any]:
            return self.witnesses

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            start, _, value, slope = present[0]
            rates(context.get_continuous_state_vector().CopyToVector(),
                  value + slope * (context.get_time() - start), slip, threshold, p, dx)
            derivatives.get_mutable_vector().SetFromVector(dx)

    return DriveSystem()
