# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The source of the bias and the circuit's constants, as the recorded bias voltage tells them.

The voltage tells its source: a constant, one step, or the torque-share circuit, whose equations
are then fed with the recorded currents.
"""

from collections.abc import Callable, Sequence, Set
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import product
from typing import Any

from antenna_drive.diagnosis.field_recording import FieldRecording, Note
from antenna_drive.diagnosis.sheet_settings import CIRCUITS, constants
from antenna_drive.parameters.sets import changed, Drive, TorqueShare
from antenna_drive.recording.sheet import CircuitBias, FixedBias, FixedStepBias
import numpy as np
from scipy.signal import lfilter
from simgap.machine.contract import FloatArray

CURRENTS = ('current_1', 'current_2')
STARTS = ('steady', 'zero')
# The best value is taken if the next one fits worse by this factor, and a value of a sheet is
# doubted if the best one fits better by this one.
CLEAR, DOUBT = 1.15, 2.0
# A source's voltage is constant within this scatter, and steps by more than that [V].
_CONSTANT_V, _STEP_V = 0.06, 0.2
# Share of samples of a source that may lie farther off than a step.
_ASTRAY = 0.005
# Pots are the same within this share; a pot is at the setting of a sheet within this one.
_SAME_POT, _SAME_SETTING = 0.03, 0.005
# A pot of a sheet is doubted if it is off by this share.
_OTHER_POT = 0.25
# Settings of the fade-out that are tried, as factors to the configured one. Another one than
# configured must fit better by this factor.
_FADE_OUTS, _ODD = (1.0, 0.55, 0.7, 0.85, 1.15, 1.3, 1.45), 1.3
# The circuit is fed with this much of a recording [s], at this rate [Hz].
_FED_S, _FED_HZ = 120.0, 100.0
# A smaller misfit is noise and tells nothing.
_NOISE_V = 0.03


def with_entries(recording: FieldRecording, **entries: Any) -> FieldRecording:
    """Return a recording whose sheet says more."""
    return replace(recording, sheet=replace(recording.sheet, **entries))


def of_table(entry: str, drive: Drive) -> bool:
    """Return whether the configured constants are those of either column of Table 1."""
    return any(changed(drive, constants(entry, name)) == drive for name in CIRCUITS)


def told(entry: str, misfit: Callable[[str | None], float], given: Set[str | None], drive: Drive,
         note: Note, evidence: str, undecided: str) -> str | None:
    """
    Return the column of Table 1 that recordings tell: '' for either, None for as configured.

    entry : of a sheet, 'circuit' or 'filter_1'
    misfit : returns how far off the constants of a column are, those configured for None
    given : what the sheets give, which is believed
    evidence, undecided : what the misfit is of, and what holds for either, for people
    """
    best, other = sorted(CIRCUITS, key=misfit)
    worse = misfit(other) / misfit(best)
    if given:
        if given == {other} and worse > DOUBT:
            note(f'the sheets give {entry} {other}, {evidence} like {best} ({other} fits '
                 f'{worse:.1f} times worse); the sheets are believed')
        return next(iter(given))
    if not of_table(entry, drive) and misfit(None) <= CLEAR * misfit(best):
        note(f'{entry}: the configured constants fit as well: as configured')
        return None
    if worse < CLEAR:
        note(f'{entry}: {other} fits {worse:.2f} times worse than {best}, which tells nothing; '
             f"{undecided}, unless a sheet says '{entry}: {best}' or '{entry}: {other}'")
        return ''
    note(f'{entry} {best}: inferred, {other} fits {worse:.1f} times worse')
    return best


# -- the source of the bias --------------------------------------------------------------------

def with_sources(recordings: list[FieldRecording], drive: Drive,
                 note: Note) -> list[FieldRecording]:
    """Return recordings whose sheets name the source of the bias, if its voltage was recorded."""
    found, constant = list(recordings), []
    for k, recording in enumerate(recordings):
        channel = recording.readings.get('bias_voltage')
        if channel is None or len(channel) < 2:
            continue
        seen = _source(channel.time_s, channel.values)
        given = recording.sheet.bias
        if given is None:
            found[k] = with_entries(recording, bias=seen)
            if isinstance(seen, FixedBias):
                constant.append(k)
        elif type(given) is type(seen) and not isinstance(given, CircuitBias):
            missing = {item.name: getattr(seen, item.name) for item in fields(given)
                       if getattr(given, item.name) is None}
            found[k] = with_entries(recording, bias=replace(given, **missing))
        elif type(given) is not type(seen) and not (
                isinstance(given, CircuitBias) and _saturated(recording, drive) is not None):
            note(f'{recording.name}: the sheet gives a bias of type {given.kind}, the recorded '
                 f'voltage looks like {seen.kind}; the sheet is believed')
    found = _from_circuit(found, constant, drive)
    for recording, before in zip(found, recordings, strict=True):
        if before.sheet.bias is None and recording.sheet.bias is not None:
            note(f'{recording.name}: bias {_words(recording.sheet.bias)}: inferred from its '
                 'voltage')
    return found


def _words(bias: Any) -> str:
    if isinstance(bias, CircuitBias):
        return 'from the circuit'
    if isinstance(bias, FixedBias):
        return f'from a fixed source of {bias.voltage_V:.2f} V'
    return f'from a source that steps to {bias.voltage_V:.2f} V at {bias.at_s:.2f} s'


def _from_circuit(recordings: list[FieldRecording], constant: Sequence[int],
                  drive: Drive) -> list[FieldRecording]:
    """
    Return recordings with the circuit as the source of constant voltages that it may have made.

    A small load leaves the circuit at its upper limit, where it gives a constant voltage as a
    fixed source does. It is the circuit if other recordings have the same pot. A pot that a sheet
    gives may have been set for that test alone.
    """
    pots = {k: pot for k in constant if (pot := _saturated(recordings[k], drive)) is not None}
    certain = [recording for recording in recordings
               if isinstance(recording.sheet.bias, CircuitBias) and _can_be_fed(recording)]
    known: list[float] = []
    if certain:
        known += min((_fit(certain, circuit, drive) for circuit in CIRCUITS),
                     key=lambda fit: fit.misfit).pots
    if pots and None not in _settings(certain):
        def agreeing(pot: float) -> tuple[int, float]:
            near = sum(_same(other, pot, _SAME_POT) for other in pots.values())
            return near, -abs(pot - drive.torque_share.circuit.bias_pot)
        known.append(max(pots.values(), key=agreeing))
    found = list(recordings)
    for k, pot in pots.items():
        if any(_same(pot, other, _SAME_POT) for other in known):
            found[k] = with_entries(recordings[k], bias=CircuitBias())
    return found


def _same(pot: float, other: float, share: float) -> bool:
    return abs(pot - other) < share * other


def _settings(recordings: Sequence[FieldRecording]) -> list[float | None]:
    """Return the setting of the pot that each sheet gives."""
    return [recording.sheet.bias.bias_pot if isinstance(recording.sheet.bias, CircuitBias)
            else None for recording in recordings]


def _saturated(recording: FieldRecording, drive: Drive) -> float | None:
    """Return the pot with which the circuit makes a constant voltage; None if it does not."""
    if not _can_be_fed(recording):
        return None
    voltage, load = _fed(recording)
    usual = _NOISE_V + float(np.mean(np.abs(voltage - np.median(voltage))))
    for circuit, start in product(CIRCUITS, STARTS):
        shape = _share_voltage(load, _share(circuit, drive), start)
        pot = _pot(voltage, shape)
        if 0.0 < pot < 1.0 and _misfit(voltage, shape, pot) < DOUBT * usual:
            return pot
    return None


def _can_be_fed(recording: FieldRecording) -> bool:
    return {*CURRENTS, 'bias_voltage'} <= recording.readings.keys()


def _source(time: FloatArray, voltage: FloatArray) -> CircuitBias | FixedBias | FixedStepBias:
    """Return the source that a bias voltage of shape (n,) looks like."""
    # the step that leaves the least squares about two levels
    total, number = np.cumsum(voltage)[:-1], np.arange(1, voltage.size)
    rest = voltage.size - number
    at = int(np.argmax(total ** 2 / number + (voltage.sum() - total) ** 2 / rest)) + 1
    before, after = float(np.median(voltage[:at])), float(np.median(voltage[at:]))
    if abs(after - before) < _STEP_V:
        before = after = float(np.median(voltage))
    off = np.abs(voltage - np.where(np.arange(voltage.size) < at, before, after))
    if 1.4826 * np.median(off) > _CONSTANT_V or np.mean(off > _STEP_V) > _ASTRAY:
        return CircuitBias()
    if before == after:
        return FixedBias(voltage_V=round(before, 3))
    if abs(before) > _STEP_V:
        return CircuitBias()
    return FixedStepBias(voltage_V=round(after, 3),
                         at_s=round(0.5 * float(time[at - 1] + time[at]), 4))


# -- the torque-share circuit ------------------------------------------------------------------

@dataclass(frozen=True)
class _Fit:
    """How well one circuit fits all recordings."""

    misfit: float  # mean of what is off [V]
    scale: float  # what the pot does over what the sheets say of it; 1 if they do not
    settings: tuple[float, ...]  # of the pot, by recording: that of its sheet, or one that fits
    starts: tuple[str, ...]  # of the circuit, by recording

    @property
    def pots(self) -> tuple[float, ...]:
        """Return for each recording what the pot does."""
        return tuple(self.scale * setting for setting in self.settings)


def with_circuit(recordings: list[FieldRecording], drive: Drive,
                 note: Note) -> list[FieldRecording]:
    """Return recordings whose sheets give the circuit's constants, pot and start."""
    fed = [k for k, recording in enumerate(recordings)
           if isinstance(recording.sheet.bias, CircuitBias) and _can_be_fed(recording)]
    if not fed:
        return recordings
    found = list(recordings)
    fit_of = cache(lambda circuit: _fit([recordings[k] for k in fed], circuit, drive))
    # so small a load may leave either circuit at its limit, where they give the same voltage
    named = told('circuit', lambda circuit: fit_of(circuit).misfit,
                 {recordings[k].sheet.circuit for k in fed} - {None}, drive, note,
                 'the recorded bias voltage looks', 'as Filter 1')
    fit = min(map(fit_of, CIRCUITS), key=lambda fit: fit.misfit) if named == '' else fit_of(named)
    for k, setting, pot, start in zip(fed, fit.settings, fit.pots, fit.starts, strict=True):
        bias = recordings[k].sheet.bias
        assert isinstance(bias, CircuitBias)
        added: dict[str, Any] = {}
        known = ''
        if bias.bias_pot is None:
            added['bias_pot'] = setting
            known = f' (configured {drive.torque_share.circuit.bias_pot:g})'
        elif abs(fit.scale - 1.0) > _OTHER_POT:
            note(f'{recordings[k].name}: the sheet gives bias_pot {bias.bias_pot:g}, the bias '
                 f'voltage looks like {pot:.2f}; the sheet is believed')
        if bias.start is None:
            added['start'] = start
        if added:
            note(f'{recordings[k].name}: ' + ', '.join(
                f'{name} {value}' for name, value in added.items()) + f': inferred{known}')
        found[k] = with_entries(recordings[k], bias=replace(bias, **added))
    # what one recording tells holds for the whole machine
    return [with_entries(recording, circuit=recording.sheet.circuit or named or None)
            for recording in found]


