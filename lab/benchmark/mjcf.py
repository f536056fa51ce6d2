# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""
The machines as MJCF, with each effect in a form that MuJoCo has of its own where it has one.

An element stands in the text only where its number differs from zero, so a machine without effects
is the file that entrants get (`lab benchmark --make` writes it). Numbers are those of the tables
beside this file: SI, angles seen from the motor.
"""

from collections.abc import Mapping
import math

STEP_S = 2.5e-4         # of MuJoCo's integrator
# MuJoCo's stiffest dry friction at this step; its default lets a joint creep under load.
STIFF = 'solreffriction="0.001 1" solimpfriction="0.999 0.999 1"'
LINK_MASS, GRAVITY = 20.0, 9.81     # [kg], so heavy that arm and inertia are small; [m/s^2]
Numbers = Mapping[str, float]


def mjcf(name: str, n: Numbers) -> str:
    """Return a machine, 'joint' or 'axis', with these numbers as a text in MJCF."""
    bodies, rest = {'joint': _joint, 'axis': _axis}[name](n)
    return (f'<mujoco model="{name}">\n  <option timestep="{STEP_S}" integrator="implicitfast" '
            f'gravity="0 0 -{GRAVITY}" jacobian="dense">\n    <flag contact="disable"/>\n'
            f'  </option>\n  <worldbody>\n{bodies}  </worldbody>\n{rest}</mujoco>\n')


def _body(name: str, kind: str, inertia: float, words: str, inner: str = '') -> str:
    """Return a body on one joint, a hinge or a slide, whose centre lies on its axis."""
    return (f'    <body name="{name}">\n      <joint name="{name}" type="{kind}" axis="1 0 0" '
            f'{words} {STIFF}/>\n      <inertial pos="0 0 0" mass="{inertia:.9g}" '
            f'diaginertia="{inertia:.9g} {inertia:.9g} {inertia:.9g}"/>\n{inner}    </body>\n')


def _hung(n: Numbers, kind: str, last: float) -> tuple[str, float]:
    """Return what hangs on the last body by a spring, and its inertia or mass."""
    share = n.get('hung_share', 0.0) * last
    if not share:
        return '', 0.0
    turn = 2.0 * math.pi * n['hung_hz']
    return _body('hung', kind, share, f'stiffness="{share * turn ** 2:.9g}" '
                 f'damping="{2.0 * n["hung_damping"] * share * turn:.9g}"'), share


def _own_motor(n: Numbers) -> str:
    """Return MuJoCo's motor without a current: it cogs, or rubs as LuGre's bristles do."""
    words = ''
    if n.get('ripple'):
        words += (f' cogging="{n["ripple"]:.9g} {n["ripple_cycles"]:.9g} '
                  f'{n["ripple_phase"]:.9g}"')
    if n.get('bristles'):
        # bristles as stiff as they bend, with 0.3 of the damping that would be critical
        stiff = n['coulomb'] / n['bristles']
        words += (f' lugre="{stiff:.9g} {0.6 * math.sqrt(stiff * n["motor"]):.9g} '
                  f'{n["coulomb"]:.9g} {n["coulomb"] + n.get("stribeck", 0.0):.9g} '
                  f'{n.get("stribeck_rate", 1.0):.9g}"')
    return words and (f'    <dcmotor name="own" joint="motor" motorconst="1e-9" '
                      f'resistance="1"{words}/>\n')


def _shaft(n: Numbers) -> str:
    """Return a spring between motor and load, with what else a tendon has."""
    gap = n.get('half_gap', 0.0)
    rubs = (f' frictionloss="{n["shaft_friction"]:.9g}" {STIFF}' if n.get('shaft_friction')
            else '')
    return ('  <tendon>\n    <fixed name="shaft" '
            f'stiffness="{n["stiffness"]:.9g} 0 {n.get("hardening", 0.0) * n["stiffness"]:.9g}" '
            f'damping="{n["damping"]:.9g}" springlength="{0.0 - gap:.9g} {gap:.9g}"{rubs}>\n'
            '      <joint joint="motor" coef="1"/><joint joint="load" coef="-1"/>\n'
            '    </fixed>\n  </tendon>\n')


def _rubbing(n: Numbers) -> str:
    """Return friction and spring of the driven joint."""
    return (f'damping="{n["viscous"]:.9g} {n.get("quadratic", 0.0):.9g}" '
            f'frictionloss="{0.0 if n.get("bristles") else n["coulomb"]:.9g}" '
            f'stiffness="{n.get("spring", 0.0):.9g}"')


def _stop(n: Numbers) -> str:
    """Return a soft stop inside the way."""
    at = n.get('stop_at', 0.0)
    return at and (f' limited="true" range="{min(at, -1e3 * at):.9g} {max(at, -1e3 * at):.9g}" '
                   'solreflimit="0.03 1" solimplimit="0.5 0.95 0.5"') or ''


def _joint(n: Numbers) -> tuple[str, str]:
    """Return a motor, a shaft and a load: bodies, and what joins, drives and reads them."""
    hung, share = _hung(n, 'hinge', n['load'])
    bodies = _body('motor', 'hinge', n['motor'], _rubbing(n))
    bodies += _body('load', 'hinge', n['load'] - share, _stop(n), hung)
    rest = _shaft(n)
    if n.get('gravity'):
        # the link itself turns behind the gear, where gravity pulls at its centre of mass
        gear, phase = n['gear'], n['gravity_phase']
        arm = gear * n['gravity'] / (LINK_MASS * GRAVITY)
        bodies += ('    <body name="link"><joint name="link" type="hinge" axis="1 0 0"/>'
                   f'<inertial pos="0 {-arm * math.sin(phase):.9g} {arm * math.cos(phase):.9g}" '
                   f'mass="{LINK_MASS}" diaginertia="1e-12 1e-12 1e-12"/></body>\n')
        rest += (f'  <equality><joint joint1="link" joint2="load" polycoef="0 {1.0 / gear:.9g} '
                 '0 0 0" solref="0.001 1" solimp="0.999 0.999 1"/></equality>\n')
    return bodies, rest + _ends(n)


def _axis(n: Numbers) -> tuple[str, str]:
    """Return a carriage on a screw."""
    hung, share = _hung(n, 'slide', n['motor'])
    return (_body('motor', 'slide', n['motor'] - share, _rubbing(n) + _stop(n), hung),
            _ends(n))


def _ends(n: Numbers) -> str:
    """Return the current loop, a lag that may be late, MuJoCo's own motor, and the sensors."""
    late = ''
    if n.get('delay'):
        late = f' delay="{n["delay"]:.9g}" nsample="{math.ceil(n["delay"] / STEP_S) + 2}"'
    return (f'  <actuator>\n    <general name="current" joint="motor" dyntype="filterexact" '
            f'dynprm="{n["current_lag"]:.9g}" gainprm="1" gear="{n["constant"]:.9g}"{late}/>\n'
            f'{_own_motor(n)}  </actuator>\n  <sensor><jointpos name="position" joint="motor"/>'
            '<actuatorfrc name="current" actuator="current"/></sensor>\n')
