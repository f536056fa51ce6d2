# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
Enter a residual of inverse dynamics: `python -m lab.benchmark.methods.residuals CASE`.

The measured current is regressed on the motion; candidate terms of the joint's effects are added
while BIC gains, as SINDy does (S. Brunton et al., PNAS 113, 2016). What a Gaussian process
predicts of the rest, in samples that it did not see, is 'unknown'. Nothing is simulated, so the
fourth test is not predicted. The constants were chosen on eight practice cases.
"""

from lab.benchmark.methods.case import CaseFolder, enter
from lab.joints.mechanism import FloatArray
import numpy as np
from scipy.signal import savgol_filter
from simgap.errors import UserError
from simgap.model import Log
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, WhiteKernel

KNOWN, SOFT = 1.15, 6.0     # times the nominal inertia over constant, and compliance
UNEXPLAINED = 0.5       # of the variance, which the process predicts where 'unknown' is even
SAMPLES, WINDOW_S = 400, 0.04   # that the process learns from; of the smoothing polynomial
WORTH, GAIN = 0.1, 5.0  # of a sample in BIC, and of BIC for one term more


def terms(log: Log) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
    """Return the current, shape (n,), base terms, (n, 6), and candidates, (n, k), by effect."""
    step = float(np.median(np.diff(log.time)))
    times = np.arange(log.time[0], log.time[-1], step)
    q, i = (np.interp(times, log.time, log[name]) for name in ('motor_rad', 'current_A'))
    window = max(round(WINDOW_S / step) | 1, 7)
    q, w, a, jerk = (savgol_filter(q, window, 4, deriv=order, delta=step) for order in range(4))
    i = savgol_filter(i, window, 4)
    moving, side = np.abs(w) > 0.3, np.sign(w)
    # a soft shaft shows in the second derivative of the acceleration, a late channel in the first
    base = np.column_stack([a, w, side, np.ones(q.size), jerk, np.gradient(jerk, step)])
    candidates = {
        'motor.friction_asymmetry': [np.abs(side)],
        'motor.stribeck': [side * np.exp(-(w / 2.0) ** 2), side * np.exp(-(w / 6.0) ** 2)],
        'load.imbalance': [np.sin(q / 30.0), np.cos(q / 30.0)],
        'encoder.cyclic_error': [w * np.sin(q), w * np.cos(q)],
        **{f'motor.torque_ripple {k}': [np.sin(k * q), np.cos(k * q)] for k in range(2, 15)}}
    # what a derivative is wrong by grows with the current
    weight = (1.0 / (1.0 + 3.0 * np.abs(i)))[moving, None]
    return i[moving] * weight[:, 0], base[moving] * weight, {
        name: np.column_stack(columns)[moving] * weight for name, columns in candidates.items()}


def left(current: FloatArray, columns: FloatArray) -> tuple[FloatArray, float]:
    """Return what a regression leaves (n,), and its BIC over two, negative."""
    found = np.linalg.lstsq(columns, current, rcond=None)[0]
    rest, worth = current - columns @ found, WORTH * current.size
    return rest, -0.5 * (worth * np.log(np.mean(rest ** 2)) + columns.shape[1] * np.log(worth))


def main(case: CaseFolder) -> None:
    """Choose terms, and let a process tell what they leave."""
    if case.sheet['machine'] != 'joint':
        raise UserError(f'{case.folder}: its terms are those of a joint; leave the axis out')
    parts = [terms(log) for log in case.logs]
    current, base = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    library = {name: np.concatenate([part[2][name] for part in parts]) for name in parts[0][2]}
    n, named = case.sheet['nominal'], set[str]()
    columns, (rest, before) = base, left(current, base)
    for _ in range(2):
        (now, name), *_ = sorted(((left(current, np.column_stack([columns, more]))[1], name)
                                  for name, more in library.items()), reverse=True)
        if now < before + GAIN:
            break
        columns = np.column_stack([columns, library[name]])
        rest, before = left(current, columns)
        named.add(name.partition(' ')[0])
    found = n['constant'] * np.linalg.lstsq(columns, current, rcond=None)[0]
    if found[0] > KNOWN * (n['motor'] + n['load']):
        named.add('load.inertia')
    elif found[5] > SOFT * n['load'] ** 2 / n['stiffness']:
        named.add('gearbox.compliance')
    if max(float(np.max(np.abs(log['current_A']))) for log in case.logs) < (
            0.95 * n['current_limit']):
        named.add('controller.current_limit')
    chosen = np.random.default_rng(0).permutation(current.size)[:2 * SAMPLES]
    state = np.column_stack([base[:, :2], library['load.imbalance'][:, 0], current])
    state, target = (state / np.std(state, axis=0))[chosen], rest[chosen]
    process = GaussianProcessRegressor(RBF(np.ones(4)) + WhiteKernel(), normalize_y=True)
    process.fit(state[:SAMPLES], target[:SAMPLES])
    wrong = target[SAMPLES:] - process.predict(state[SAMPLES:])
    explained = 1.0 - float(np.var(wrong) / np.var(target[SAMPLES:]))
    unknown = 1.0 / (1.0 + np.exp(-(explained - UNEXPLAINED) / 0.07))
    case.write([{'effects': effects, 'probability': float(share)} for share, effects in sorted(
        [(1.0 - unknown, sorted(named) or ['none']), (unknown, ['unknown'])], reverse=True)])


if __name__ == '__main__':
    enter(main)