def _fit(recordings: Sequence[FieldRecording], circuit: str | None, drive: Drive) -> _Fit:
    """Feed a circuit with the recorded currents, and compare its voltage with the recorded one."""
    fed = [_fed(recording) for recording in recordings]
    voltages, given = [voltage for voltage, _ in fed], _settings(recordings)
    fits = []
    # the fade-out may be set otherwise than configured: that is no reason to doubt the circuit
    for factor in _FADE_OUTS:
        share = _share(circuit, drive)
        share = replace(share, fade_out_voltage=factor * share.fade_out_voltage)
        starts, shapes = [], []
        for recording, (voltage, load) in zip(recordings, fed, strict=True):
            bias = recording.sheet.bias
            assert isinstance(bias, CircuitBias)
            tried = {start: _share_voltage(load, share, start)
                     for start in ((bias.start,) if bias.start else STARTS)}
            starts.append(min(tried, key=lambda start: _misfit(
                voltage, tried[start], _pot(voltage, tried[start]))))
            shapes.append(tried[starts[-1]])
        scale, settings = _pots(voltages, shapes, given)
        misfit = _misfit(np.concatenate(voltages), np.concatenate(
            [setting * shape for setting, shape in zip(settings, shapes, strict=True)]), scale)
        fits.append(_Fit(misfit * (1.0 if factor == 1.0 else _ODD), scale, settings,
                         tuple(starts)))
    return min(fits, key=lambda fit: fit.misfit)


