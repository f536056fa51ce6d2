# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""Which tests of the drive settle which effects, from what anyone knows who has tested drives."""

# Names of effects, in whichever component, and the test for them; no names: for any of them.
ADVICE: tuple[tuple[tuple[str, ...], str], ...] = (
    (('gravity_imbalance', 'wind_steady'),
     'The same test at two elevations far apart: gravity follows the cosine, wind does not.'),
    (('amplifier_offset', 'offset'),
     'A recording with amplifiers on at zero command, and one with each tachometer shorted.'),
    (('bias_pot', 'gain'), 'The bias voltage read with a second meter.'),
    (('coulomb_friction', 'viscous_friction', 'stribeck_friction', 'load_dependent_friction'),
     'Constant rates, at least six from creep to the fastest, in both directions.'),
    (('torque_ripple', 'ripple', 'transmission_error'),
     'One constant rate held for a minute: three revolutions of each shaft or more.'),
    (('gap', 'bull_gear_backlash', 'stiffness', 'hysteresis'),
     'Slow reversals without bias, and a bias step at rest.'),
    (('inertia', 'mode_frequency', 'mode_damping', 'extra_mode'),
     'A chirp or multisine up to 10 Hz at small amplitude with full bias.'),
    (('current_limit', 'armature_resistance', 'amplifier_gain', 'torque_constant'),
     'A square wave large enough to saturate the currents.'),
    ((), 'antenna-drive confusability shows which test separates which effects.'),
)