def _pots(voltages: Sequence[FloatArray], shapes: Sequence[FloatArray],
          given: Sequence[float | None]) -> tuple[float, tuple[float, ...]]:
    """
    Return the scale of the pot and its setting in each recording.

    The pot of a real machine does a little more or less than its setting says, in every
    recording. Where sheets give settings they tell how much. The others share one setting, which
    is that of a sheet if it is nearly the same.
    """
    def fitted(of_a_sheet: bool) -> float:
        chosen = [(voltage, shape if setting is None else setting * shape)
                  for voltage, shape, setting in zip(voltages, shapes, given, strict=True)
                  if (setting is not None) == of_a_sheet]
        return _pot(*map(np.concatenate, zip(*chosen, strict=True))) if chosen else 0.0

    scale = fitted(True) or 1.0
    own = fitted(False) / scale
    said = [setting for setting in given
            if setting is not None and _same(own, setting, _SAME_SETTING)]
    own = min(said, key=lambda setting: abs(setting - own)) if said else round(min(own, 1.0), 3)
    return scale, tuple(own if setting is None else setting for setting in given)


def _share(circuit: str | None, drive: Drive) -> TorqueShare:
    """Return the constants of Table 1, or without a name those of the configuration."""
    if circuit is not None:
        drive = changed(drive, constants('circuit', circuit))
    return drive.torque_share.circuit


def _fed(recording: FieldRecording) -> tuple[FloatArray, FloatArray]:
    """Return bias voltage [V] and sum of the currents [article A] on an even grid from zero."""
    time = np.arange(0.0, min(recording.end, recording.onset + _FED_S), 1.0 / _FED_HZ)
    voltage, one, two = (np.interp(time, channel.time_s, channel.values) for channel in (
        recording.readings[name] for name in ('bias_voltage', *CURRENTS)))
    return voltage, one + two


def _share_voltage(load: FloatArray, share: TorqueShare, start: str) -> FloatArray:
    """Return the voltage of the circuit at a pot of 1, Eq. (9)-(13), fed with a load."""
    keep = np.exp(-share.k_3 / _FED_HZ)
    seen = lfilter([(keep - 1.0) * share.current_to_voltage], [1.0, -keep], load)
    keep = np.exp(-share.s_2 / _FED_HZ)
    asked = share.k_2 / share.s_2 * (share.fade_out_voltage + share.g_4 * np.abs(seen))
    first = share.k_2 / share.s_2 * share.fade_out_voltage if start == 'steady' else 0.0
    voltage, _ = lfilter([1.0 - keep], [1.0, -keep], asked, zi=[keep * first])
    return np.clip(voltage, share.saturation_low, share.saturation_high)


def _pot(voltage: FloatArray, shape: FloatArray) -> float:
    """Return the pot that fits best: least sum of absolute misfits."""
    there = shape > 1e-3
    if not there.any():
        return 0.0
    ratio, weight = voltage[there] / shape[there], shape[there]
    order = np.argsort(ratio)
    half = np.searchsorted(np.cumsum(weight[order]), 0.5 * weight.sum())
    return float(ratio[order[half]])


def _misfit(voltage: FloatArray, shape: FloatArray, pot: float) -> float:
    return _NOISE_V + float(np.mean(np.abs(voltage - pot * shape)))
